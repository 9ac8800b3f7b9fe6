"""Helper processes: the same light from any number of them, and what happens when one is lost."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest

from radiosity_addon.helper_processes import HelperProcesses, make_folders, start_helpers
from radiosity_addon.replicate_process import ReplicateProcess, peak_memory
from radiosity_addon.settings import Settings
from radiosity_addon.shared_arrays import LEAST, MappedArrays, SharedArrays, pack_work, unpack_work
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.workers.parallel import map_chunks

from .test_replicate_process import assert_same, is_there, lit_box

SETTINGS = Settings(error=0.01, threads=6)  # arrays so large that they go by files


@pytest.fixture(scope="module")
def alone():
    """The light of ``lit_box()`` from one process."""
    return solve(*lit_box(), SETTINGS)


@pytest.fixture(scope="module")
def processes():
    with ReplicateProcess(6) as beside:
        yield beside


@pytest.fixture
def few():
    """One helper of each replicate."""
    with ReplicateProcess(4) as beside:
        yield beside


def test_the_light_is_that_of_one_process_bit_for_bit(processes, alone):
    found = solve(*lit_box(), SETTINGS, beside=processes)
    assert processes.helpers.rays > 0.1 * found.statistics.rays  # they have done their part
    assert_same(found, alone)
    assert peak_memory(processes) > peak_memory(None) + processes.peak_memory
    again = solve(*lit_box(), replace(SETTINGS, threads=4), beside=processes)  # with fewer of them
    assert_same(again, alone)
    assert_same(solve(*lit_box(), replace(SETTINGS, threads=1), beside=processes), alone)


def test_one_that_is_lost_at_work_is_no_loss(few, alone):
    lost = []

    def kill_one(phase: str, fraction: float):
        if phase == "gather" and not lost:
            lost.append(few.helpers._processes[0])
            lost[0]._process.kill()

    assert_same(solve(*lit_box(), SETTINGS, kill_one, beside=few), alone)
    assert len(lost) == 1


def test_where_arrays_have_no_room_all_is_done_here(few, alone):
    for folder in few.helpers._folders:
        folder.rmdir()
    assert_same(solve(*lit_box(), SETTINGS, beside=few), alone)
    assert few.helpers.rays == 0


def test_a_fault_at_work_is_raised_here(processes):
    helpers = processes.helpers
    scene, receivers = lit_box()
    solve(scene, receivers, replace(SETTINGS, error=0.1), beside=processes)
    with pytest.raises(TypeError, match="no chunk"):
        map_chunks(Refusing(np.zeros(3)), [0, 1, 2, 3], 1, lambda fraction: None, helpers)


@dataclass(frozen=True)
class Refusing:
    """Work that fails."""

    values: np.ndarray

    def __call__(self, chunk: int) -> None:
        raise TypeError("no chunk")


def test_closing_leaves_neither_processes_nor_files():
    helpers = HelperProcesses(2)
    folders, numbers = helpers._folders, [each._process.pid for each in helpers._processes]
    assert all(folder.is_dir() for folder in folders)
    helpers.close()
    assert not any(folder.exists() for folder in folders)
    assert not any(is_there(number) for number in numbers)


@pytest.mark.skipif(os.name == "nt", reason="signals are POSIX's")
def test_they_end_with_whoever_started_them_and_remove_what_was_shared():
    """Killed, so that nothing can be put in order."""
    program = (
        "import time; from radiosity_addon.replicate_process import ReplicateProcess;"
        "beside = ReplicateProcess(6); helpers = beside.helpers;"
        "print(*[each._process.pid for each in helpers._processes], *helpers._folders, flush=True);"
        "time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    one, other, *folders = process.stdout.readline().split()
    process.kill()
    process.communicate()
    until = time.monotonic() + 20

    def left() -> bool:
        return is_there(int(one)) or is_there(int(other)) or any(map(os.path.exists, folders))

    while left() and time.monotonic() < until:
        time.sleep(0.05)
    assert folders and not left()


def test_none_are_started_for_two_cores(monkeypatch):
    with ReplicateProcess(2) as beside:
        assert beside.helpers is None
    assert start_helpers(0) is None
    folders = make_folders()
    monkeypatch.setattr("radiosity_addon.helper_processes.make_folders", lambda: folders)
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    assert start_helpers(2) is None
    assert not any(folder.exists() for folder in folders)


def test_few_help_where_memory_is_short(processes, monkeypatch):
    monkeypatch.setattr("radiosity_addon.memory.available_memory", lambda: int(1e9))
    scene, receivers = lit_box()
    solve(scene, receivers, replace(SETTINGS, error=0.1), beside=processes)
    assert len(processes.helpers._used) == 1


@pytest.fixture
def shared():
    folders = make_folders()
    yield SharedArrays(folders), folders
    for folder in folders:
        folder.rmdir()  # which must be empty


def test_work_arrives_as_it_was(shared):
    arrays, folders = shared
    large = np.arange(LEAST, dtype=np.float64).reshape(-1, 4)
    stripes = np.broadcast_to(large[:, None], (len(large), 3, 4))
    mine = object()
    work = {"c": large, "f": np.asfortranarray(large), "part": large[::2], "small": np.arange(3),
            "repeated": stripes, "same": large, "mine": mine}  # fmt: skip
    packed = pack_work(work, arrays, {id(mine): "mine"})
    assert len(packed.content) < 4000
    with pytest.raises(ValueError, match="read-only"):
        large[0] = 0
    other = object()
    found = unpack_work(packed.content, MappedArrays(), {"mine": other}, "radiosity_addon")
    assert found["mine"] is other
    for name in ("c", "f", "part", "small", "repeated", "same"):
        assert np.array_equal(found[name], work[name]) and found[name].dtype == work[name].dtype
    assert found["f"].flags.f_contiguous and found["repeated"].strides[1] == 0
    assert found["same"].base is found["c"].base
    assert sum(len(list(folder.iterdir())) for folder in folders) == 4  # ``large`` once, and its stripes
    del packed, work, large, stripes
    assert sum(len(list(folder.iterdir())) for folder in folders) == 0  # what nobody holds goes
