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
    for number in range(1, 4000):
        clock.pass_by(piece + wait, piece)
        if pace.enough():
            return number
    raise AssertionError("the step does not end")


def started(clock, pace) -> Pace:
    """The pace of a work whose first drawing begins now."""
    pace.restart()
    pace.await_drawing()
    return pace


def work(clock, pace, seconds: float, drawing: float, piece: float = 0.002) -> tuple[list[float], float]:
    """The steps of a work of so many seconds, and how long the window was drawn between them."""
    started(clock, pace)
    steps, drawn = [], 0.0
    while sum(steps) < seconds:
        drawn += drawing if steps else 0.0
        steps.append(piece * pieces(clock, pace, drawing, piece))
    return steps, drawn


# Of 12 or 24 s of work in pieces of 2 ms. The work has two thirds of the time. Where the window is quick a step has 50 ms, or 78 ms
# (before the last of 80 ms another piece is feared): more than half.
@pytest.mark.parametrize(
    ("drawing", "longest", "share"),
    [(0.004, 0.05, 0.92), (0.06, 0.078, 0.56), (0.3, 0.6, 0.66), (0.8, 1.6, 0.66), (3.0, 6.0, 0.66)],
)
def test_the_work_has_two_thirds_of_the_time(clock, drawing, longest, share):
    """So it takes at most twice as long as without a window, and has no drawing in it where it fits into one step."""
    steps, drawn = work(clock, Pace(clock=clock), max(12.0, 4 * longest), drawing)
    assert max(steps) == pytest.approx(longest, abs=0.003)
    assert sum(steps) / (sum(steps) + drawn) > share
    steps, drawn = work(clock, Pace(clock=clock), 0.9 * longest, drawing)
    assert (len(steps), drawn) == (1, 0.0)


def test_drawings_that_were_not_foreseen_are_made_up_for(clock):
    """Drawn before it for 0.1 s, a work has a first step of 0.2 s, 100 pieces. Where pictures then take 0.4 s, all steps
    together shall have 2 * (0.4 + 0.4) s: 1.4 s more, of which the next has 1 s and the one after that
    2 * (0.8 + 0.4) - 1.2 s, 1 s at most, then 2 * (1.2 + 0.4) - 2.2 s."""
    pace = started(clock, Pace(clock=clock))
    assert pieces(clock, pace, 0.1, 0.002) == pytest.approx(100, abs=1)
    later = [pieces(clock, pace, 0.4, 0.002) for _ in range(5)]
    assert later == pytest.approx([500, 500, 500, 400, 400], abs=1)


def test_another_work_knows_how_slow_the_window_was(clock):
    """Minutes that passed between the two were no drawing, and what the window had of the first is no debt of the second."""
    pace = Pace(clock=clock)
    work(clock, pace, 3.0, 0.3)
    pace.restart()
    assert pieces(clock, pace, 100.0, 0.002) == pytest.approx(300, abs=1)


def test_a_long_piece_leaves_room_for_another(clock):
    """After one of 45 ms the 80 ms have no room for another. With each short piece that is feared less:
    those of 4 ms fill the next step's 50 ms, and after one of 30 ms there is room for another."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.01, 0.045) == 1
    assert pieces(clock, pace, 0.01, 0.004) == pytest.approx(13, abs=1)
    assert pieces(clock, pace, 0.01, 0.03) == 2


def test_where_the_window_is_slow_a_long_piece_is_not_feared(clock):
    """After a drawing of 0.3 s there are six pieces of 0.1 s, of which 0.08 s would have none."""
    pace = started(clock, Pace(clock=clock))
    assert pieces(clock, pace, 0.3, 0.1) == pytest.approx(6, abs=1)


def test_a_slow_drawing_fades(clock):
    """After one of 0.4 s the window is quick to draw. The first step, of 2 * 0.4 s, has paid for it: later ones are of the
    least length. It is taken for slow until 0.4 s * 0.75**k is below 80 ms: a piece of 45 ms is then the last of a step."""
    pace = started(clock, Pace(clock=clock))
    assert pieces(clock, pace, 0.4, 0.002) == pytest.approx(400, abs=1)
    later = [pieces(clock, pace, 0.004, 0.045) for _ in range(8)]
    assert later[0] == 2 and later[-1] == 1


def test_waiting_for_a_processor_makes_later_steps_no_shorter(clock):
    """A piece of 1 ms that waited for 0.4 s is a short piece: the next step has 50 ms of them."""
    pace = Pace(clock=clock)
    assert pieces(clock, pace, 0.0, 0.001, wait=0.4) == 1
    assert pieces(clock, pace, 0.01, 0.001) == pytest.approx(50, abs=1)


def test_waiting_counts_as_the_steps_time(clock):
    """After a drawing of 0.3 s pieces of 1 ms that wait for 9 ms more are 60, not 600."""
    pace = started(clock, Pace(clock=clock))
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
