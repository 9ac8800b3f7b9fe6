"""The bake operator and its session: results and refusals."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.solver.expected import Refused
from tests.ui.bakes import ALL_PASSES, box, colors, everything, until

ROOT = Path(__file__).resolve().parents[2]


def test_operator_bakes_and_reports(file):
    file.context.scene.radiosity.passes = ALL_PASSES
    assert file.ops.radiosity.bake() == {"FINISHED"}
    values = colors(box(file).data).reshape(-1, 4)
    assert (values[:, :3] > 0).all() and (values[:, 3] == 1).all()
    from radiosity_addon.ui.report_store import load_report

    report = load_report(file.context.scene)
    assert report["objects"] == [{"name": "Box", "baked": True, "reason": ""}]
    assert 0 < report["seconds"]["export"] < report["seconds"]["total"]
    assert report["target_error"] == 0.1


def press(bpy) -> None:
    """What the button does in a window, events and all: Blender's module has none, so a plain
    object with the operator's functions takes its place, and a loop the timer's."""
    from radiosity_addon.ui import background, bake_operators, session

    functions = {k: v for k, v in vars(bake_operators.RADIOSITY_OT_bake).items() if not k.startswith("__")}
    button = type("Button", (), {**functions, "report": lambda *_: None})()
    button._progress = background.Progress()
    assert button._begin(bpy.context)
    while not session.current().wants_operator:
        session.current().step(bpy.context)
        time.sleep(0.01)
    status = {"RUNNING_MODAL"}
    while status == {"RUNNING_MODAL"}:
        status = button.modal(bpy.context, SimpleNamespace(type="MOUSEMOVE", value="NOTHING"))
        assert status == {"RUNNING_MODAL"}  # nothing else gets an event while colors are written
        status = button.modal(bpy.context, SimpleNamespace(type="TIMER", value="NOTHING"))
    assert status == {"FINISHED"}


def test_button_operator_and_command_line_give_identical_colors(file, room, one_core):
    """The button on one core, the operator and the command line on all."""
    from radiosity_addon.ui import session

    file.context.scene.radiosity.passes = ALL_PASSES
    press(file)
    button = colors(box(file).data)
    session.forget()  # what was kept, so that both solve
    one_core()
    file.ops.radiosity.bake()
    assert np.array_equal(button, colors(box(file).data))
    line = [sys.executable, "-m", "radiosity_addon", str(room), "--quality", "draft"]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    file.ops.wm.open_mainfile(filepath=str(room.with_name("room_baked.blend")))
    assert np.array_equal(button, colors(box(file).data))


def test_images_are_baked_to_a_new_map_and_file(file, solver_here, tmp_path):
    properties = file.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 16
    properties.write_files, properties.image_dir = True, str(tmp_path)
    assert file.ops.radiosity.bake() == {"FINISHED"}
    assert file.data.images["Radiosity_Box"].size[:] == (16, 16)
    assert "Radiosity" in box(file).data.uv_layers
    assert (tmp_path / "Radiosity_Box.exr").exists()


def test_failure_is_a_message_and_changes_nothing(file, solver_here, tmp_path):
    properties = file.context.scene.radiosity
    properties.target, properties.write_files = "IMAGE", True
    properties.resolution, properties.image_dir = 16, str(tmp_path / "missing")
    with pytest.raises(RuntimeError, match="missing"):
        file.ops.radiosity.bake()
    assert not box(file).data.uv_layers and not file.data.images and not properties.report


def test_missing_uv_map_is_refused_by_name(file):
    properties = file.context.scene.radiosity
    properties.target, properties.uv_map = "IMAGE", "Atlas"
    with pytest.raises(RuntimeError, match="Atlas"):
        file.ops.radiosity.bake()


def refusal(bpy) -> str:
    from radiosity_addon.ui.choice import why_not

    assert bpy.ops.radiosity.bake.poll() is (not why_not(bpy.context))
    return why_not(bpy.context)


def test_gray_button_says_why(file):
    properties = file.context.scene.radiosity
    assert refusal(file) == ""
    properties.passes = set()
    assert "pass" in refusal(file)
    properties.passes = {"DIRECT"}
    properties.bake_name = " "
    assert "name" in refusal(file)
    properties.bake_name = "Light"
    properties.objects_from = "SELECTED"
    file.ops.object.select_all(action="DESELECT")
    assert "Select" in refusal(file)
    properties.objects_from = "ALL"
    box(file).hide_render = True
    assert refusal(file) == "Box cannot be baked: it is disabled in renders"


def test_edit_mode_is_refused(file):
    file.context.view_layer.objects.active = box(file)
    file.ops.object.mode_set(mode="EDIT")
    assert "Object Mode" in refusal(file)
    file.ops.object.mode_set(mode="OBJECT")


def test_relative_folder_needs_a_saved_file(addon):
    properties = addon.context.scene.radiosity
    properties.target, properties.write_files = "IMAGE", True
    assert "Save the file" in refusal(addon)


def test_only_one_bake_at_a_time(file, session):
    session()
    assert "running" in refusal(file)
    with pytest.raises(Refused, match="running already"):
        session()


def test_file_holds_nothing_of_a_bake_that_runs(file, session):
    properties = file.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 16
    bake = session()
    until(file, bake, "SOLVE")
    assert not box(file).data.uv_layers and not file.data.images
    until(file, bake, "DONE")
    assert [layer.name for layer in box(file).data.uv_layers] == ["Radiosity"]
    assert "Radiosity_Box" in file.data.images


def test_files_that_cannot_be_put_in_place_take_the_bake_back(file, solver_here, tmp_path, monkeypatch):
    from radiosity_addon import files

    def fail(self):
        raise OSError("no space left")

    monkeypatch.setattr(files.Publication, "commit", fail)
    properties = file.context.scene.radiosity
    properties.target, properties.write_files = "IMAGE", True
    properties.resolution, properties.image_dir = 16, str(tmp_path / "out")
    (tmp_path / "out").mkdir()
    before = everything(file)
    with pytest.raises(RuntimeError, match="no space"):
        file.ops.radiosity.bake()
    assert everything(file) == before and not properties.report
    assert list((tmp_path / "out").iterdir()) == []


def test_folder_that_takes_no_files_is_told_before_the_bake(file, tmp_path, monkeypatch):
    from radiosity_addon.ui import session

    monkeypatch.setattr(session, "BakeSession", None)  # none is begun
    properties = file.context.scene.radiosity
    properties.target, properties.write_files, properties.image_dir = "IMAGE", True, str(tmp_path / "none")
    with pytest.raises(RuntimeError, match="none of Image Files does not exist; create it"):
        file.ops.radiosity.bake()
