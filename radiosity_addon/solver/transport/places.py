"""Places: where rays met the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..tracing.embree import Hits
from .patches import Patches


@dataclass(frozen=True)
class Places:
    """Where rays met the surface, n places: entry (see ``patches``), triangle, barycentric u and v,
    whether on the front."""

    entry: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    front: np.ndarray

    def __getitem__(self, index) -> Places:
        return Places(*(getattr(self, name)[index] for name in _PLACE_ARRAYS))

    def of_surface(self) -> tuple[np.ndarray, ...]:
        """Triangles, u, v and whether on the front, (n,) each."""
        return self.triangle, self.u, self.v, self.front

    def on(self, patches: Patches) -> Places:
        """The same places with the entries of other patches."""
        entry = patches.at(self.triangle, self.u, self.v, self.front)
        return Places(entry, self.triangle, self.u, self.v, self.front)


_PLACE_ARRAYS = ("entry", "triangle", "u", "v", "front")


def places_hit(entries: np.ndarray, hits: Hits, patches: Patches) -> Places:
    """The hits with ``entries`` (n,) that met something that is somewhere."""
    met = np.flatnonzero(patches.somewhere(entries))
    return Places(entries[met], hits.triangle[met], hits.u[met], hits.v[met], hits.front[met])


def join_places(parts: list[Places]) -> Places:
    """All places of all parts."""
    arrays = (np.concatenate([getattr(part, name) for part in parts]) for name in _PLACE_ARRAYS)
    return Places(*arrays)


def no_places() -> Places:
    """None of them."""
    nothing = np.zeros(0, np.int32)
    return Places(nothing, nothing, nothing, nothing, np.zeros(0, bool))
