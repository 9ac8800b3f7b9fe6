"""Progress of long work, and the way to stop it."""

from __future__ import annotations

from typing import Callable

# Called with the stage's name and the fraction of it that is done, in [0, 1]; may raise Canceled.
Progress = Callable[[str, float], None]


class Canceled(Exception):
    """Raised by a progress callback to stop the work; nothing has been written then."""


def silent(stage: str, fraction: float) -> None:
    """The progress callback of callers that do not watch."""
