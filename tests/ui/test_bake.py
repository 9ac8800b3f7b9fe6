"""The bake operator and its session: results, refusals, and objects that change meanwhile."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def file(addon, room, one_core):
    """The room of ``tests/conftest.py``, open, with a draft to bake; no temporary files stay."""
    addon.ops.wm.open_mainfile(filepath=str(room))
    addon.context.scene.radiosity.quality = "DRAFT"
    return addon


@pytest.fixture
def session(file, tmp_path, monkeypatch):
    """A function: a bake of the open file as the button starts it. Its files must all go."""
    from radiosity_addon.ui import properties, session, solver_process

    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(solver_process.tempfile, "tempdir", str(folder))

    def begin():
        settings = properties.settings_of(file.context.scene.radiosity)
        session.begin(session.BakeSession(file.context.scene.name, settings))
        return session.current()

    yield begin
    session.end()
    assert list(folder.iterdir()) == []


class Patience:
    """Ends after 60 seconds of work, this process's and the solver's: that one gives way to all others,
    so on a machine that does other work it may take minutes for what it does in seconds. Where the
    work cannot be told, and where there is none, it ends after ten minutes."""

    def __init__(self) -> None:
        self._start, self._end = time.process_time(), time.monotonic() + 600

    def left(self, bake) -> bool:
        own, now = time.process_time() - self._start, time.monotonic()
        return own + worked(bake._process) < 60 and now < self._end


def worked(solver) -> float:
    """Seconds of processors that the solver's process has used; 0 where it is not told or has ended."""
    try:
        with open(f"/proc/{solver._process.pid}/stat") as handle:
            ticks = handle.read().rpartition(")")[2].split()[11:13]  # of user, of system
    except (AttributeError, OSError):
        return 0.0
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def until(bpy, bake, *stages: str) -> None:
    """Take steps until the bake is in one of the stages."""
    patience = Patience()
    while bake.stage.name not in stages:
        assert patience.left(bake), f"still {bake.stage.name}"
        bake.step(bpy.context)
        bake.wait(0.1)


def colors(mesh, name: str = "Radiosity") -> np.ndarray:
    values = np.empty(4 * len(mesh.color_attributes[name].data), np.float32)
    mesh.color_attributes[name].data.foreach_get("color", values)
    return values


def box(bpy):
    return bpy.data.objects["Box"]


def test_operator_bakes_and_reports(file):
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
    from radiosity_addon.ui import background, bake, session

    functions = {k: v for k, v in vars(bake.RADIOSITY_OT_bake).items() if not k.startswith("__")}
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


def test_images_are_baked_to_a_new_map_and_file(file, tmp_path):
    properties = file.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 16
    properties.write_files, properties.image_dir = True, str(tmp_path)
    assert file.ops.radiosity.bake() == {"FINISHED"}
    assert file.data.images["Radiosity_Box"].size[:] == (16, 16)
    assert "Radiosity" in box(file).data.uv_layers
    assert (tmp_path / "Radiosity_Box.exr").exists()


def test_failure_is_a_message_and_changes_nothing(file, tmp_path):
    properties = file.context.scene.radiosity
    properties.target, properties.write_files = "IMAGE", True
    properties.resolution, properties.image_dir = 16, str(tmp_path / "missing")
    with pytest.raises(RuntimeError, match="missing"):
        file.ops.radiosity.bake()
    assert not box(file).data.uv_layers and not file.data.images and not properties.report


def test_missing_uv_map_is_refused_by_name(file):
    properties = file.context.scene.radiosity
    properties.target, properties.uv_map = "IMAGE", "Atlas"
    with pytest.raises(RuntimeError):
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
    with pytest.raises(RuntimeError, match="running already"):
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


def everything(bpy) -> dict:
    """Names of all data-blocks, and what the meshes carry."""
    found = {}
    for name in ("objects", "meshes", "images", "scenes", "materials", "lights", "cameras"):
        found[name] = sorted(block.name for block in getattr(bpy.data, name))
    for mesh in bpy.data.meshes:
        found[mesh.name] = sorted((item.name, item.data_type) for item in mesh.attributes)
    return found


