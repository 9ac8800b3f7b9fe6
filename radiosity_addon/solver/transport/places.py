"""Places: where rays met the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_struct import ArrayStruct
from ..geometry.triangles import Geometry
from ..sampling.points import Points, points_on
from .patches import Patches
from .rays import Met


@dataclass(frozen=True)
class Places(ArrayStruct):
    """Where rays met the surface, n places: entry (see ``patches``), triangle, barycentric u and v,
    whether on the front."""

    entry: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    front: np.ndarray

    @property
    def uv(self) -> np.ndarray:
        """(n, 2) float64 barycentric."""
        return np.stack([self.u, self.v], 1).astype(float)

    def points(self, geometry: Geometry, shift: np.ndarray) -> Points:
        """A point (1, n) of its own at each place, shifted by ``shift`` (n, 3)."""
        places = (array[None] for array in (self.triangle, self.u, self.v, self.front))
        return points_on(geometry, *places, shift)

    def on(self, patches: Patches) -> Places:
        """The same places with the entries of other patches."""
        entry = patches.at(self.triangle, self.u, self.v, self.front)
        return Places(entry, self.triangle, self.u, self.v, self.front)


def places_hit(met: Met, patches: Patches) -> Places:
    """The places of all hits that lie on a patch."""
    return places_at(met, np.flatnonzero(patches.somewhere(met.entry)))


def places_at(met: Met, some: np.ndarray) -> Places:
    """The places of the hits ``some`` (k,) int."""
    entry, hits = met.entry[some], met.hits
    return Places(entry, hits.triangle[some], hits.u[some], hits.v[some], hits.front[some])


def no_places() -> Places:
    """A struct of no places."""
    nothing = np.zeros(0, np.int32)
    return Places(nothing, nothing, nothing, nothing, np.zeros(0, bool))
