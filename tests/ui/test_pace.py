"""How many pieces a step of reading or writing has, by a clock that the test turns."""

from __future__ import annotations

import pytest

from radiosity_addon.ui.pace import Pace


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
def clock() -> Clock:
    return Clock()


def pieces(clock, pace, drawing: float, piece: float, wait: float = 0.0) -> int:
    """How many of these a step has after the window took ``drawing``; a piece also waits for the
    processor for ``wait`` seconds."""
    clock.pass_by(drawing, 0.0)
    pace.begin()
    for number in range(1, 1000):
        clock.pass_by(piece + wait, piece)
        if pace.enough():
            return number
    raise AssertionError("the step does not end")


# Pieces of 2 ms, one more or less by the rounding of sums. A step has as many as fill twice the window's
# drawing, at least 50 ms, at most 80 ms (the last of 2 ms left for a long one) where the window is quick,
# else 1 s: 25, 39, 300, 500.
@pytest.mark.parametrize(("drawing", "expected"), [(0.004, 25), (0.06, 39), (0.3, 300), (3.0, 500)])
def test_the_work_has_two_thirds_of_the_time(clock, drawing, expected):
    pace = Pace(clock=clock)
    pieces(clock, pace, 0.0, 0.001)
    assert pieces(clock, pace, drawing, 0.002) == pytest.approx(expected, abs=1)


def test_the_first_step_knows_how_slow_the_window_is(clock):
    """Drawn before it for 0.3 s: it has 0.6 s. Where nothing was to be drawn, what passed was not that."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.3, 0.002) == pytest.approx(25, abs=1)
    pace.restart()
    pace.await_drawing()
    assert pieces(clock, pace, 0.3, 0.002) == pytest.approx(300, abs=1)


def test_a_long_piece_leaves_room_for_another(clock):
    """After one of 45 ms the 80 ms have no room for another. With each short piece that is feared less:
    those of 4 ms fill the next step's 50 ms, and after one of 30 ms there is room for another."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.01, 0.045) == 1
    assert pieces(clock, pace, 0.01, 0.004) == pytest.approx(13, abs=1)
    assert pieces(clock, pace, 0.01, 0.03) == 2


def test_where_the_window_is_slow_a_long_piece_is_not_feared(clock):
    """After a drawing of 0.3 s there are six pieces of 0.1 s, of which 0.08 s would have none."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.01, 0.1) == 1
    assert pieces(clock, pace, 0.3, 0.1) == pytest.approx(6, abs=1)


def test_a_slow_drawing_is_remembered_and_fades(clock):
    """After one of 0.4 s the next step has 400 pieces of 2 ms. Another work begins with as many, though
    minutes have passed meanwhile: those were no drawing. With quick ones each step is 3/4 of the last: 300,
    225, 169, 127, 95 pieces. Then the window counts as quick, and 2 * 0.071 s are cut at 80 ms; from the
    tenth, of 2 * 0.4 * 0.75**10 = 45 ms, a step has the 25 of the least."""
    pace = Pace(clock=clock)
    pieces(clock, pace, 0.0, 0.002)
    assert pieces(clock, pace, 0.4, 0.002) == pytest.approx(400, abs=1)
    pace.restart()
    assert pieces(clock, pace, 100.0, 0.002) == pytest.approx(400, abs=1)
    later = [pieces(clock, pace, 0.01, 0.002) for _ in range(11)]
    assert later[:6] == pytest.approx([300, 225, 169, 127, 95, 39], abs=1)
    assert later[9:] == pytest.approx([25, 25], abs=1)


def test_waiting_for_a_processor_makes_later_steps_no_shorter(clock):
    """A piece of 1 ms that waited for 0.4 s is a short piece: the next step has 50 ms of them."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.0, 0.001, wait=0.4) == 1
    assert pieces(clock, pace, 0.01, 0.001) == pytest.approx(50, abs=1)


def test_waiting_counts_as_the_steps_time(clock):
    """After a drawing of 0.3 s pieces of 1 ms that wait for 9 ms more are 60, not 600."""
    pace = Pace(clock=clock)
    pieces(clock, pace, 0.0, 0.001)
    assert pieces(clock, pace, 0.3, 0.001, wait=0.009) == pytest.approx(60, abs=1)


# A picture every 0.25 s where the next tick comes at once; where each takes 0.5 s, one begins
# 0.5 s + 4 * 0.5 s after the other: in 10 s there are 40, and 4.
@pytest.mark.parametrize(("drawing", "expected"), [(0.0, 40), (0.5, 4)])
def test_pictures_of_the_progress_leave_four_fifths_to_the_work(
    clock, addon, monkeypatch, drawing, expected
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
