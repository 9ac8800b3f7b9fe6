"""Jobs: several files in a call, objects by pattern, shared meshes, and what the file keeps."""

from __future__ import annotations

import json
import shutil

import pytest

pytest.importorskip("bpy")

from radiosity_addon.arguments import parse  # noqa: E402
from radiosity_addon.stages.prepare import matching  # noqa: E402
from tests.one_core import FAST, main  # noqa: E402


@pytest.fixture
def three(room, blender):
    """The room with ``Box``, ``Box two`` of the same mesh, and ``Shelf`` of its own."""
    mesh = blender.data.objects["Box"].data
    for number, (name, data) in enumerate((("Box two", mesh), ("Shelf", mesh.copy()))):
        item = blender.data.objects.new(name, data)
        item.location.x = 5 * (number + 1)
        blender.context.scene.collection.objects.link(item)
    blender.ops.wm.save_as_mainfile(filepath=str(room))
    return room


def report_of(path, *words) -> dict:
    report = path.parent / "report.json"
    assert main([str(path), *FAST, "--report", str(report), *words]) == 0
    return json.loads(report.read_text(encoding="utf-8"))


def baked(report: dict) -> list[str]:
    return [item["name"] for item in report["objects"] if item["baked"]]


def test_patterns_name_meshes(three, blender):
    assert baked(report_of(three, "--objects", "Sh*", "Box")) == ["Box", "Shelf"]
    layer = blender.context.view_layer
    assert matching(layer, ("B*",)) == ("Box", "Box two")  # no lamp, which is called Bulb
    assert matching(layer, ("Bulb", "*[ef]", "Box?two")) == ("Bulb", "Shelf", "Box two")
    assert matching(layer, ("Cup*",)) == ("Cup*",)
    blender.data.objects["Shelf"].name = "[ox]"  # a name before a pattern
    assert matching(layer, ("[ox]",)) == ("[ox]",)


def test_pattern_that_matches_nothing_is_an_error(three, capfd):
    assert main([str(three), "--objects", "Cup*"]) == 1
    assert "'Cup*'" in capfd.readouterr().err


def test_shared_meshes_get_colors_of_their_own(three, blender):
    assert baked(report_of(three)) == ["Box", "Shelf"]
    report = report_of(three, "--single-user")
    assert baked(report) == ["Box", "Box two", "Shelf"]
    assert not [text for text in report["warnings"] if "shared" in text]
    blender.ops.wm.open_mainfile(filepath=str(three.with_name("room_baked.blend")))
    one, two = (blender.data.objects[name].data for name in ("Box", "Box two"))
    assert one != two and "Radiosity" in two.color_attributes


def test_several_files_in_one_call(room, capfd):
    other, broken = room.with_name("other.blend"), room.with_name("broken.blend")
    shutil.copy(room, other)
    broken.write_bytes(room.read_bytes()[:3000])
    assert main([str(room), str(other), *FAST]) == 0
    out, _ = capfd.readouterr()
    assert out.count("Baked 1 object into") == 2
    for path in (room, other):
        path.with_name(f"{path.stem}_baked.blend").unlink()
    assert main([str(broken), *FAST, str(other)]) == 1  # the others are baked all the same
    _, err = capfd.readouterr()
    assert "broken.blend cannot be read" in err and err.count("\n") == 1
    found = {path.name for path in room.parent.iterdir()}
    assert found == {"room.blend", "other.blend", "broken.blend", "other_baked.blend"}


def test_of_several_files_the_one_that_fails_is_named(room, capfd):
    other = room.with_name("other.blend")
    shutil.copy(room, other)
    assert main([str(room), str(other), *FAST, "--objects", "Nothing"]) == 1
    lines = capfd.readouterr().err.splitlines()
    assert [line.split(": ")[1] for line in lines] == [str(room), str(other)]


@pytest.mark.parametrize("option", ["--output o.blend", "--report r.json",
                                    "--target image --image-dir d"])  # fmt: skip
def test_what_is_for_one_file_is_refused_for_several(option, capsys):
    with pytest.raises(SystemExit) as stop:
        parse(f"a.blend b.blend {option}".split())
    assert stop.value.code == 2 and "2 are named" in capsys.readouterr().err


def test_missing_file_among_several_is_told_before_any_work(room, capfd):
    assert main([str(room), str(room.with_name("none.blend")), *FAST]) == 1
    assert "none.blend does not exist" in capfd.readouterr().err
    assert [path.name for path in room.parent.iterdir()] == ["room.blend"]


def test_settings_and_report_stay_in_the_file(room, blender):
    report = report_of(room, "--error", "0.2", "--passes", "direct", "--seed", "7", "--name", "Lit")
    import radiosity_addon

    radiosity_addon.register()
    try:
        from radiosity_addon.settings import Settings
        from radiosity_addon.ui.properties import settings_of
        from radiosity_addon.ui.report_store import load_report

        blender.ops.wm.open_mainfile(filepath=str(room.with_name("room_baked.blend")))
        scene = blender.context.scene
        asked = Settings(error=0.2, passes=("direct",), seed=7, threads=1, name="Lit")
        assert settings_of(scene.radiosity) == asked
        kept = load_report(scene)
        assert (kept["rays"], kept["objects"]) == (report["rays"], report["objects"])
    finally:
        radiosity_addon.unregister()
