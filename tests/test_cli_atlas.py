"""Atlases end to end: several objects in one image, by packed UV maps or by one of their own."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon.bake.texels import coverage, texel_receivers  # noqa: E402
from radiosity_addon.gltf.glb import read_glb  # noqa: E402
from tests.one_core import main  # noqa: E402

SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


@pytest.fixture
def yard(blender, tmp_path):
    """A saved file: the square ``Floor``, 4 m × 4 m, with the boxes ``Low``, 1 m × 1 m × 1 m, and
    ``High``, 1 m × 1 m × 2 m, over it, below a lamp. 16, 6 and 10 m², no UV maps."""
    add(blender, "Floor", np.array(SQUARE) * 2, [(0, 1, 2, 3)], (0, 0, 0))
    for name, height, x in (("Low", 1, -1), ("High", 2, 1)):
        points = [(i - 0.5, j - 0.5, height * k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
        add(blender, name, points, SIDES, (x, 0, 0.5))
    lamp = blender.data.lights.new("Bulb", "POINT")
    lamp.energy, lamp.shadow_soft_size = 500, 0.2
    link(blender, "Bulb", lamp, (0, -2, 4))
    return save(blender, tmp_path / "yard.blend")


def add(blender, name, points, faces, place=(0, 0, 0)):
    mesh = blender.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, point)) for point in points], [], faces)
    mesh.materials.append(blender.data.materials.get("Gray") or blender.data.materials.new("Gray"))
    return link(blender, name, mesh, place)


def link(blender, name, data, place):
    item = blender.data.objects.new(name, data)
    item.location = place
    blender.context.scene.collection.objects.link(item)
    return item


def save(blender, path):
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def bake(scene, output, *options) -> int:
    return main([str(scene), "--target", "image", "--quality", "draft", "--output", str(output),
                 *map(str, options)])  # fmt: skip


def pixels_of(blender, name) -> np.ndarray:
    """(height, width, 4) of an image."""
    image = blender.data.images[name]
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def triangles(item, uv_map="Radiosity"):
    """UVs (n, 3, 2) and corners in the world (n, 3, 3) of a mesh's triangles."""
    mesh = item.data
    mesh.calc_loop_triangles()
    loops = np.array([tuple(each.loops) for each in mesh.loop_triangles])
    corner = np.array([tuple(each.vertices) for each in mesh.loop_triangles])
    uv = np.array([tuple(each.vector) for each in mesh.uv_layers[uv_map].uv], float)
    points = np.array([tuple(item.matrix_world @ vertex.co) for vertex in mesh.vertices])
    return uv[loops], points[corner]


def texels(item, size, uv_map="Radiosity"):
    """{(row, column): covered share} of an object's texels in an image of this size."""
    uv, _ = triangles(item, uv_map)
    found = texel_receivers(uv, np.arange(len(uv)), size)
    return dict(zip(map(tuple, found.grid[:, 1:].tolist()), coverage(found, uv, 0, size)))


def density(item, size) -> float:
    """Texels per meter: the root of texels over square meters."""
    uv, points = triangles(item)
    (a, b), (u, v) = ((part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]) for part in (uv, points))
    taken = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2 * size[0] * size[1]
    return float(np.sqrt(taken / (np.linalg.norm(np.cross(u, v), axis=1).sum() / 2)))


def gaps(items, size) -> float:
    """The least distance of a texel of one object to another's, between their middles."""
    from scipy.spatial import cKDTree

    trees = [cKDTree(np.array(list(texels(item, size)))) for item in items]
    pairs = [(a, b) for i, a in enumerate(trees) for b in trees[:i]]
    return min(float(a.query(b.data)[0].min()) for a, b in pairs)


def meshes(blender):
    return [blender.data.objects[name] for name in ("Floor", "Low", "High")]


def test_objects_share_one_image_without_overlap(blender, yard, tmp_path):
    """No texel has two objects or two faces; charts are a margin of 6 texels apart, so that the
    middles of their nearest texels are, at 45° at worst, 6 − √2 apart; each texel is lit."""
    report = tmp_path / "report.json"
    assert bake(yard, tmp_path / "o.blend", "--atlas", "Level", "--resolution", 256,
                "--margin", 6, "--report", report) == 0  # fmt: skip
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    assert [image.name for image in blender.data.images] == ["Radiosity_Level"]
    image, taken = pixels_of(blender, "Radiosity_Level"), [texels(i, (256, 256)) for i in meshes(blender)]
    every = [key for part in taken for key in part]
    assert len(set(every)) == len(every) > 0.4 * 256**2
    assert max(share for part in taken for share in part.values()) < 1.01
    assert gaps(meshes(blender), (256, 256)) > 6 - 2**0.5
    alpha = np.zeros((256, 256))
    alpha[tuple(np.array(every).T)] = 1
    assert (image[..., 3] == alpha).all()
    assert json.loads(report.read_text())["warnings"] == []


