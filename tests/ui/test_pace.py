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
