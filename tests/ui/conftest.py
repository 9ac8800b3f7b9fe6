"""What the interface's tests lean on: a job that needs no Blender, the add-on registered, and a bake
as the button starts it."""

from __future__ import annotations

import os

import pytest

from radiosity_addon.bake_job import Job
from tests.square import square_job


@pytest.fixture
def one_core():
    """Processes that the test starts may use the core it runs on: the solver's then starts no second
    one, which takes a second to import the libraries and changes nothing in the result, as
    ``test_button_operator_and_command_line_give_identical_colors`` shows. Linux only. The test may
    call what it gets to use all cores from then on."""
    if not hasattr(os, "sched_setaffinity"):
        yield lambda: None
        return
    cores = os.sched_getaffinity(0)
    with open("/proc/self/stat") as handle:
        here = int(handle.read().rpartition(")")[2].split()[36])
    os.sched_setaffinity(0, {here} & cores or cores)
    yield lambda: os.sched_setaffinity(0, cores)
    os.sched_setaffinity(0, cores)


@pytest.fixture
def solver_here(monkeypatch):
    """Bakes from the button are solved in this process: see ``WorkerHere``."""
    from radiosity_addon.ui.solver_process import SolverProcess
    from tests.ui.bakes import WorkerHere

    monkeypatch.setattr(SolverProcess, "_start", lambda *words: WorkerHere(*words))


@pytest.fixture
def make_job():
    """A function: the job of a square (reflectance 0.5) under a sun of irradiance π, so that its
    radiance is 0.5. As an image of 1,600 texels there are 2.6 million receivers: many seconds."""

    def make(resolution: int | None = None, **options) -> Job:
        if resolution is None:
            return square_job("vertex", **options)
        return square_job("image", resolution=resolution, **options)

    return make


@pytest.fixture
def addon(blender):
    """The add-on registered in an empty file; taken away afterward."""
    import radiosity_addon

    radiosity_addon.register()
    yield blender
    radiosity_addon.unregister()


@pytest.fixture
def file(addon, room, one_core):
    """The room of ``tests/conftest.py``, open, with a draft to bake, but for light that comes by way of other
    surfaces: to find that takes seven times as long, and most tests look at what becomes of the light."""
    addon.ops.wm.open_mainfile(filepath=str(room))
    addon.context.scene.radiosity.quality = "DRAFT"
    addon.context.scene.radiosity.passes = {"EMIT", "DIRECT", "COLOR"}
    return addon


@pytest.fixture
def session(file, tmp_path, monkeypatch):
    """A function: a bake of the open file as the button starts it, at a ``pace``. Its files must all go."""
    from radiosity_addon.ui import properties, session, solver_process

    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(solver_process.tempfile, "tempdir", str(folder))

    def begin(*pace):
        settings = properties.settings_of(file.context.scene.radiosity)
        session.begin(session.BakeSession(file.context.scene.name, settings, *pace))
        return session.current()

    yield begin
    session.end()
    assert list(folder.iterdir()) == []


@pytest.fixture
def slowly():
    """The pace of one piece of work a step, so that every phase can be caught in its midst."""
    from radiosity_addon.ui.pace import Pace

    class OnePiece(Pace):
        def enough(self) -> bool:
            return super().enough() or True

    return OnePiece()