def test_density_is_as_asked_times_each_objects_factor(blender, yard, tmp_path):
    """24 texels per meter and a factor of 2 for Low: 24² · 16 + 48² · 6 + 24² · 10 = 28,800 texels,
    which the halves of 512² = 262,144, 65,536 texels, hold."""
    blender.data.objects["Low"]["radiosity_density"] = 2.0
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 512, "--density", 24) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    size = tuple(blender.data.images["Radiosity_A"].size)
    assert size == (256, 256)
    found = [density(item, size) for item in meshes(blender)]
    assert found == pytest.approx([24, 48, 24], rel=0.1)


def test_an_object_baked_again_changes_its_own_texels_alone(blender, yard, tmp_path):
    assert bake(yard, tmp_path / "a.blend", "--atlas", "A", "--resolution", 128) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    before = pixels_of(blender, "Radiosity_A")
    blender.data.lights["Bulb"].energy = 1000
    save(blender, tmp_path / "a.blend")
    again = ("--atlas", "A", "--resolution", 128, "--objects", "Low")
    assert bake(tmp_path / "a.blend", tmp_path / "b.blend", *again) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"))
    after, low = pixels_of(blender, "Radiosity_A"), texels(blender.data.objects["Low"], (128, 128))
    mine = np.zeros((128, 128), bool)
    mine[tuple(np.array(list(low)).T)] = True
    on = before[..., 3] > 0
    np.testing.assert_array_equal(after[on & ~mine], before[on & ~mine])
    np.testing.assert_array_equal(after[..., 3], before[..., 3])
    # Twice the light, but for noise: 10 % are asked for, the mean over thousands of texels has less.
    assert after[mine, :3].mean() == pytest.approx(2 * before[mine, :3].mean(), rel=0.1)
    assert blender.data.images["Radiosity_A"]["radiosity_object"].split("\n") == ["Floor", "High", "Low"]


def test_their_own_joint_uv_map_is_used_as_it_is(blender, tmp_path):
    """Two squares in the left and the right half of one map, the right one below twice the light."""
    for name, x in (("Left", 0), ("Right", 10)):
        item = add(blender, name, SQUARE, [(0, 1, 2, 3)], (x, 0, 0))
        layer = item.data.uv_layers.new(name="Joint", do_init=False)
        start = 0.5 if x else 0.0
        corners = [start, 0, start + 0.5, 0, start + 0.5, 1, start, 1]
        layer.uv.foreach_set("vector", corners)
        lamp = blender.data.lights.new(name, "SPOT")
        lamp.energy, lamp.spot_size = 100 * (2 if x else 1), 2
        link(blender, f"{name} lamp", lamp, (x, 0, 3))
    scene = save(blender, tmp_path / "pair.blend")
    assert bake(scene, tmp_path / "o.blend", "--atlas", "Both", "--uv-map", "Joint",
                "--resolution", "64x32") == 0  # fmt: skip
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    image = pixels_of(blender, "Radiosity_Both")
    assert image.shape == (32, 64, 4) and (image[..., 3] == 1).all()
    left, right = image[:, :32, :3], image[:, 32:, :3]
    assert right.mean() == pytest.approx(2 * left.mean(), rel=0.05)
    assert list(blender.data.objects["Left"].data.uv_layers.keys()) == ["Joint"]


