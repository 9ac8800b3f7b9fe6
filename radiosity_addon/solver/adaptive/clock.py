"""Clock: the wall seconds that phases of a solve take."""

from __future__ import annotations

import time


class Clock:
    """Wall seconds of each phase."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self.start = self._last = time.perf_counter()

    def lap(self, phase: str) -> None:
        """Book the time since the last lap on ``phase``."""
        now = time.perf_counter()
        self.laps[phase] = self.laps.get(phase, 0.0) + now - self._last
        self._last = now

    def skip(self) -> None:
        """Drop the time since the last lap, which is counted elsewhere."""
        self._last = time.perf_counter()

    def move(self, phase: str, other: str, seconds: float) -> None:
        """Book ``seconds`` of ``phase`` on ``other`` instead."""
        self.laps[phase] -= seconds
        self.laps[other] = self.laps.get(other, 0.0) + seconds
