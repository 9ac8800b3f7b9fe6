"""Progress of long work, and the way to stop it."""

from __future__ import annotations

from typing import Callable

# Called with the phase's name and the fraction of it that is done, in [0, 1]. To stop the work it may raise any
# exception, which passes through; nothing has been written then.
Progress = Callable[[str, float], None]


def silent(phase: str, fraction: float) -> None:
    """The progress callback of callers that do not watch."""
