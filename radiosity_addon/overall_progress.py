"""One fraction for the whole of a solve, from stages that come again.

The solver reports the fraction of a stage that is done, and repeats stages until the error is met: nobody
knows beforehand how often. So each run of a stage takes a share of what is left, and the whole grows
toward 1 without ever going back.
"""

from __future__ import annotations

from typing import Callable

# What one run of a stage takes of the time that is left, as measured on rooms of 30 to 64,000
# triangles: gathering is most of it.
SHARES = {"receivers": 0.1, "elements": 0.02, "transport": 0.02, "Write": 0.9, "tiles": 0.98}
OTHER = 0.3  # share [of the time left] of stages that are not among these


class OverallProgress:
    """A progress callback that passes the fraction of the whole on to another one."""

    def __init__(self, progress: Callable[[str, float], None]) -> None:
        self._progress = progress
        self._stage, self._fraction = "", 0.0
        self._start, self._share = 0.0, 0.0  # of the stage that runs

    def __call__(self, stage: str, fraction: float) -> None:
        if stage != self._stage or fraction < self._fraction:
            self._start += self._share
            self._share = SHARES.get(stage, OTHER) * (1 - self._start)
            self._stage = stage
        self._fraction = min(max(fraction, 0.0), 1.0)
        self._progress(stage, self._start + self._share * self._fraction)
