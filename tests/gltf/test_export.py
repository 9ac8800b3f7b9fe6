"""--export and the button: Blender's exporter with our hook, and no half-written file."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon.gltf import blender_export  # noqa: E402
from radiosity_addon.gltf.glb import FLOAT, read_glb  # noqa: E402
from tests.export.scene_building import add_plane  # noqa: E402
from tests.one_core import FAST, main  # noqa: E402


def bake(room, tmp_path, *options) -> int:
    return main([str(room), *FAST, "--output", str(tmp_path / "o.blend"),
                 "--export", str(tmp_path / "o.glb"), *options])  # fmt: skip


def colors_in(glb, name: str) -> np.ndarray:
    node = next(n for n in glb.document["nodes"] if n["name"] == name)
    parts = glb.document["meshes"][node["mesh"]]["primitives"]
    assert all("COLOR_1" not in part["attributes"] for part in parts)
    return np.concatenate([glb.floats(part["attributes"]["COLOR_0"]) for part in parts])


def test_colors_in_the_file_are_those_of_the_attribute(blender, room, tmp_path):
    """The same set of rows, bright ones (a lamp of 100 W at 1 m: above 1) not cut."""
    assert bake(room, tmp_path, "--passes", "emit,direct,indirect,color") == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    data = blender.data.objects["Box"].data.color_attributes["Radiosity"].data
    rows = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", rows)
    expected, found = rows.reshape(-1, 4), colors_in(read_glb(tmp_path / "o.glb"), "Box")
    assert expected[:, :3].max() > 1
    np.testing.assert_array_equal(np.unique(found, axis=0), np.unique(expected, axis=0))


def test_a_name_that_is_a_color_here_and_a_map_there(blender, room, tmp_path):
    """The box has baked colors ``Radiosity``, so that its map is called otherwise than the floor's."""
    blender.ops.wm.open_mainfile(filepath=str(room))
    blender.data.objects["Box"].data.color_attributes.new("Radiosity", "FLOAT_COLOR", "CORNER")
    floor = add_plane(blender, "Floor", size=8.0)
    floor.location.z = -2
    blender.ops.wm.save_mainfile()
    assert bake(room, tmp_path, "--target", "image", "--resolution", "32") == 0
    glb = read_glb(tmp_path / "o.glb")
    for name in ("Box", "Floor"):
        node = next(n for n in glb.document["nodes"] if n["name"] == name)
        (part,) = glb.document["meshes"][node["mesh"]]["primitives"]
        assert not [key for key in part["attributes"] if key.startswith(("_", "COLOR"))]
        assert glb.floats(part["attributes"]["TEXCOORD_1"]).shape[1] == 2
        assert "MOZ_lightmap" in glb.document["materials"][part["material"]]["extensions"]


def test_the_hook_is_gone_and_the_preferences_are_as_before(blender, room, tmp_path):
    before = set(blender.context.preferences.addons.keys())
    assert bake(room, tmp_path) == 0
    import radiosity_addon

    assert not hasattr(radiosity_addon, blender_export.HOOK)
    assert set(blender.context.preferences.addons.keys()) == before


def test_a_failing_exporter_leaves_nothing_and_says_one_line(
    blender, room, tmp_path, monkeypatch, capfd
):
    def broken(objects, names):
        class Broken:
            is_critical = True

            def gather_node_hook(self, node, item, settings):
                raise ValueError("no such luck")

        return Broken

    monkeypatch.setattr(blender_export, "_hook_class", broken)
    assert bake(room, tmp_path) == 1
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == []
    ours = [line for line in capfd.readouterr().err.splitlines() if line.startswith("radiosity")]
    assert len(ours) == 1 and "unexpected ValueError: no such luck" in ours[0]


def test_a_wrong_ending_is_wrong_usage(capfd):
    assert main(["scene.blend", "--export", "scene.obj"]) == 2
    assert ".glb" in capfd.readouterr().err


