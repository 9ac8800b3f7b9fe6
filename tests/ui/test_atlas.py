"""Atlases from the panel: bake, bake a part again, show, take back."""

from __future__ import annotations

import numpy as np
import pytest

from tests.export.scene_building import add_object

pytestmark = pytest.mark.usefixtures("solver_here")
NAMES = ("Left", "Right")
SIZE = 48


@pytest.fixture
def pair(addon, one_core):
    """Two squares of 2 m below a lamp, and the panel set to an atlas for them."""
    for index, name in enumerate(NAMES):
        mesh = addon.data.meshes.new(name)
        mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
        add_object(addon, name, mesh, location=(3 * index, 0, 0))
    lamp = addon.data.lights.new("Bulb", "POINT")
    lamp.energy = 300
    add_object(addon, "Bulb", lamp, location=(1, 0, 2))
    properties = addon.context.scene.radiosity
    properties.target, properties.quality, properties.resolution = "IMAGE", "DRAFT", SIZE
    properties.use_atlas, properties.margin, properties.passes = True, 4, {"DIRECT", "COLOR"}
    return addon


def pixels(bpy, name="Radiosity_Atlas") -> np.ndarray:
    image = bpy.data.images[name]
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def select(bpy, *names):
    for item in bpy.data.objects:
        item.select_set(item.name in names)
    bpy.context.scene.radiosity.objects_from = "SELECTED"


def uvs(bpy):
    return {name: [tuple(each.vector) for each in bpy.data.objects[name].data.uv_layers[0].uv]
            for name in NAMES}  # fmt: skip


def test_a_selected_object_changes_its_part_alone(pair):
    assert pair.ops.radiosity.bake() == {"FINISHED"}
    before = pixels(pair)
    pair.data.lights["Bulb"].energy = 600
    select(pair, "Right")
    assert pair.ops.radiosity.bake() == {"FINISHED"}
    after, changed = pixels(pair), (pixels(pair) != before).any(axis=2)
    corners = {name: np.array(values) * SIZE for name, values in uvs(pair).items()}
    low, high = (f(corners["Left"], axis=0) for f in (np.min, np.max))
    rows, columns = (slice(round(low[k]), round(high[k])) for k in (1, 0))
    assert (high - low).round() == pytest.approx(20)  # (48 - 2 · 4) / 2: a gap around each
    assert (before[rows, columns, 3] == 1).all() and not changed[rows, columns].any()
    assert changed.any() and (after[..., 3] == before[..., 3]).all()


def test_materials_show_the_atlas_and_remove_takes_back_one_by_one(pair):
    from radiosity_addon.bake.windows import objects_of_image
    from radiosity_addon.ui.results import baked_objects

    pair.ops.radiosity.bake()
    assert {item.name for item in baked_objects(pair.context)} == set(NAMES)
    pair.ops.radiosity.build_material(assign=True)
    for name in NAMES:
        nodes = pair.data.objects[name].material_slots[0].material.node_tree.nodes
        texture = next(node for node in nodes if node.bl_idname == "ShaderNodeTexImage")
        assert texture.image == pair.data.images["Radiosity_Atlas"]
    select(pair, "Left")
    assert pair.ops.radiosity.remove_bake(selected=True) == {"FINISHED"}
    assert objects_of_image(pair.data.images["Radiosity_Atlas"]) == ["Right"]
    assert {item.name for item in baked_objects(pair.context)} == {"Right"}
    assert not pair.data.objects["Left"].data.uv_layers
    assert pair.ops.radiosity.remove_bake() == {"FINISHED"}
    assert not pair.data.images and not pair.data.objects["Right"].data.uv_layers
    assert "radiosity_made" not in pair.data.objects["Right"].data


