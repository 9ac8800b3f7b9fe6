"""Second replicate: how it is spoken to, in this process or in another.

It is *asked*, works beside the first where it has a process of its own, and gives its *answers*
later.
"""

from __future__ import annotations

from typing import Any, Protocol

from ..receivers import Receivers
from ..scene import Scene
from .processes import OpenHelpers
from .replicate import Replicate
from .requests import Request
from .requirements import SolverSettings


class SecondReplicate(Protocol):
    """The second replicate, wherever it is."""

    @property
    def rays(self) -> int:
        """Traced so far by a process of its own; 0 where the first one counts them."""

    @property
    def embree_seconds(self) -> float:
        """The same of the seconds spent inside Embree, summed over threads."""

    def ask(self, request: Request[Any]) -> None:
        """Start what is asked for, or remember it."""

    def answers(self) -> list[Any]:
        """What came of all that was asked for since the last answers, in that order. Raises what
        one of them raised, ProcessLost if its process has ended."""


class RemoteReplicate(SecondReplicate, Protocol):
    """One in another process, which makes the replicate itself (``replicate_process``)."""

    helpers: OpenHelpers | None  # of the first replicate, in this process

    def open(
        self, scene: Scene, receivers: Receivers, settings: SolverSettings, threads: int
    ) -> None:
        """Ask for a new replicate, with so many threads; the answer is None."""


class LocalReplicate:
    """The second replicate in this process: it works when its answers are wanted."""

    rays, embree_seconds = 0, 0.0  # counted by the context that it shares with the first

    def __init__(self, replicate: Replicate) -> None:
        self._replicate = replicate
        self._asked: list[Request[Any]] = []

    def ask(self, request: Request[Any]) -> None:
        """See ``SecondReplicate``."""
        self._asked.append(request)

    def answers(self) -> list[Any]:
        """See ``SecondReplicate``."""
        asked, self._asked = self._asked, []
        return [request.answer(self._replicate) for request in asked]
