"""Islands: the pieces of surface that a UV map keeps whole, and their borders. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..components import connected_components
from ..solver.array_struct import ArrayStruct
from ..solver.geometry.planar import doubled_areas

SAME = 1e-3  # distance [texels]: UVs closer than that are one point
FLAT = 1e-9  # area [texels²]: a triangle with less UV area shows nothing


@dataclass(frozen=True)
class Charted:
    """Triangles on the surface and in images. Texel (row, column) of image ``sheet`` is the unit
    square from (column, row)."""

    vertices: np.ndarray  # (v, 3) float64 [scene's length]
    triangles: np.ndarray  # (n, 3) int
    uv: np.ndarray  # (n, 3, 2) float64 [texels]
    sheet: np.ndarray  # (n,) int
    normals: np.ndarray  # (n, 3, 3) unit normals by which the corners are shaded

    @property
    def shows(self) -> np.ndarray:
        """(n,) bool: the triangle has an area in its image."""
        with np.errstate(invalid="ignore"):
            return np.abs(doubled_areas(self.uv)) / 2 > FLAT


@dataclass(frozen=True)
class Edges(ArrayStruct):
    """Sides of triangles: from corner ``side`` to the next one."""

    triangle: np.ndarray  # (m,) int
    side: np.ndarray  # (m,) int 0, 1, 2

    def ends(self, of_corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (m, ...) at both ends, of values ``of_corners`` (n, 3, ...) at triangles'
        corners."""
        return of_corners[self.triangle, self.side], of_corners[self.triangle, (self.side + 1) % 3]


def cut_into_islands(charted: Charted) -> tuple[np.ndarray, Edges]:
    """(n,) int island of each triangle, and the edges along which islands end.

    Two triangles are of one island when they share an edge, wound alike, with the same UVs: one in
    space, whether they share its vertices or, as in meshes from games, have some of their own there.
    """
    n = len(charted.triangles)
    edges = Edges(np.tile(np.arange(n), 3), np.repeat(np.arange(3), n))
    edges = edges.take(charted.shows[edges.triangle])
    pairs = []
    for number in (_vertices, _positions):
        one, other = _shared(charted, edges, *number(charted, edges))
        pairs.append((edges.triangle[one], edges.triangle[other]))
        left = np.ones(len(edges.triangle), bool)
        left[one] = left[other] = False
        edges = edges.take(left)
    return connected_components(n, *(np.concatenate(side) for side in zip(*pairs))), edges


def _vertices(charted: Charted, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """(m,) numbers of both ends."""
    return edges.ends(charted.triangles)


def _positions(charted: Charted, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """(m,) numbers of both ends: the same for vertices at the same position."""
    ends = np.stack(edges.ends(charted.triangles))
    used, at = np.unique(ends, return_inverse=True)
    position = np.unique(charted.vertices[used], axis=0, return_inverse=True)[1].reshape(-1)
    return tuple(position[at.reshape(ends.shape)])


def _shared(
    charted: Charted, edges: Edges, start: np.ndarray, end: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Edges (k,) and (k,) between the same numbers ``start`` and ``end`` (m,), and one in the image."""
    key = np.minimum(start, end).astype(np.int64) * (len(charted.vertices) + 1)
    key += np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    double = first[np.diff(first, append=len(key)) == 2]
    one, other = order[double], order[double + 1]
    uv_start, uv_end = edges.ends(charted.uv)
    sheet = charted.sheet[edges.triangle]
    same = (start[one] == end[other]) & (sheet[one] == sheet[other])
    for a, b in ((uv_start[one], uv_end[other]), (uv_end[one], uv_start[other])):
        same &= (np.abs(a - b) < SAME).all(1)
    return one[same], other[same]
