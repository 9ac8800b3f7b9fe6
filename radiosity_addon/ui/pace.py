"""How long a step of reading or writing is, between two turns of Blender's window.

A step takes as long as the window took before it, so that the work has half of the time at least:
every step that changes a mesh has Blender draw the viewport anew, however short the step was.
"""

from __future__ import annotations

import time

LEAST = 0.02  # seconds of a step: shorter ones leave more turns to the window than it has use for
MOST = 0.08  # seconds of work in a step: longer ones are felt as a pause


class Pace:
    """Tells after each piece of work whether a step had enough of them. One for reading, one for
    writing: the pieces of one are not like those of the other."""

    def __init__(self) -> None:
        self._ended = time.perf_counter()
        self._longest = 0.0  # seconds of work in the longest piece: not of waiting for a processor
        self.begin()

    def begin(self) -> None:
        """A step begins."""
        start, self._before = time.perf_counter(), time.thread_time()
        self._until = start + max(LEAST, start - self._ended)
        self._left = MOST - self._longest

    def enough(self) -> bool:
        """A piece is done: whether it was the step's last, as another long one might be too much."""
        now = time.thread_time()
        worked, self._before = now - self._before, now
        self._longest, self._left = max(self._longest, worked), self._left - worked
        self._ended = time.perf_counter()
        return self._left <= 0 or self._ended >= self._until
