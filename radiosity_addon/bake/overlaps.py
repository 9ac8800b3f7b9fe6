"""Overlaps: faces of a UV layout that lie on one another, sorted into layers. NumPy only.

A projection folds what winds or overhangs (a spiral ramp, an ear). Faces in one layer never share
a texel with others of it, so layers taken apart can be laid out side by side.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator

import numpy as np

from ..solver.geometry.planar import cell_areas, doubled_areas
from ..solver.ragged import ragged_ranges
from ..solver.receivers import Receivers
from .texels import OVERLAP, texel_steps

SHARED = 0.02  # share [of a texel]: two faces that both cover more of a full one may be in conflict


def overlap_steps(
    uv: np.ndarray, face: np.ndarray, corners: np.ndarray, count: int, resolution: int
) -> Generator[float, None, np.ndarray]:
    """(n_faces,) int: 0 for faces that may stay, 1, 2, … for those to be taken apart. In steps of some hundredths
    of a second, which yield the fraction done.

    ``uv`` (n, 3, 2) of the triangles, ``face`` (n,) which of ``count`` faces each is of,
    ``corners`` (n, 3) their vertices: among many faces in a texel those that share one are
    taken to be neighbors. ``resolution`` is that of the search for overlaps, in texels.
    """
    layer = np.zeros(count, int)
    cells = yield from texel_steps(uv, np.arange(len(uv)), resolution)
    pairs, certain = _sharing(cells, uv, face, resolution)
    if not len(pairs):
        return layer
    touches = np.unique(np.stack([np.repeat(face, 3), corners.ravel()], 1), axis=0)
    pairs = pairs[~_neighbors(pairs, touches) | certain]
    involved = np.unique(pairs)
    touches = touches[np.isin(touches[:, 0], involved)]
    touches[:, 0] = np.searchsorted(involved, touches[:, 0])
    layer[involved] = _color(np.searchsorted(involved, pairs), touches, len(involved))
    return layer


def _neighbors(pairs, touches) -> np.ndarray:
    """(m,) bool: whether the faces of a pair share a vertex. ``touches`` (k, 2) are all (face,
    vertex), sorted."""
    first, stop = (np.searchsorted(touches[:, 0], pairs[:, 0], side) for side in ("left", "right"))
    owner, offset = ragged_ranges(stop - first)
    vertex = touches[first[owner] + offset, 1]
    width = 1 + touches[:, 1].max()
    wanted, known = pairs[owner, 1] * width + vertex, touches[:, 0] * width + touches[:, 1]
    there = known[np.minimum(np.searchsorted(known, wanted), len(known) - 1)] == wanted
    return np.bincount(owner, there, len(pairs)) > 0


def _sharing(cells: Receivers, uv, face, resolution) -> tuple[np.ndarray, np.ndarray]:
    """(m, 2) unique pairs of faces, smaller first, found in one texel covered more than once;
    (m,) bool: they were alone in it, so it is they that overlap."""
    area = cell_areas(cells.corners, cells.square) / 2
    area = area * np.abs(doubled_areas(uv))[cells.triangle] * resolution**2
    covered = np.bincount(cells.receiver, area, cells.count)
    chosen = (covered[cells.receiver] > OVERLAP) & (area > SHARED)
    texel, who = cells.receiver[chosen], face[cells.triangle[chosen]]
    start = np.nonzero(np.diff(texel, prepend=-1))[0]
    size = np.diff(start, append=len(texel))
    first, offset = ragged_ranges(np.repeat(size, size))
    second = np.repeat(start, size)[first] + offset
    a, b = who[first], who[second]
    found = a < b
    several = np.repeat(size, size)[first][found] > 2
    rows = np.unique(np.stack([a[found], b[found], several], 1), axis=0)
    new = np.diff(rows[:, 0] * (1 + face.max()) + rows[:, 1], prepend=-1) != 0
    return rows[new, :2], rows[new, 2] == 0


def _color(pairs: np.ndarray, touches: np.ndarray, count: int) -> np.ndarray:
    """Greedy colors: no pair has one color; faces are taken from neighbor to neighbor."""
    conflicts = [[] for _ in range(count)]
    for a, b in pairs.tolist():
        conflicts[a].append(b)
        conflicts[b].append(a)
    colors = [-1] * count
    for node in _walk(touches.tolist(), count):
        taken = {colors[other] for other in conflicts[node]}
        colors[node] = next(c for c in range(count + 1) if c not in taken)
    return np.array(colors, int)


def _walk(touches: list, count: int):
    """Faces 0 to ``count`` in turn, breadth first from each to those that share a vertex."""
    vertices_of = [[] for _ in range(count)]
    faces_at: dict[int, list[int]] = {}
    for face, vertex in touches:
        vertices_of[face].append(vertex)
        faces_at.setdefault(vertex, []).append(face)
    met = [False] * count
    for seed in range(count):
        queue = deque() if met[seed] else deque([seed])
        met[seed] = True
        while queue:
            yield (face := queue.popleft())
            around = (f for vertex in vertices_of[face] for f in faces_at.pop(vertex, ()))
            for other in around:
                if not met[other]:
                    met[other] = True
                    queue.append(other)
