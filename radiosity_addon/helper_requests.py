"""What helper processes are asked for, as data: the contexts of a scene, and work on a chunk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from .shared_arrays import MappedArrays, unpack_work
from .solver.direct.beams import Split, split_beams
from .solver.lights.context import Context, build_context
from .solver.progress import silent
from .solver.scene import Scene
from .solver.workers.parallel import Helpers


@dataclass
class HeldContexts:
    """What a helper works with: the contexts of a scene, and the work that was given last."""

    context: Context
    split: Split
    writer: str  # what the package is called where the work comes from
    arrays: MappedArrays = field(default_factory=MappedArrays)
    work: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class OpenContexts:
    """Make the contexts of a scene, as those who ask have them: the first request."""

    scene: Scene
    seed: int
    writer: str

    def opened(self, helpers: Helpers | None) -> HeldContexts:
        """New ones. Raises what ``build_context`` does."""
        context = build_context(self.scene, self.seed, 1, silent)
        return HeldContexts(context, split_beams(context), self.writer)


@dataclass(frozen=True)
class WorkOn:
    """Work on a chunk; ``packed`` is the work (``pack_work``), None: that of the request before."""

    packed: bytes | None
    chunk: Any

    def answer(self, held: HeldContexts) -> Any:
        """What comes of the chunk."""
        if self.packed is not None:
            held.work = None  # whose arrays may go
            held.work = unpack_work(self.packed, held.arrays, vars(held.split), held.writer)
        return held.work(self.chunk)
