"""The twin: the same light from two processes as from one, and what happens when one ends."""

from __future__ import annotations

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.replicate_process import ReplicateProcess, peak_memory, start_replicate_process
from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.requests import FollowMorePaths
from radiosity_addon.solver.adaptive.solve_cache import SolveCache
from radiosity_addon.solver.expected import ProcessLost
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.sequence import solve
from tests.one_core import FAST
from verification import meshes

SETTINGS = Settings(error=0.02, threads=2)

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def twin():
    with ReplicateProcess() as process:
        yield process


def lit_box(reflectance=0.6):
    """A closed box whose ceiling shines, a block in it, of two colors: more than one round."""
    walls, _ = meshes.box_polygons((2, 2, 2))
    block, _ = meshes.box_polygons((0.6, 0.6, 0.9), (0.4, 0.4, 0.1))
    parts = [meshes.grid(wall, 3) for wall in walls]
    parts += [meshes.grid(side[::-1], 2) for side in block]
    exitance = np.zeros((len(parts), 1))
    exitance[5] = 2.0
    scene = meshes.scene(parts, reflectance, exitance)
    return scene, meshes.triangle_receivers(scene, 3)


@pytest.fixture(scope="module")
def alone():
    """The light of ``lit_box()`` from one process."""
    return solve(*lit_box(), SETTINGS)


def assert_same(one, other):
    for name in ("direct", "indirect", "emission"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    for name in ("elements", "rays", "iterations", "residual", "estimated_error", "energy"):
        assert getattr(one.statistics, name) == getattr(other.statistics, name), name


def test_the_light_is_that_of_one_process_bit_for_bit(twin, alone):
    scene, receivers = lit_box()
    both = solve(scene, receivers, SETTINGS, beside=twin)
    assert twin.rays > 0.2 * both.statistics.rays  # it has done its part
    assert_same(both, alone)
    assert_same(both, solve(scene, receivers, replace(SETTINGS, threads=1), beside=twin))


def test_solves_that_were_kept_reach_the_other_process(twin):
    scene, receivers = lit_box()
    kept = SolveCache()
    first = solve(scene, receivers, SETTINGS, cache=kept, beside=twin)
    again = solve(scene, receivers, SETTINGS, cache=pickle.loads(pickle.dumps(kept)), beside=twin)
    assert again.statistics.rays < first.statistics.rays
    assert np.array_equal(first.indirect, again.indirect)


def test_its_fault_is_raised_here(twin):
    """Energy that grows without end, told by either half."""
    scene, receivers = lit_box(reflectance=1.0)
    twin.open(scene, receivers, SETTINGS, 1)
    twin.ask(FollowMorePaths(2.0))  # nothing is solved yet: there are no paths to follow on
    with pytest.raises(AttributeError, match="owner"):
        twin.answers()
    white = replace(scene, materials=tuple(
        replace(material, emission=Constant(np.zeros(3)), reflectance=Constant(np.ones(3)))
        for material in scene.materials
    ))  # fmt: skip
    solve(white, receivers, SETTINGS, beside=twin)  # still there, and of use


def test_one_that_has_ended_is_no_loss(alone):
    scene, receivers = lit_box()
    with ReplicateProcess() as process:
        process._process.kill()
        process._process.wait()
        found = solve(scene, receivers, SETTINGS, beside=process)
    assert_same(found, alone)
    assert any("second process ended" in text for text in found.statistics.warnings)


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
def test_one_that_ends_at_work_is_a_message():
    scene, receivers = lit_box()
    with ReplicateProcess() as process:

        def crash(phase: str, fraction: float):
            if phase == "gather":
                os.kill(process._process.pid, signal.SIGSEGV)

        with pytest.raises(ProcessLost, match="status -11.*lower the resolution"):
            solve(scene, receivers, replace(SETTINGS, error=5e-3), crash, beside=process)


def test_stopping_leaves_no_process():
    scene, receivers = lit_box()

    def stop(phase: str, fraction: float):
        if phase == "gather":
            raise InterruptedError

    with pytest.raises(InterruptedError), ReplicateProcess() as process:
        solve(scene, receivers, replace(SETTINGS, error=5e-3), stop, beside=process)
    assert process._process.poll() is not None


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
def test_it_ends_with_whoever_started_it(tmp_path):
    """Killed, so that nothing can be put in order."""
    told = tmp_path / "pid"
    program = (
        "import pathlib, sys, time; from radiosity_addon.replicate_process import ReplicateProcess; twin = ReplicateProcess();"
        "pathlib.Path(sys.argv[1]).write_text(str(twin._process.pid)); print(flush=True);"
        "time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", program, told], stdout=subprocess.PIPE)
    process.stdout.read(1)
    process.kill()
    process.communicate()
    until = time.monotonic() + 10
    while is_there(int(told.read_text())) and time.monotonic() < until:
        time.sleep(0.05)
    assert not is_there(int(told.read_text()))


def is_there(number: int) -> bool:
    """Whether a process of this number is at work; one that ended may still be listed."""
    try:
        with open(f"/proc/{number}/stat") as handle:
            return handle.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_one_thread_or_no_python_has_none(monkeypatch):
    assert start_replicate_process(1) is None
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    assert start_replicate_process(2) is None
    assert peak_memory(None) > 0


def test_both_processes_work_where_blender_gives_the_package_a_long_name(tmp_path):
    """As of an installed extension: bl_ext.<repository>.<id>.radiosity_addon. The second process
    could not be started there, and what was asked of it not be read."""
    pytest.importorskip("bpy")
    package = tmp_path / "bl_ext" / "shop" / "radiosity"
    package.mkdir(parents=True)
    (package / "radiosity_addon").symlink_to(ROOT / "radiosity_addon")
    told = tmp_path / "report.json"
    words = ["--demo", "cornell", "--threads", "2", *FAST, "--output",
             str(tmp_path / "o.blend"), "--report", str(told)]  # fmt: skip
    code = ("import sys; from bl_ext.shop.radiosity.radiosity_addon.command import main; "
            "sys.exit(main(sys.argv[1:], alone=True))")  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code, *words], env=environment, cwd=tmp_path,
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(told.read_text())["warnings"] == []
