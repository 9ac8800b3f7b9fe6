"""Processes beside this one: the first request that opens a scene there, and the error where one has ended."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from ..direct.beams import Split
from ..workers.parallel import Helpers


class OpenHelpers(Helpers, Protocol):
    """Helpers for which a scene is opened first."""

    def open(self, split: Split, count: int) -> None:
        """Open the scene of ``split`` in at most ``count`` of them, as memory allows; returns at once."""

    @property
    def peak_memory(self) -> int:
        """The sum of their largest resident sizes [bytes]."""

    def leave(self) -> None:
        """Close the scene: they do no work until the next one is opened."""


@runtime_checkable
class Opening(Protocol):
    """The first request to another process. Can be pickled; it is answered by None."""

    def opened(self, helpers: OpenHelpers | None) -> object:
        """What the process holds from now on, and has other requests answer for. It has a ``context``."""
