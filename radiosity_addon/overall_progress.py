"""One fraction for the whole of a solve, from phases that come again.

The solver reports the fraction of a phase that is done, and repeats phases until the error is met: nobody
knows beforehand how often. So each run of a phase takes a share of what is left, and the whole grows
toward 1 without ever going back.
"""

from __future__ import annotations

from typing import Callable

# What one run of a phase takes of the time that is left, as measured on rooms of 30 to 64,000
# triangles: gathering is most of it.
SHARES = {"receivers": 0.1, "elements": 0.02, "transport": 0.02, "Write": 0.9, "tiles": 0.98}
OTHER = 0.3  # share [of the time left] of phases that are not among these


class OverallProgress:
    """A progress callback that passes the fraction of the whole on to another one."""

    def __init__(self, progress: Callable[[str, float], None]) -> None:
        self._progress = progress
        self._phase, self._fraction = "", 0.0
        self._start, self._share = 0.0, 0.0  # of the phase that runs

    def __call__(self, phase: str, fraction: float) -> None:
        if phase != self._phase or fraction < self._fraction:
            self._start += self._share
            self._share = SHARES.get(phase, OTHER) * (1 - self._start)
            self._phase = phase
        self._fraction = min(max(fraction, 0.0), 1.0)
        self._progress(phase, self._start + self._share * self._fraction)
