"""What bad input gets: one line on stderr that names it and the remedy, status 1, nothing written.

Or a warning in the report, and the bake goes on.
"""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("bpy")

from tests.one_core import FAST, main  # noqa: E402


def failure(capfd, argv, folder, status: int = 1) -> str:
    """The one line of a failed run that left ``folder`` as it was."""
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    capfd.readouterr()
    assert main([str(word) for word in argv]) == status
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1 and err.startswith("radiosity: ") and "unexpected" not in err
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    return err


def warnings_of(argv, folder) -> str:
    """The warnings of a successful run, in one string."""
    report = folder / "report.json"
    assert main([*map(str, argv), "--report", str(report), *FAST]) == 0
    return "\n".join(json.loads(report.read_text(encoding="utf-8"))["warnings"])


def test_file_that_does_not_exist(tmp_path, capfd):
    assert "nowhere.blend does not exist" in failure(capfd, [tmp_path / "nowhere.blend"], tmp_path)


def test_folder_in_place_of_a_file(tmp_path, capfd):
    assert "is a folder" in failure(capfd, [tmp_path], tmp_path)


@pytest.mark.parametrize("contents", [b"", b"Just text\n", b"\x89PNG\r\n\x1a\n"])
def test_file_that_is_no_blend(contents, tmp_path, capfd):
    (tmp_path / "notes.blend").write_bytes(contents)
    assert "is no Blender file" in failure(capfd, [tmp_path / "notes.blend"], tmp_path)


def test_blend_that_is_cut_short(room, tmp_path, capfd):
    (tmp_path / "half.blend").write_bytes(room.read_bytes()[:3000])
    line = failure(capfd, [tmp_path / "half.blend"], tmp_path)
    assert "half.blend cannot be read by Blender" in line and line.count("half.blend") == 1


def test_no_mesh_to_bake(blender, tmp_path, capfd):
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "empty.blend"))
    assert "mesh" in failure(capfd, [tmp_path / "empty.blend"], tmp_path)


def test_only_hidden_meshes(room, blender, tmp_path, capfd):
    for item in blender.data.objects:
        item.hide_render = True
    blender.ops.wm.save_as_mainfile(filepath=str(room))
    assert "mesh" in failure(capfd, [room], room.parent)


def test_objects_naming_nothing(room, capfd):
    line = failure(capfd, [room, "--objects", "Box", "Sphinx"], room.parent)
    assert "Sphinx" in line


def test_objects_naming_a_lamp(room, capfd):
    assert "Bulb" in failure(capfd, [room, "--objects", "Bulb"], room.parent)


def test_uv_map_that_an_object_lacks(room, capfd):
    line = failure(capfd, [room, "--target", "image", "--uv-map", "Lightmap"], room.parent)
    assert "Lightmap" in line and "Box" in line


def test_output_folder_that_is_missing(room, capfd):
    output = room.parent / "missing" / "out.blend"
    line = failure(capfd, [room, "--output", output], room.parent)
    assert "missing of --output does not exist; create it" in line


def test_output_folder_that_is_read_only(room, capfd):
    locked = room.parent / "locked"
    locked.mkdir()
    locked.chmod(0o555)
    try:
        line = failure(capfd, [room, "--output", locked / "out.blend"], room.parent)
    finally:
        locked.chmod(0o755)
    assert "locked of --output is not writable" in line


def test_output_that_is_read_only(room, capfd):
    output = room.parent / "out.blend"
    output.write_bytes(b"earlier")
    output.chmod(0o444)
    assert "is read-only" in failure(capfd, [room, "--output", output], room.parent)
    assert output.read_bytes() == b"earlier"


@pytest.mark.parametrize("option", ["--report", "--image-dir"])
def test_other_folders_that_are_missing(option, room, capfd):
    place = room.parent / "missing" / "name"
    words = ["--target", "image"] if option == "--image-dir" else []
    assert f"of {option} does not exist" in failure(
        capfd, [room, *words, option, place], room.parent
    )


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--resolution", 3),
        ("--resolution", 16385),
        ("--error", 0),
        ("--error", 2),
        ("--error", "nan"),
        ("--margin", -1),
        ("--threads", -1),
        ("--seed", -1),
        ("--time-limit", 0),
        ("--name", " "),
    ],
)
def test_value_out_of_range(option, value, room, capfd):
    line = failure(capfd, [room, f"{option}={value}"], room.parent, status=2)
    assert option[2:] in line.replace("_", "-")


def test_more_memory_than_there_is(room, capfd, monkeypatch):
    """16384² texels: the image alone takes 16384² · 16 B = 4 GiB."""
    monkeypatch.setattr("radiosity_addon.memory.available_memory", lambda: 2 << 30)
    words = [room, "--target", "image", "--resolution", 16384]
    line = failure(capfd, words, room.parent)
    assert "memory" in line and "--resolution" in line


def edit(blender, room, change):
    """Change the room's mesh in memory and save it."""
    change(blender.data.objects["Box"].data)
    blender.ops.wm.save_as_mainfile(filepath=str(room))


def test_zero_area_face_is_warned_of(room, blender):
    def flatten(mesh):
        a, b, _, _ = mesh.polygons[0].vertices
        for index in mesh.polygons[0].vertices:
            if index not in (a, b):
                mesh.vertices[index].co = mesh.vertices[a].co

    edit(blender, room, flatten)
    assert "area" in warnings_of([room], room.parent)


@pytest.mark.parametrize("words", [[], ["--target", "image", "--resolution", "16"]])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_vertex_that_is_not_finite_is_warned_of(value, words, room, blender):
    """Blender stores infinity as 3.4e38; Smart UV Project would never end on that."""

    def spoil(mesh):
        mesh.vertices[0].co.x = value

    edit(blender, room, spoil)
    warnings = warnings_of([room, *words], room.parent)
    assert "'Box'" in warnings and "NaN, infinite" in warnings
    assert "without area" not in warnings


def test_no_light_is_black_and_warned_of(room, blender):
    blender.data.objects.remove(blender.data.objects["Bulb"])
    blender.ops.wm.save_as_mainfile(filepath=str(room))
    assert "black" in warnings_of([room], room.parent)
    blender.ops.wm.open_mainfile(filepath=str(room.with_name("room_baked.blend")))
    colors = blender.data.objects["Box"].data.color_attributes["Radiosity"].data
    assert np.all([tuple(item.color)[:3] for item in colors] == np.zeros(3))


def test_mesh_shared_by_two_objects_is_warned_of(room, blender):
    twin = blender.data.objects.new("Twin", blender.data.objects["Box"].data)
    blender.context.scene.collection.objects.link(twin)
    twin.location.x = 5
    blender.ops.wm.save_as_mainfile(filepath=str(room))
    for words in ([], ["--target", "image", "--resolution", "16"], ["--objects", "Box"]):
        warnings = warnings_of([room, *words], room.parent)
        assert "shared by 'Box', 'Twin'" in warnings


def test_reflectance_above_one_is_clamped_and_warned_of(room, blender):
    material = blender.data.materials.new("Snow")
    if not material.node_tree:
        material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (2, 2, 2, 1)
    blender.data.objects["Box"].data.materials.append(material)
    blender.ops.wm.save_as_mainfile(filepath=str(room))
    warnings = warnings_of([room], room.parent)
    assert "Snow" in warnings and "1" in warnings
