"""A bake under faults: a few of what ``python -m benchmarks.faults`` does.

The scene, an earlier result, its image file and report stay byte for byte as they were; nothing
else stays, in the folders or among temporary files; one line says what happened.
"""

from __future__ import annotations

import signal
import sys

import pytest

pytest.importorskip("bpy")

from benchmarks import fault_bakes as faults  # noqa: E402

TRIES = 3
EVERYTHING = tuple(sorted(faults.RESULTS))

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="POSIX signals and limits")


@pytest.fixture(scope="module")
def scene() -> bytes:
    return faults.demo_scene()


@pytest.fixture
def place(tmp_path, scene) -> faults.Place:
    return faults.make_place(tmp_path / "place", scene, size=64)


@pytest.fixture
def quick(tmp_path, scene) -> faults.Place:
    """Where light is not followed from surface to surface: nothing that is tested lies in that."""
    return faults.make_place(tmp_path / "place", scene, 64, "--passes=direct,color", "--threads=1")


@pytest.mark.timed
@pytest.mark.parametrize(
    ("stage", "number"),
    [("start", signal.SIGINT), ("gather", signal.SIGTERM), ("save", signal.SIGINT)],
)
def test_signal_ends_a_bake_within_a_second(stage, number, place):
    """Saving so small a bake may be over before the signal comes: then all of it is there. A
    machine that is busy with something else gets another try."""
    for _ in range(TRIES):
        found = faults.interrupt_at(place, stage, number)
        if found.status != 130 or found.seconds < 1.0:
            break
    if stage == "save" and found.status == 0:
        assert (found.strange, found.message) == (EVERYTHING, "")
        return
    assert (found.status, found.strange) == (130, ())
    assert found.message == "radiosity: interrupted; nothing was written\n"
    assert found.seconds < 1.0


@pytest.mark.parametrize("stage", ["start", "save"])
def test_kill_leaves_all_or_nothing_behind(stage, quick):
    """All where the machine is so busy that the bake ends before the kill comes."""
    found = faults.interrupt_at(quick, stage, signal.SIGKILL, delay=0.02)
    assert found.status == -signal.SIGKILL
    assert found.strange == () or (stage == "save" and found.strange == EVERYTHING)


def test_file_that_cannot_grow(quick):
    """2 kB are too few for 64² texels of 16 bytes, however they are packed."""
    import resource

    found = faults.limited(quick, {resource.RLIMIT_FSIZE: 2_000})
    assert (found.status, found.strange) == (1, ())
    assert found.message.count("\n") == 1 and "disk not full" in found.message


def test_blend_cut_short_is_noticed(blender, tmp_path):
    """Blender reports success when a compressed file cannot grow."""
    from radiosity_addon.command import _is_complete

    for compress in (False, True):
        path = tmp_path / "whole.blend"
        blender.ops.wm.save_as_mainfile(filepath=str(path), compress=compress)
        assert _is_complete(path)
        path.write_bytes(path.read_bytes()[:-1000])
        assert not _is_complete(path)


def test_blend_that_cannot_grow(quick):
    import resource

    words = [str(quick.scene), "--quality", "draft", *quick.options]
    found = faults.limited(quick, {resource.RLIMIT_FSIZE: 20_000}, words)
    assert (found.status, found.strange) == (1, ())
    assert found.message.count("\n") == 1 and "cannot be saved" in found.message


def test_memory_too_small_for_blender(quick):
    import resource

    found = faults.limited(quick, {resource.RLIMIT_AS: 1200 << 20})
    assert (found.status, found.strange) == (1, ())
    assert found.message.count("\n") == 1 and "ulimit -v" in found.message


def test_folder_that_goes_during_the_bake(place):
    found = faults.removed_during(place)
    assert (found.status, found.strange) == (1, ())
    assert found.message.count("\n") == 1 and "does not exist" in found.message


def test_killed_solver_is_a_message_and_changes_nothing(place):
    found = faults.solver_killed(place, 0.2)
    assert (found.status, found.strange) == (1, ())
    assert found.message.startswith("radiosity: the solver's process stopped (signal 9)")


def test_killed_helper_is_no_loss(place):
    found = faults.helper_killed(place, "gather")
    assert (found.status, found.message) == (0, "")
    assert set(found.strange) == set(faults.RESULTS)


def test_killed_second_process_is_a_message_and_changes_nothing(place):
    found = faults.second_killed(place, "transport")  # two stages before the end
    assert (found.status, found.strange) == (1, ())
    assert found.message.count("\n") == 1
    assert "second process ended (status -9); memory may have run out" in found.message