def many(bpy, count: int = 3) -> None:
    """Copies of the box with meshes of their own, far away; images of 16 texels asked for."""
    for index in range(count):
        other = box(bpy).copy()
        other.data, other.name, other.location = box(bpy).data.copy(), f"Other {index}", (5, 0, 0)
        bpy.context.scene.collection.objects.link(other)
    properties = bpy.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 16


PHASES = {
    "importing": lambda bake, bpy: bake.stage.name == "START" and bake._process is not None,
    "reading": lambda bake, bpy: bake.stage.name == "EXPORT" and bake.fraction > 0,
    "solving": lambda bake, bpy: bake.stage.name == "SOLVE",
    "writing": lambda bake, bpy: bake.stage.name == "WRITE" and len(bpy.data.images) == 2,
}


@pytest.fixture
def slowly(monkeypatch):
    """One piece of work a step, so that every phase can be caught in its midst."""
    from radiosity_addon.ui import pace

    monkeypatch.setattr(pace, "MOST", 0.0)
    monkeypatch.setattr(pace, "SLOW", 0.0)


def reach(bpy, bake, phase: str) -> None:
    patience = Patience()
    while not PHASES[phase](bake, bpy):
        assert patience.left(bake), f"still {bake.stage.name}"
        assert bake.stage.name != "DONE", f"{phase} was passed over"
        bake.step(bpy.context)
        bake.wait(0.1)


@pytest.mark.parametrize("phase", PHASES)
def test_cancel_in_every_phase_leaves_the_scene_as_it_was(file, session, slowly, phase):
    from radiosity_addon.ui.session import current

    many(file)
    before = everything(file)
    bake = session()
    reach(file, bake, phase)
    assert file.ops.radiosity.cancel() == {"FINISHED"}
    assert current() is None
    assert everything(file) == before
    assert not file.ops.radiosity.cancel.poll()


@pytest.mark.parametrize("phase", ["reading", "writing"])
def test_failure_in_the_midst_puts_everything_back(file, session, slowly, phase, monkeypatch):
    from radiosity_addon.bake import unwrap
    from radiosity_addon.stages import apply

    many(file)
    before = everything(file)
    bake = session()
    reach(file, bake, phase)

    def fail(*_, **__):
        raise OSError("no space left")

    monkeypatch.setattr(unwrap, "edit_uvs", fail)
    monkeypatch.setattr(apply, "write_image", fail)
    with pytest.raises(OSError, match="no space"):
        until(file, bake, "DONE")
    assert everything(file) == before


def test_files_that_cannot_be_put_in_place_take_the_bake_back(file, tmp_path, monkeypatch):
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


@pytest.mark.parametrize("change", ["delete", "rename", "edit"])
def test_objects_that_change_while_they_are_read(file, session, slowly, change):
    many(file)
    bake = session()
    reach(file, bake, "reading")
    while bake.fraction < 0.03:  # SOLVE_FROM times 0.6: the evaluation is over
        bake.step(file.context)
    other = file.data.objects["Other 1"]
    if change == "delete":
        file.data.objects.remove(other)
    elif change == "rename":
        other.name = "Crate"
    else:
        other.data = file.data.meshes.new("Empty")
    until(file, bake, "DONE")
    done = {entry["name"] for entry in bake.report["objects"] if entry["baked"]}
    rest = {"Box", "Other 0", "Other 2"}
    assert done == (rest | {"Crate"} if change == "rename" else rest)
    assert {"Radiosity_" + name for name in done} == {image.name for image in file.data.images}


