"""Processes beside this one: what they are told first, and how they are missed."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ..direct.beams import Split
from ..workers.parallel import Helpers


class OpenHelpers(Helpers, Protocol):
    """Helpers that are told of the scene first."""

    def open(self, split: Split, count: int) -> None:
        """Let at most ``count`` of them help in the scene of ``split``, as memory allows; returns at once."""

    @property
    def peak_memory(self) -> int:
        """The sum of their largest resident sizes [bytes]."""

    def leave(self) -> None:
        """Help with nothing until the next scene is opened."""


@runtime_checkable
class Opening(Protocol):
    """The first request to another process. Can be pickled; it is answered by None."""

    def opened(self, helpers: OpenHelpers | None) -> object:
        """What the process holds from now on, and has other requests answer for. It has a ``context``."""
