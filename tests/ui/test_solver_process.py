"""The solver's process: its result, its end by canceling, and its crashes."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon import bake_job as work
from radiosity_addon.libraries import environment
from radiosity_addon.settings import Settings
from radiosity_addon.solver.expected import Refused
from radiosity_addon.ui import payload, solver_process, worker
from radiosity_addon.ui.solver_process import SolverFailed, SolverProcess

PACKAGE = Path(worker.__file__).parents[1]


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    """Temporary folders are made in one of the test's own, which must be empty at the end."""
    monkeypatch.setattr(solver_process.tempfile, "tempdir", str(tmp_path))
    yield tmp_path
    assert list(tmp_path.iterdir()) == []


def started(job, **options) -> SolverProcess:
    process = SolverProcess(**options)
    process.give(job)
    return process


def wait(process: SolverProcess, seconds: float = 60) -> SolverProcess:
    assert process.wait(seconds)
    return process


def test_result_is_bit_identical_to_a_run_in_this_process(make_job):
    process = wait(started(make_job()))
    result, peak_memory, reused = process.result()
    process.close()
    here = work.run(make_job())
    assert np.array_equal(result.colors[0], here.colors[0])
    assert result.statistics.rays == here.statistics.rays
    assert peak_memory > 20 * 2**20  # SciPy alone takes more
    assert reused == ""


def test_progress_grows_up_to_one(make_job):
    process = started(make_job(resolution=64))
    told = [process.progress()]
    while not process.finished():
        told.append(process.progress())
        process.wait(0.02)
    process.close()
    assert all(0 <= fraction <= 1 for _, fraction in told)
    assert (worker.LOADING, 0.0) in told
    assert {stage for stage, _ in told} - {"", worker.LOADING}


@pytest.mark.timed
def test_close_ends_a_running_process_in_less_than_a_second(make_job):
    process = started(make_job(resolution=1600, error=1e-4))  # many seconds
    assert not process.wait(2.0)
    start = time.perf_counter()
    process.close()
    assert time.perf_counter() - start < 1.0
    assert process.finished()
    process.close()  # twice does no harm


def test_result_before_the_end_is_an_error(make_job):
    process = started(make_job(resolution=64))
    with pytest.raises(SolverFailed, match="still running"):
        process.result()
    process.close()


def test_bad_input_comes_back_as_its_own_message(make_job):
    import dataclasses

    job = make_job()
    broken = dataclasses.replace(job.scene, vertices=job.scene.vertices * 1e200)
    process = wait(started(dataclasses.replace(job, scene=broken)))
    with pytest.raises(SolverFailed) as caught:
        process.result()
    process.close()
    with pytest.raises(Refused) as here:
        work.run(dataclasses.replace(job, scene=broken))
    assert str(caught.value) == str(here.value)


def test_fault_of_ours_shows_the_last_words(monkeypatch):
    """Or, where a full disk kept none of them, that it is full."""
    process = wait(started({"not": "a job"}))
    with pytest.raises(SolverFailed, match="status 1.*AttributeError.*please report it"):
        process.result()
    for name in ("errors", worker.FAILURE):
        (process._folder / name).write_bytes(b"")
    with pytest.raises(SolverFailed, match="said nothing; memory"):
        process.result()
    usage = shutil.disk_usage(process._folder)._replace(free=4096)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage)
    with pytest.raises(SolverFailed, match="the disk of .* is full"):
        process.result()
    process.close()


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
def test_crash_is_a_message(make_job):
    process = started(make_job(resolution=1600, error=1e-4))
    process.wait(1.0)
    os.kill(process._process.pid, 11)
    wait(process)
    with pytest.raises(SolverFailed, match="signal 11"):
        process.result()
    process.close()


def test_package_that_cannot_be_written_to_works_all_the_same(make_job, own_folder, monkeypatch):
    """Installed where Python can keep no bytecode: a file is where each folder for it would be."""
    copy = own_folder / PACKAGE.name
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    for folder in (copy, *(item for item in copy.rglob("*") if item.is_dir())):
        (folder / "__pycache__").touch()
    monkeypatch.setattr(worker, "__file__", str(copy / "ui" / "worker.py"))
    process = wait(started(make_job()))
    process.result()
    process.close()
    assert not list(copy.rglob("*.pyc"))
    shutil.rmtree(copy)


def test_missing_python_leaves_no_files():
    with pytest.raises(OSError):
        SolverProcess(python="/no/such/python")


def test_process_ends_when_blender_is_gone(make_job, own_folder):
    """Blender killed: standard input ends, the process goes and takes its folder along."""
    folder = own_folder / "orphan"
    folder.mkdir()
    payload.write_payload(folder / worker.JOB, make_job(resolution=1600, error=1e-4))
    process = subprocess.Popen(
        [sys.executable, "-s", worker.__file__, str(folder)],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
    )
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(1.5)
    process.stdin.close()
    assert process.wait(5) == worker.FAILED
    process.stderr.close()
    assert not folder.exists()


def test_library_that_is_missing_is_named(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "embreex" else find(name)
    )
    with pytest.raises(SolverFailed, match="embreex is missing"):
        SolverProcess()


def test_pythons_own_variables_do_not_reach_the_process(monkeypatch):
    monkeypatch.setenv("PYTHONHOME", "/elsewhere")
    variables = environment()
    assert "PYTHONHOME" not in variables
    folders = variables["PYTHONPATH"].split(os.pathsep)
    assert all((Path(folder).is_dir()) for folder in folders)


def test_payload_written_under_a_long_name_is_read_under_the_short_one(own_folder):
    """An installed extension's classes live in bl_ext.user_default.radiosity.radiosity_addon.

    The pickle is written by hand: opcode c names a class by its module and its name.
    """
    long = b"bl_ext.user_default.radiosity." + payload.PACKAGE.encode()
    path = own_folder / "payload"
    path.write_bytes(long + b"\nc" + long + b".settings\nSettings\n.")
    assert payload.read_payload(path) is Settings
    path.unlink()