@pytest.mark.parametrize("phase", ["reading", "writing"])
def test_undo_and_another_file_end_a_bake_in_the_midst(file, session, slowly, phase):
    from radiosity_addon.ui import lifetime
    from radiosity_addon.ui.session import current

    many(file)
    before = everything(file)
    bake = session()
    reach(file, bake, phase)
    lifetime.before_undo()
    assert (current() is None) == (phase == "writing")
    lifetime.give_up()
    assert current() is None and everything(file) == before


def test_blender_that_quits_takes_the_solver_and_all_files_along(room, tmp_path):
    code = f"""
        import sys, time, bpy, radiosity_addon
        radiosity_addon.register()
        bpy.ops.wm.open_mainfile(filepath={str(room)!r})
        from radiosity_addon.ui import properties, session
        scene = bpy.context.scene
        scene.radiosity.quality, scene.radiosity.error = "CUSTOM", 1e-4  # minutes
        session.begin(session.BakeSession("Scene", properties.settings_of(scene.radiosity)))
        bake = session.current()
        while bake.stage.name != "SOLVE":
            bake.step(bpy.context)
        assert "scipy" not in sys.modules  # which the solver's process imports
        time.sleep(1)
        print(bake._process._process.pid, bpy.app.tempdir)
    """
    line = [sys.executable, "-c", textwrap.dedent(code)]
    done = subprocess.run(
        line, cwd=ROOT, env={**os.environ, "TMPDIR": str(tmp_path)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    pid, folder = done.stdout.strip().splitlines()[-1].split(maxsplit=1)
    deadline = time.monotonic() + 10
    while list(tmp_path.glob("radiosity-*")) or Path(folder).exists():
        assert time.monotonic() < deadline, list(tmp_path.iterdir())
        time.sleep(0.05)


def test_renamed_object_is_followed(file, session):
    bake = session()
    until(file, bake, "WRITE")
    item = box(file)
    item.name = "Crate"
    until(file, bake, "DONE")
    assert "Radiosity" in item.data.color_attributes
    assert [entry["name"] for entry in bake.report["objects"]] == ["Crate"]


def test_deleted_object_is_left_out_with_a_warning(file, session):
    other = box(file).copy()
    other.data, other.name, other.location = box(file).data.copy(), "Other", (5, 0, 0)
    file.context.scene.collection.objects.link(other)
    bake = session()
    until(file, bake, "WRITE")
    file.data.objects.remove(other)
    until(file, bake, "DONE")
    assert "Radiosity" in box(file).data.color_attributes
    assert any("Other was deleted" in text for text in bake.report["warnings"])


def test_nothing_left_to_write_to_is_an_error(file, session):
    bake = session()
    until(file, bake, "WRITE")
    file.data.objects.remove(box(file))
    with pytest.raises(RuntimeError, match="Box was deleted .* bake again"):
        bake.step(file.context)


def test_edited_mesh_is_not_written_wrongly(file, session):
    bake = session()
    until(file, bake, "WRITE")
    box(file).data = file.data.meshes.new("Other mesh")
    with pytest.raises(RuntimeError, match="Box was edited"):
        bake.step(file.context)


def test_edit_mode_is_waited_for(file, session):
    bake = session()
    until(file, bake, "SOLVE")
    file.context.view_layer.objects.active = box(file)
    file.ops.object.mode_set(mode="EDIT")
    until(file, bake, "WAIT")
    bake.step(file.context)
    assert bake.stage.name == "WAIT" and bake.detail == "Box"
    file.ops.object.mode_set(mode="OBJECT")
    until(file, bake, "DONE")
    assert "Radiosity" in box(file).data.color_attributes


def test_another_file_ends_the_bake(file, session):
    from radiosity_addon.ui.session import current

    bake = session()
    until(file, bake, "SOLVE")
    file.ops.wm.read_homefile(use_empty=True)
    assert current() is None


def test_crash_of_the_solver_is_a_message(file, session):
    bake = session()
    until(file, bake, "SOLVE")
    bake._process._process.kill()
    bake.wait(5)
    with pytest.raises(RuntimeError, match="solver's process stopped"):
        bake.step(file.context)