def test_a_failed_bake_puts_maps_and_image_back(pair, monkeypatch):
    from radiosity_addon.stages import apply

    pair.ops.radiosity.bake()
    maps, image = uvs(pair), pixels(pair)
    notes = {name: pair.data.objects[name].data["radiosity_made"] for name in NAMES}

    def fail(*_):
        raise OSError("no space left")

    pair.context.scene.radiosity.margin = 9  # all is laid out anew
    with monkeypatch.context() as patch, pytest.raises(RuntimeError, match="no space left"):
        patch.setattr(apply, "_mark", fail)
        pair.ops.radiosity.bake()
    assert uvs(pair) == maps
    assert {n: pair.data.objects[n].data["radiosity_made"] for n in NAMES} == notes
    np.testing.assert_array_equal(pixels(pair), image)
    assert pair.ops.radiosity.bake() == {"FINISHED"}
    assert uvs(pair) != maps


def test_the_layout_stays_while_nothing_asks_for_another(pair):
    pair.ops.radiosity.bake()
    maps = uvs(pair)
    pair.ops.radiosity.bake(bake_name="Night")
    assert uvs(pair) == maps
    assert {"Radiosity_Atlas", "Night_Atlas"} == set(pair.data.images.keys())
    pair.data.objects["Left"].radiosity_density_factor = 0.5
    pair.ops.radiosity.bake()
    edges = {name: np.ptp(np.array(values), axis=0) for name, values in uvs(pair).items()}
    np.testing.assert_allclose(edges["Right"], 2 * edges["Left"], rtol=0.01)


def test_properties_of_objects_are_their_custom_ones(pair):
    item = pair.data.objects["Left"]
    assert tuple(item.radiosity_own_resolution) == (0, 0) and item.radiosity_density_factor == 1
    item.radiosity_own_resolution, item.radiosity_density_factor = (64, 0), 3
    assert list(item["radiosity_resolution"]) == [64, 64] and item["radiosity_density"] == 3
    pair.context.scene.radiosity.use_atlas = False
    assert pair.ops.radiosity.bake() == {"FINISHED"}
    sizes = {image.name: tuple(image.size) for image in pair.data.images}
    assert sizes == {"Radiosity_Left": (64, 64), "Radiosity_Right": (SIZE, SIZE)}
    item.radiosity_own_resolution, item.radiosity_density_factor = (0, 0), 1
    assert "radiosity_resolution" not in item and "radiosity_density" not in item


def test_keywords_of_an_atlas(pair):
    pair.context.scene.radiosity.use_atlas = False
    assert pair.ops.radiosity.bake(atlas="Level", density=8.0, height=96) == {"FINISHED"}
    assert pair.data.images.keys() == ["Radiosity_Level"]


def test_vertex_colors_do_not_mind_the_atlas(pair):
    pair.context.scene.radiosity.target = "VERTEX"
    assert pair.ops.radiosity.bake() == {"FINISHED"}
    assert not pair.data.images
    assert all("Radiosity" in pair.data.objects[name].data.color_attributes for name in NAMES)


def test_images_keep_their_texels_when_an_object_is_lost(pair):
    """Objects A and C in one image, B in another; A is deleted, so that B's image comes first."""
    from radiosity_addon.bake.exported_object import ExportedObject
    from radiosity_addon.bake.windows import TexelRect
    from radiosity_addon.bake_job import Job, Result
    from radiosity_addon.settings import Settings
    from radiosity_addon.solver.solution import Statistics
    from radiosity_addon.stages.sheets import sheets_of
    from radiosity_addon.ui.changed_objects import follow

    targets = []
    for name, sheet in (("A", "One"), ("B", "Two"), ("C", "One")):
        add_object(pair, name, pair.data.meshes["Left"], location=(0, 0, 5))
        identity = pair.data.objects[name].session_uid
        where = TexelRect(sheet, (4, 4), 0, 0, 4, 4)
        targets.append(ExportedObject(
            name, 0, 2, None, None, None, None, identity, 4, rect=where
        ))  # fmt: skip
    job = Job(Settings(target="image", atlas="X"), None, tuple(targets), (), (), ())
    pair.data.objects.remove(pair.data.objects["A"])
    followed = follow(job, Result(("one", "two"), Statistics(), ()))
    assert [sheet.name for sheet in sheets_of(followed.job)] == ["Two", "One"]
    assert followed.result.colors == ("two", "one")
