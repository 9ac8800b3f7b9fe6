"""Pieces: corners of meshes that are one place of one surface have one color. NumPy only.

A floor of slabs, a level made of parts, or one mesh in loose pieces: where the surface goes on over
an edge that two faces have with the same ends, flat or bent as little as smooth faces, the corners
there are one unknown. A corner that lies between the ends of another piece's edge hangs on these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..components import connected_components
from ..solver.geometry.segments import Segments
from .continuations import Parts, face_normals_of, find_seams, into_faces
from .hanging import Hanging
from .islands import Charted, Edges

# Cosine [of 30°] between faces: flatter edges blend colors, as within a mesh.
SMOOTH = np.cos(np.radians(30.0))
# Number [corners that hang on one edge]: of more, light varies too much along it for a line.
MOST = 8
# Distance [of an edge's length, or a face's height over it] at which segments over it begin.
ASIDE = 0.25


def joined_unknowns(
    vertices: np.ndarray, triangles: np.ndarray, unknown: np.ndarray, count: int,
    material: np.ndarray, is_free, group: np.ndarray | None = None,
) -> tuple[np.ndarray, Hanging]:
    """(count,) int: which of ``count`` unknowns are one, numbered from 0; and which of these hang.

    ``unknown`` (n, 3) int are those at the corners of ``triangles`` (n, 3) of
    ``vertices`` (v, 3), -1: none. ``material``
    (n,) int: faces of different ones show different light. ``is_free(segments)`` (k,) bool: nothing
    stands on an edge. ``group`` (n, 3) int: the smooth groups of the corners, by which a surface ends
    at its sharp edges even where its vertices have one color each; None: the unknowns are.
    """
    n = len(triangles)
    charted = Charted(vertices, triangles, np.zeros((n, 3, 2)), np.zeros(n, int), np.zeros((n, 3, 3)))
    edges = _open_edges(triangles, unknown if group is None else group)
    seams = find_seams(charted, edges, SMOOTH)
    sides = seams.one, seams.other
    owners = [edges.take(part.edge) for part in sides]
    same = np.flatnonzero(material[owners[0].triangle] == material[owners[1].triangle])
    sides = [part.take(same) for part in sides]
    points = [_beside(charted, edges, part) for part in sides]
    free = is_free(Segments(*points[0], *points[1]))
    meetings = _meetings(edges, [part.take(free) for part in sides], unknown)
    number = connected_components(count, *meetings.equal())
    return number, meetings.hanging(number)


@dataclass(frozen=True)
class _Meetings:
    """Points (k,) where a part of one edge meets a part of another."""

    edge: np.ndarray  # (2, k) the edges,
    along: np.ndarray  # (2, k) where the points lie along them, 0 or 1 at their ends,
    ends: np.ndarray  # (2, k, 2) and the unknowns at their starts and ends
    point: np.ndarray  # (k,)

    def equal(self) -> np.ndarray:
        """(2, m) unknowns that are one: both edges end there."""
        unknown = np.take_along_axis(self.ends, (self.along == 1).astype(int)[..., None], 2)[..., 0]
        return unknown[:, (self._is_end().all(0)) & (unknown >= 0).all(0)]

    def hanging(self, number: np.ndarray) -> Hanging:
        """Where one of the edges ends between the other's ends, unknown i called
        ``number[i]``."""
        at_end, found = self._is_end(), []
        for one, other in ((0, 1), (1, 0)):
            k = np.flatnonzero(at_end[one] & ~at_end[other])
            k = k[_few(self.edge[other, k], self.point[k])]
            corner = self.ends[one, k, (self.along[one, k] == 1).astype(int)]
            found.append((corner, *self.ends[other, k].T, self.along[other, k]))
        corner, start, end, share = (np.concatenate(column) for column in zip(*found))
        known = np.flatnonzero((corner >= 0) & (start >= 0) & (end >= 0))
        hanging = Hanging(corner[known], start[known], end[known], share[known]).renamed(number)
        hanging = hanging.take((hanging.corner != hanging.start) & (hanging.corner != hanging.end))
        return hanging.take(np.unique(hanging.corner, return_index=True)[1])

    def _is_end(self) -> np.ndarray:
        return (self.along == 0) | (self.along == 1)


def _few(edge: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(k,) bool: no more than MOST points are on the edge."""
    pairs = np.unique(np.stack([edge, point]), axis=1)
    return np.bincount(pairs[0], minlength=int(edge.max(initial=-1)) + 1)[edge] <= MOST


def _meetings(edges: Edges, sides: list[Parts], unknown: np.ndarray) -> _Meetings:
    """At the low, then at the high points of pairs of parts."""
    edge, along, ends = [], [], []
    for part in sides:
        along.append(part.along.T.ravel())
        edge.append(np.tile(part.edge, 2))
        ends.append(np.tile(np.stack(edges.take(part.edge).ends(unknown), 1), (2, 1)))
    return _Meetings(*map(np.stack, (edge, along, ends)),
                     np.concatenate([sides[0].low, sides[0].high]))  # fmt: skip


def _open_edges(triangles: np.ndarray, group: np.ndarray) -> Edges:
    """Sides of triangles but those over which two triangles share vertices and smooth groups."""
    n = len(triangles)
    edges = Edges(np.tile(np.arange(n), 3), np.repeat(np.arange(3), n))
    ends = np.stack([*edges.ends(triangles), *edges.ends(group)], 1).astype(np.int64)
    backward = ends[:, 0] > ends[:, 1]
    ends[backward] = ends[backward][:, [1, 0, 3, 2]]
    order = np.lexsort(ends.T)
    new = (np.diff(ends[order], axis=0, prepend=-2) != 0).any(1)
    first = np.flatnonzero(new)
    size = np.diff(first, append=len(order))
    alone = np.repeat(size == 1, size)
    return edges.take(np.sort(order[alone]))


def _beside(charted: Charted, edges: Edges, part: Parts) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) points beside the middles of parts, in their faces, and (k, 3) these' normals."""
    own = edges.take(part.edge)
    start, end = own.ends(charted.vertices[charted.triangles])
    third = charted.vertices[charted.triangles[own.triangle, (own.side + 2) % 3]]
    inward, (low, high) = into_faces(charted, own), part.along.T[..., None]
    length = np.linalg.norm(end - start, axis=1) * np.abs(high - low)[:, 0]
    far = np.minimum(length, np.einsum("ij,ij->i", third - start, inward))
    middle = start + (low + high) / 2 * (end - start)
    return middle + ASIDE * far[:, None] * inward, face_normals_of(charted, own.triangle)