def test_overlap_of_objects_in_their_own_map_is_told(blender, tmp_path):
    """Both fill the whole image of 16²: each texel holds the mean, of 0 and of what is lit."""
    for name, x in (("Lit", 0), ("Dark", 50)):
        item = add(blender, name, SQUARE, [(0, 1, 2, 3)], (x, 0, 0))
        layer = item.data.uv_layers.new(name="Joint", do_init=False)
        layer.uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    lamp = blender.data.lights.new("Lamp", "SPOT")
    lamp.energy, lamp.spot_size = 100, 2
    link(blender, "Lamp", lamp, (0, 0, 3))
    scene, found = save(blender, tmp_path / "pair.blend"), {}
    for name in ("Both", "Lit"):
        options = () if name == "Both" else ("--objects", "Lit")
        assert bake(scene, tmp_path / f"{name}.blend", "--atlas", name, "--uv-map", "Joint",
                    "--resolution", 16, "--report", tmp_path / "r.json", *options) == 0  # fmt: skip
        warnings = json.loads((tmp_path / "r.json").read_text())["warnings"]
        assert any("'Dark', 'Lit' overlap" in w and "256 texels" in w for w in warnings) == (
            name == "Both"
        )
        blender.ops.wm.open_mainfile(filepath=str(tmp_path / f"{name}.blend"))
        found[name] = pixels_of(blender, f"Radiosity_{name}")[..., :3].mean()
    assert found["Both"] == pytest.approx(found["Lit"] / 2, rel=0.02)


def test_oblong_images_have_square_texels(blender, yard, tmp_path):
    """Along u and v of the 4 m floor there are as many texels per meter, within 1 %."""
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", "256x64") == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    assert pixels_of(blender, "Radiosity_A").shape == (64, 256, 4)
    uv, _ = triangles(blender.data.objects["Floor"])
    width, height = np.ptp(uv.reshape(-1, 2), axis=0) * (256, 64)
    assert width == pytest.approx(height, rel=0.01)
    every = [key for item in meshes(blender) for key in texels(item, (256, 64))]
    assert len(set(every)) == len(every)


def test_what_does_not_fit_is_told(yard, tmp_path, capfd):
    """100 texels per meter on 32 m² are 320,000 texels; 128² are 16,384."""
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 128, "--density", 100) == 1
    said = capfd.readouterr().err
    assert "do not fit into one image of 128 x 128" in said and "--density" in said
    assert not (tmp_path / "o.blend").exists()


def test_more_images_hold_what_one_does_not(blender, yard, tmp_path):
    """24 texels per meter: 9,216 for the floor alone, of 16,384 in an image; all have 18,432."""
    options = ("--atlas", "A", "--resolution", 128, "--density", 24, "--margin", 3)
    assert bake(yard, tmp_path / "o.blend", *options) == 1
    assert bake(yard, tmp_path / "o.blend", *options, "--atlas-images", 4) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    images = sorted(image.name for image in blender.data.images)
    assert images == ["Radiosity_A", "Radiosity_A_2"]
    owners = [blender.data.images[name]["radiosity_object"].split("\n") for name in images]
    assert sorted(name for each in owners for name in each) == ["Floor", "High", "Low"]


def test_an_atlas_of_fewer_images_leaves_none_behind(blender, yard, tmp_path):
    """Margin 4 in place of 3 lays all out anew; one larger image holds all."""
    assert bake(yard, tmp_path / "a.blend", "--atlas", "A", "--resolution", 64, "--margin", 3,
                "--atlas-images", 2) == 0  # fmt: skip
    assert bake(tmp_path / "a.blend", tmp_path / "b.blend", "--atlas", "A", "--resolution", 128) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "b.blend"))
    assert [(image.name, *image.size) for image in blender.data.images] == [("Radiosity_A", 128, 128)]


def test_a_new_object_does_not_move_the_others(blender, yard, tmp_path, capfd):
    assert bake(yard, tmp_path / "a.blend", "--atlas", "A", "--resolution", 64, "--objects",
                "Floor", "Low") == 0  # fmt: skip
    again = ("--atlas", "A", "--resolution", 64)
    assert bake(tmp_path / "a.blend", tmp_path / "b.blend", *again, "--objects", "High") == 1
    said = capfd.readouterr().err
    assert "'High'" in said and "'Floor'" in said and "together" in said
    assert bake(tmp_path / "a.blend", tmp_path / "b.blend", *again) == 0


def test_other_passes_beside_those_baked_are_refused(blender, yard, tmp_path, capfd):
    again = ("--atlas", "A", "--resolution", 64)
    assert bake(yard, tmp_path / "a.blend", *again) == 0
    assert bake(tmp_path / "a.blend", tmp_path / "b.blend", *again, "--objects", "Low",
                "--passes", "direct") == 1  # fmt: skip
    assert "passes" in capfd.readouterr().err


def test_a_map_that_no_bake_made_is_not_moved(blender, yard, tmp_path, capfd):
    blender.data.objects["Low"].data.uv_layers.new(name="Radiosity")
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A") == 1
    assert "--uv-map Radiosity" in capfd.readouterr().err