def test_a_missing_folder_is_told_before_any_work(room, tmp_path, capfd):
    status = main([str(room), "--export", str(tmp_path / "none" / "o.glb")])
    assert status == 1 and "--export" in capfd.readouterr().err


def test_the_button_writes_the_same_file(blender, room, tmp_path):
    import radiosity_addon

    assert bake(room, tmp_path) == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    radiosity_addon.register()
    try:
        path = tmp_path / "button.glb"
        assert blender.ops.radiosity.export_gltf(filepath=str(path)) == {"FINISHED"}
    finally:
        radiosity_addon.unregister()
    np.testing.assert_array_equal(
        colors_in(read_glb(path), "Box"), colors_in(read_glb(tmp_path / "o.glb"), "Box")
    )


@pytest.mark.parametrize("target", ["vertex", "image"])
def test_materials_follow_what_the_bake_holds_not_the_panel(blender, room, tmp_path, target):
    """Baked with color, then the panel asks for light alone: the color would be there twice."""
    import radiosity_addon

    assert bake(room, tmp_path, "--target", target, "--resolution", "32") == 0
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    radiosity_addon.register()
    try:
        properties = blender.context.scene.radiosity
        properties.target, properties.passes = target.upper(), {"DIRECT", "INDIRECT"}
        blender.ops.radiosity.export_gltf(filepath=str(tmp_path / "button.glb"))
    finally:
        radiosity_addon.unregister()
    document = read_glb(tmp_path / "button.glb").document
    node = next(n for n in document["nodes"] if n["name"] == "Box")
    (part,) = document["meshes"][node["mesh"]]["primitives"]
    assert "KHR_materials_unlit" in document["materials"][part["material"]]["extensions"]
    assert document["materials"][part["material"]]["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]


def test_a_scale_of_byte_colors_is_told(blender, room, tmp_path, capfd):
    """COLOR_0 has none: what was divided by the brightest value looks darker in every engine. It holds
    floats in any case."""
    assert bake(room, tmp_path, "--color-type", "byte", "--scale", "auto") == 0
    glb = read_glb(tmp_path / "o.glb")
    node = next(n for n in glb.document["nodes"] if n["name"] == "Box")
    (part,) = glb.document["meshes"][node["mesh"]]["primitives"]
    accessor = glb.document["accessors"][part["attributes"]["COLOR_0"]]
    assert accessor["componentType"] == FLOAT and "normalized" not in accessor  # engines misread others
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))
    data = blender.data.objects["Box"].data.color_attributes["Radiosity"].data
    expected = sorted(color.color[0] for color in data)
    assert expected[-1] > 0.99  # the brightest of the scene, or next to it
    found = np.unique(colors_in(glb, "Box")[:, 0])
    np.testing.assert_allclose(found, np.unique(expected), atol=2 / 65535)
    assert "the exported colors are the light divided by" in capfd.readouterr().out
    assert bake(room, tmp_path) == 0
    assert "divided by" not in capfd.readouterr().out


@pytest.mark.parametrize("baked", [False, True])
def test_a_plain_export_says_that_it_knows_nothing_of_the_bake(blender, room, tmp_path, capfd, baked):
    """Blender's own, while the add-on is enabled; our export says nothing of the kind."""
    file = str(room)
    if baked:
        assert bake(room, tmp_path) == 0
        file = str(tmp_path / "o.blend")
    blender.ops.wm.open_mainfile(filepath=file)
    entry = blender.context.preferences.addons.new()
    entry.module = "radiosity_addon"
    try:
        capfd.readouterr()
        blender.ops.export_scene.gltf(filepath=str(tmp_path / "plain.glb"))
        assert ("Export glTF in the Radiosity tab" in "".join(capfd.readouterr())) == baked
        blender_export.export_glb(tmp_path / "ours.glb", set(), {})
        assert "Radiosity tab" not in "".join(capfd.readouterr())
    finally:
        blender.context.preferences.addons.remove(entry)
