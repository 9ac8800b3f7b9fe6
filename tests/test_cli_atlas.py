"""Atlases end to end: several objects in one image, by packed UV maps or by one of their own."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("bpy")

from tests.atlas_yard import (  # noqa: E402
    SQUARE,
    add,
    bake,
    density,
    gaps,
    meshes,
    pixels_of,
    save,
    texels,
    triangles,
)
from tests.export.scene_building import add_object  # noqa: E402


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
    report = tmp_path / "r.json"
    blender.data.objects["Low"]["radiosity_density"] = 2.0
    blender.data.objects["Floor"]["radiosity_resolution"] = 16  # of an image of its own: a warning says so
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 512, "--density", 24,
                "--report", report) == 0  # fmt: skip
    (warning,) = json.loads(report.read_text())["warnings"]
    assert warning.startswith("'Floor': ") and "radiosity_resolution" in warning
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
        add_object(blender, f"{name} lamp", lamp, location=(x, 0, 3))
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
    add_object(blender, "Lamp", lamp, location=(0, 0, 3))
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


def test_what_does_not_fit_is_told_without_a_density(yard, tmp_path, capfd):
    """Even the smallest charts have a margin around them."""
    assert bake(yard, tmp_path / "o.blend", "--atlas", "A", "--resolution", 16, "--margin", 16) == 1
    said = capfd.readouterr().err
    assert "do not fit into one image of 16 x 16 texels at a margin of 16" in said and "--density" not in said
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
