"""Writing into Blender: all of it or none of it."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import identity

bpy = pytest.importorskip("bpy")

from radiosity_addon.bake.exported_object import ExportedObject  # noqa: E402
from radiosity_addon.bake_job import Job, Result, apply  # noqa: E402
from radiosity_addon.settings import Settings  # noqa: E402
from radiosity_addon.solver.solution import Statistics  # noqa: E402

NAMES = ("First", "Second")
SIZE = 4


@pytest.fixture
def pair(blender):
    """Two squares with meshes of their own, four corners each."""
    for name in NAMES:
        mesh = blender.data.meshes.new(name)
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [], [(0, 1, 2, 3)])
        blender.context.scene.collection.objects.link(blender.data.objects.new(name, mesh))
    return [blender.data.objects[name] for name in NAMES]


def a_job(made=(), **options) -> Job:
    """A job whose targets are the pair; what only ``run`` reads is left out."""
    loops = np.arange(4, dtype=np.int32)
    targets = tuple(
        ExportedObject(name, 0, 2, None, identity(4).tocsr(), loops, loops) for name in NAMES
    )
    settings = Settings(resolution=SIZE, **options)
    return Job(settings, None, targets, (), tuple(made), ())


def a_result(*values: float, shape=(4, 3)) -> Result:
    return Result(tuple(np.full(shape, v, np.float32) for v in values), Statistics(), ())


def colors(item, name="Radiosity") -> np.ndarray:
    data = item.data.color_attributes[name].data
    values = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", values)
    return values.reshape(-1, 4)[:, :3]


def pixels(name) -> np.ndarray:
    image = bpy.data.images[name]
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values


def test_colors_of_each_object(pair):
    assert apply(bpy.context, a_job(), a_result(0.25, 0.75)) == ()
    assert (colors(pair[0]) == 0.25).all() and (colors(pair[1]) == 0.75).all()


def test_images_and_files_of_each_object(pair, tmp_path):
    job = a_job(target="image", image_dir=str(tmp_path), format="hdr")
    apply(bpy.context, job, a_result(0.25, 0.75, shape=(SIZE, SIZE, 4)))
    assert (pixels("Radiosity_First") == 0.25).all() and (pixels("Radiosity_Second") == 0.75).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "Radiosity_First.hdr",
        "Radiosity_Second.hdr",
    ]


def spoil(result: Result) -> Result:
    """The second object's colors have one row too many: its mesh changed meanwhile."""
    first, second = result.colors
    return replace(result, colors=(first, np.concatenate([second, second[:1]])))


def test_image_whose_name_is_taken_is_told_of(pair, blender):
    """A user's image is left alone, and ours gets a number from Blender."""
    theirs = blender.data.images.new("Radiosity_First", 8, 2)
    colors = tuple(np.ones((SIZE, SIZE, 4), np.float32) for _ in NAMES)
    warnings = apply(bpy.context, a_job(target="image"), Result(colors, Statistics(), ()))
    assert tuple(theirs.size) == (8, 2)
    assert len(warnings) == 1 and "'First' is called 'Radiosity_First.001'" in warnings[0]


def test_failure_at_the_second_object_takes_the_first_one_s_new_colors_back(pair):
    with pytest.raises(ValueError, match="bake again"):
        apply(bpy.context, a_job(), spoil(a_result(0.25, 0.75)))
    assert [len(item.data.color_attributes) for item in pair] == [0, 0]


@pytest.mark.parametrize("kind", [("FLOAT_COLOR", "CORNER"), ("BYTE_COLOR", "POINT")])
def test_failure_gives_the_earlier_colors_back(kind, pair):
    layers = pair[0].data.color_attributes
    layers.new(name="Radiosity", type=kind[0], domain=kind[1])
    layers.new(name="Mine", type="FLOAT_COLOR", domain="POINT")
    layers["Radiosity"].data.foreach_set("color", [1.0] * 16)
    layers.active_color = layers["Mine"]
    layers.render_color_index = layers.find("Radiosity")
    with pytest.raises(ValueError, match="bake again"):
        apply(bpy.context, a_job(), spoil(a_result(0.25, 0.75)))
    layers = pair[0].data.color_attributes
    assert sorted(layer.name for layer in layers) == ["Mine", "Radiosity"]
    assert (layers["Radiosity"].data_type, layers["Radiosity"].domain) == kind
    assert (colors(pair[0]) == 1.0).all()
    assert layers.active_color.name == "Mine"
    assert layers[layers.render_color_index].name == "Radiosity"


@pytest.mark.parametrize("size", [SIZE, 2 * SIZE])
def test_failure_gives_the_earlier_image_back(size, pair, tmp_path):
    """Of the same size, which is overwritten in place, and of another, which is replaced."""
    earlier = a_job(target="image")
    apply(bpy.context, earlier, a_result(0.1, 0.2, shape=(size, size, 4)))
    user = bpy.data.textures.new("User", "IMAGE")
    user.image = bpy.data.images["Radiosity_First"]
    broken = a_job(target="image", image_dir=str(tmp_path / "gone"))
    with pytest.raises(OSError, match="gone"):
        apply(bpy.context, broken, a_result(0.25, 0.75, shape=(SIZE, SIZE, 4)))
    assert sorted(image.name for image in bpy.data.images) == ["Radiosity_First", "Radiosity_Second"]
    assert (pixels("Radiosity_First") == np.float32(0.1)).all()
    assert tuple(bpy.data.images["Radiosity_First"].size) == (size, size)
    assert user.image == bpy.data.images["Radiosity_First"]
    apply(bpy.context, earlier, a_result(0.3, 0.4, shape=(SIZE, SIZE, 4)))
    assert (pixels("Radiosity_First") == np.float32(0.3)).all()
    assert len(bpy.data.images) == 2


def test_failure_removes_the_new_image_the_files_and_the_uv_map(pair, tmp_path, monkeypatch):
    for item in pair:
        item.data.uv_layers.new(name="Radiosity")
    saved = []

    def disk_full(image, path):
        saved.append(path)
        path.write_bytes(b"half")
        if len(saved) == 2:
            raise OSError("No space left on device")

    monkeypatch.setattr(sys.modules["radiosity_addon.stages.apply"], "save_image", disk_full)
    made = [(name, "Radiosity") for name in NAMES]
    job = a_job(made, target="image", image_dir=str(tmp_path))
    with pytest.raises(OSError, match="No space left"):
        apply(bpy.context, job, a_result(0.25, 0.75, shape=(SIZE, SIZE, 4)))
    assert len(saved) == 2
    assert len(bpy.data.images) == 0
    assert list(tmp_path.iterdir()) == []
    assert [len(item.data.uv_layers) for item in pair] == [0, 0]


def test_object_that_is_gone(pair):
    bpy.data.objects.remove(pair[1])
    with pytest.raises(ValueError, match="'Second'.*bake again"):
        apply(bpy.context, a_job(), a_result(0.25, 0.75))
    assert len(pair[0].data.color_attributes) == 0
