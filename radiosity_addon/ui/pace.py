"""Pace: how long a step of reading or writing is; Blender's window is drawn between two.

A step takes twice as long as the window took of late, so that the work has two thirds of the time: what
changes a mesh or renders has Blender draw the viewport anew, eight times for smooth edges, however
short the step was. Where the window is quick, steps are too short to be felt.
"""

from __future__ import annotations

import time

LEAST = 0.05  # time [s] of a step: shorter ones have the window drawn more often than it has use for
MOST = 0.08  # time [s] of work in a step, where the window itself is quicker: longer ones are felt
SLOW = 1.0  # time [s] of a step that makes up for drawings longer than foreseen: others take no more than SHARE of them
SHARE = 2  # ratio [of all steps to all drawings between them]: higher, less is drawn while a scene is read
# Factor [of its length] that a drawing or piece counts for after each further one: higher, longer remembered.
FADES = 0.75


class Pace:
    """Tells after each piece of work whether a step had enough of them. One for all bakes: how slow the
    window is to draw is known from the last."""

    def __init__(self, clock=time) -> None:
        """``clock`` has ``perf_counter`` and ``thread_time``."""
        self._clock = clock
        self._drawing = 0.0  # seconds: the longest that the window took of late between two steps
        self.restart()

    def restart(self) -> None:
        """Another work begins; its pieces are not like those of the last."""
        self._ended: float | None = None
        self._longest = 0.0  # seconds of work in a piece of late: not of waiting for a processor
        self._steps = self._drawings = 0.0  # seconds of all steps of this work, and of the window between them

    def await_drawing(self) -> None:
        """The window is drawn before the first step: that tells how slow it is."""
        self._ended = self._clock.perf_counter()

    def begin(self) -> None:
        """A step begins. It lasts until all steps have had their share, were the window then drawn once more."""
        self._at, self._before = self._clock.perf_counter(), self._clock.thread_time()
        if self._ended is not None:
            drawing = self._at - self._ended
            self._drawing = max(drawing, FADES * self._drawing)
            self._drawings += drawing if self._steps else 0.0  # that before the first step is not between two
        self._quick, self._left = self._drawing < MOST, MOST
        lacking = SHARE * (self._drawings + self._drawing) - self._steps
        self._until = self._at + max(LEAST, min(lacking, max(SLOW, SHARE * self._drawing)))

    def enough(self) -> bool:
        """A piece is done: whether it was the step's last. Where the window is quick another long
        one might be too much."""
        at, work = self._clock.perf_counter(), self._clock.thread_time()
        worked, self._steps = work - self._before, self._steps + at - self._at
        self._at, self._before, self._ended = at, work, at
        self._longest, self._left = max(FADES * self._longest, worked), self._left - worked
        return at >= self._until or (self._quick and self._left <= self._longest)
