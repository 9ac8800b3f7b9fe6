"""How many pieces a step of reading or writing has, by a clock that the test turns."""

from __future__ import annotations

import pytest


class Clock:
    """Stands in for ``time``: what passes by the wall, and what this thread works of it."""

    wall = work = 0.0

    def perf_counter(self) -> float:
        return self.wall

    def thread_time(self) -> float:
        return self.work

    def pass_by(self, wall: float, work: float) -> None:
        self.wall, self.work = self.wall + wall, self.work + work


@pytest.fixture
def clock(addon, monkeypatch) -> Clock:
    from radiosity_addon.ui import pace

    clock = Clock()
    monkeypatch.setattr(pace, "time", clock)
    return clock


def pieces(clock, pace, turn: float, piece: float, wait: float = 0.0) -> int:
    """How many of these a step has after the window took ``turn``; a piece also waits for the
    processor for ``wait`` seconds."""
    clock.pass_by(turn, 0.0)
    pace.begin()
    for number in range(1, 1000):
        clock.pass_by(piece + wait, piece)
        if pace.enough():
            return number
    raise AssertionError("the step does not end")


# Pieces of 2 ms, one more or less by the rounding of sums. A step has as many
# as fill the window's turn, at least 20 ms, at most 80 ms less the longest piece: 10, 25, 39.
@pytest.mark.parametrize(("turn", "expected"), [(0.004, 10), (0.049, 25), (0.5, 39)])
def test_the_work_has_half_of_the_time(clock, turn, expected):
    from radiosity_addon.ui.pace import Pace

    pace = Pace()
    pieces(clock, pace, 0.0, 0.001)
    pieces(clock, pace, 0.0, 0.002)
    assert pieces(clock, pace, turn, 0.002) == pytest.approx(expected, abs=1)


def test_a_long_piece_leaves_room_for_another(clock):
    """After one of 70 ms there are 10 ms left of 80: ten pieces of 1 ms, and none after another of
    70 ms."""
    from radiosity_addon.ui.pace import Pace

    pace = Pace()
    assert pieces(clock, pace, 0.0, 0.07) == 1
    assert pieces(clock, pace, 0.5, 0.001) == pytest.approx(10, abs=1)
    assert pieces(clock, pace, 0.5, 0.07) == 1


def test_waiting_for_a_processor_makes_later_steps_no_shorter(clock):
    """A piece of 1 ms that waited for 0.4 s is a short piece: the next step has 79 ms of them."""
    from radiosity_addon.ui.pace import Pace

    pace = Pace()
    assert pieces(clock, pace, 0.0, 0.001, wait=0.4) == 1
    assert pieces(clock, pace, 0.5, 0.001) == pytest.approx(79, abs=1)


def test_waiting_counts_as_the_steps_time(clock):
    """After a turn of 0.3 s pieces of 1 ms that wait for 9 ms more are 30, not 79."""
    from radiosity_addon.ui.pace import Pace

    assert pieces(clock, Pace(), 0.3, 0.001, wait=0.009) == pytest.approx(30, abs=1)


# A picture every 0.25 s where the next tick comes at once; where each takes 0.5 s, one begins
# 0.5 s + 4 * 0.5 s after the other: in 10 s there are 40, and 4.
@pytest.mark.parametrize(("drawing", "expected"), [(0.0, 40), (0.5, 4)])
def test_pictures_of_the_progress_leave_four_fifths_to_the_work(
    clock, monkeypatch, drawing, expected
):
    from radiosity_addon.ui import background

    pictures = []
    monkeypatch.setattr(background, "time", clock)
    monkeypatch.setattr(background, "progress_text", lambda bake: str(clock.wall))
    monkeypatch.setattr(background, "redraw", pictures.append)
    progress = background.Progress()
    while clock.wall < 10:
        before = len(pictures)
        progress.show(None, None)
        clock.pass_by(0.01 + drawing * (len(pictures) - before), 0.0)
    assert len(pictures) == pytest.approx(expected, abs=2 if expected == 40 else 1)
