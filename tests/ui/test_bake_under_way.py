"""What happens in the midst of a bake: cancels, failures, undo, and objects that change."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from radiosity_addon.solver.expected import Refused
from tests.ui.bakes import PHASES, box, everything, many, reach, until

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("phase", PHASES)
def test_cancel_in_every_phase_leaves_the_scene_as_it_was(file, session, slowly, phase):
    from radiosity_addon.ui.session import current

    many(file)
    before = everything(file)
    bake = session(slowly)
    reach(file, bake, phase)
    assert file.ops.radiosity.cancel() == {"FINISHED"}
    assert current() is None
    assert everything(file) == before
    assert not file.ops.radiosity.cancel.poll()


@pytest.mark.parametrize("phase", ["reading", "writing"])
def test_failure_in_the_midst_puts_everything_back(file, solver_here, session, slowly, phase, monkeypatch):
    from radiosity_addon.bake import unwrap
    from radiosity_addon.stages import apply

    many(file)
    before = everything(file)
    bake = session(slowly)
    reach(file, bake, phase)

    def fail(*_, **__):
        raise OSError("no space left")

    monkeypatch.setattr(unwrap, "edit_uvs", fail)
    monkeypatch.setattr(apply, "write_image", fail)
    with pytest.raises(OSError, match="no space"):
        until(file, bake, "DONE")
    assert everything(file) == before


@pytest.mark.parametrize("change", ["delete", "rename", "edit"])
def test_objects_that_change_while_they_are_read(file, solver_here, session, slowly, change):
    many(file)
    bake = session(slowly)
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
    bake = session(slowly)
    reach(file, bake, phase)
    lifetime.before_undo()
    assert (current() is None) == (phase == "writing")
    lifetime.give_up()
    assert current() is None and everything(file) == before


@pytest.mark.timed
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
        while bake.state.name != "SOLVE":
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


def test_renamed_object_is_followed(file, solver_here, session):
    bake = session()
    until(file, bake, "WRITE")
    item = box(file)
    item.name = "Crate"
    until(file, bake, "DONE")
    assert "Radiosity" in item.data.color_attributes
    assert [entry["name"] for entry in bake.report["objects"]] == ["Crate"]


def test_deleted_object_is_left_out_with_a_warning(file, solver_here, session):
    other = box(file).copy()
    other.data, other.name, other.location = box(file).data.copy(), "Other", (5, 0, 0)
    file.context.scene.collection.objects.link(other)
    bake = session()
    until(file, bake, "WRITE")
    file.data.objects.remove(other)
    until(file, bake, "DONE")
    assert "Radiosity" in box(file).data.color_attributes
    assert any("Other was deleted" in text for text in bake.report["warnings"])


def test_nothing_left_to_write_to_is_an_error(file, solver_here, session):
    bake = session()
    until(file, bake, "WRITE")
    file.data.objects.remove(box(file))
    with pytest.raises(Refused, match="Box was deleted .* bake again"):
        bake.step(file.context)


def test_edited_mesh_is_not_written_wrongly(file, solver_here, session):
    bake = session()
    until(file, bake, "WRITE")
    box(file).data = file.data.meshes.new("Other mesh")
    with pytest.raises(Refused, match="Box was edited"):
        bake.step(file.context)


def test_edit_mode_is_waited_for(file, solver_here, session):
    bake = session()
    until(file, bake, "SOLVE")
    file.context.view_layer.objects.active = box(file)
    file.ops.object.mode_set(mode="EDIT")
    until(file, bake, "WAIT")
    bake.step(file.context)
    assert bake.state.name == "WAIT" and bake.detail == "Box"
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
    with pytest.raises(Refused, match="solver's process stopped"):
        bake.step(file.context)