def test_shared_meshes_lie_there_once(blender, yard, tmp_path):
    twin = link(blender, "Twin", blender.data.objects["Low"].data, (0, 1.5, 0.5))
    assert twin.data.users == 2
    save(blender, yard)
    report = tmp_path / "r.json"
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 64, "--report", report) == 0
    objects = {each["name"]: each for each in json.loads(report.read_text())["objects"]}
    assert objects["Low"]["baked"] and not objects["Twin"]["baked"]
    assert "single-user" in objects["Twin"]["reason"]
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 64, "--single-user") == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    assert "Twin" in blender.data.images["Radiosity_A"]["radiosity_object"]


def test_each_object_may_have_its_own_resolution(blender, yard, tmp_path):
    blender.data.objects["Low"]["radiosity_resolution"] = 16
    blender.data.objects["High"]["radiosity_resolution"] = [32, 64]
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--resolution", 48) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    sizes = {image.name: tuple(image.size) for image in blender.data.images}
    assert sizes == {
        "Radiosity_Floor": (48, 48), "Radiosity_Low": (16, 16), "Radiosity_High": (32, 64),
    }  # fmt: skip


def test_a_resolution_that_is_none_is_told(blender, yard, tmp_path, capfd):
    blender.data.objects["Low"]["radiosity_resolution"] = "large"
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend") == 1
    assert "radiosity_resolution" in capfd.readouterr().err


def test_gltf_has_the_atlas_once(blender, yard, tmp_path):
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 64, "--passes",
                "direct,indirect", "--export", tmp_path / "o.glb") == 0  # fmt: skip
    document = read_glb(tmp_path / "o.glb").document
    assert len(document["images"]) == len(document["textures"]) == 1
    used = {p["material"] for mesh in document["meshes"] for p in mesh["primitives"]}
    lightmaps = [document["materials"][index]["extensions"]["MOZ_lightmap"] for index in used]
    assert {each["index"] for each in lightmaps} == {0}
    slots = [p["attributes"] for mesh in document["meshes"] for p in mesh["primitives"]]
    assert len(slots) == 3 and all("TEXCOORD_1" in attributes for attributes in slots)


def test_files_of_an_atlas(yard, tmp_path):
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 64, "--image-dir",
                tmp_path, "--format", "png", "--scale", "auto") == 0  # fmt: skip
    assert [path.name for path in tmp_path.glob("*.png")] == ["Radiosity_A.png"]


@pytest.mark.parametrize("how", ["lightmap", "existing"])
def test_charts_are_blenders_other_ones(blender, yard, tmp_path, how):
    """Lightmap Pack: a chart for each side of a box. Existing: the one chart of a box of which all
    sides but the last have joint UVs, laid out without overlap."""
    if how == "existing":
        for item in meshes(blender):
            layer = item.data.uv_layers.new(name="Paint", do_init=False)
            side = np.tile([0, 0, 3, 0, 3, 3, 0, 3], len(item.data.polygons)).astype(np.float32)
            layer.uv.foreach_set("vector", side)
        save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 128, "--unwrap", how) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    every = [texels(item, (128, 128)) for item in meshes(blender)]
    assert len({key for part in every for key in part}) == sum(map(len, every))
    assert max(share for part in every for share in part.values()) < 1.01
    found = [density(item, (128, 128)) for item in meshes(blender)]
    assert found == pytest.approx([found[0]] * 3, rel=0.02)


def test_existing_charts_that_are_none_are_told(yard, tmp_path, capfd):
    assert bake(yard, tmp_path / "o.blend", "--unwrap", "existing") == 1
    assert "has no UV map" in capfd.readouterr().err


@pytest.mark.parametrize("words", [
    ["--atlas", "A"],
    ["--target", "image", "--density", "5"],
    ["--target", "image", "--atlas-images", "2"],
    ["--target", "image", "--atlas", "A", "--uv-map", "M", "--density", "5"],
    ["--target", "image", "--atlas", "A", "--density", "0"],
    ["--target", "image", "--atlas", " "],
    ["--target", "image", "--resolution", "64x"],
    ["--target", "image", "--resolution", "2x64"],
    ["--target", "image", "--unwrap", "sphere"],
])  # fmt: skip
def test_wrong_usage(words, capfd):
    assert main(["scene.blend", *words]) == 2
    assert len(capfd.readouterr().err.strip().splitlines()) == 1
