"""What an atlas is asked for, and refused: passes, maps, resolutions, files, charts."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon.gltf.glb import read_glb  # noqa: E402
from tests.atlas_yard import bake, density, meshes, save, texels  # noqa: E402
from tests.export.scene_building import add_object  # noqa: E402
from tests.one_core import main  # noqa: E402


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
    twin = add_object(blender, "Twin", blender.data.objects["Low"].data, location=(0, 1.5, 0.5))
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
    """A density factor, which is an atlas', changes nothing here, and a warning says so."""
    report = tmp_path / "r.json"
    blender.data.objects["Low"]["radiosity_resolution"] = 16
    blender.data.objects["High"]["radiosity_resolution"] = [32, 64]
    blender.data.objects["High"]["radiosity_density"] = 2.0
    save(blender, yard)
    assert bake(yard, tmp_path / "o.blend", "--resolution", 48, "--report", report) == 0
    warning = next(w for w in json.loads(report.read_text())["warnings"] if "radiosity_density" in w)
    assert warning.startswith("'High': ") and "changes nothing" in warning
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
