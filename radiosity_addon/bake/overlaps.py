"""Overlaps: faces of a UV layout that lie on one another, sorted into layers. NumPy and SciPy.

A projection folds what winds or overhangs (a spiral ramp, an ear). Faces in one layer never share
a texel with others of it, so layers taken apart can be laid out side by side.
"""

from __future__ import annotations

import numpy as np

from ..solver.receivers import Receivers
from ..steps import finish
from .clip import doubled_areas
from .texels import OVERLAP, expand, texel_steps

SHARED = 0.02  # of a texel: two faces that both cover more of a full one may be in conflict


def overlap_layers(
    uv: np.ndarray, face: np.ndarray, corners: np.ndarray, count: int, resolution: int
) -> np.ndarray:
    """(n_faces,) int: 0 for faces that may stay, 1, 2, … for those to be taken apart.

    ``uv`` (n, 3, 2) of the triangles, ``face`` (n,) which of ``count`` faces each is of,
    ``corners`` (n, 3) their vertices: among many faces in a texel those that share one are
    taken to be neighbours. ``resolution`` is that of the search for overlaps, in texels.
    """
    return finish(overlap_steps(uv, face, corners, count, resolution))


def overlap_steps(uv, face, corners, count: int, resolution: int):
    """``overlap_layers`` in steps of some hundredths of a second."""
    layer = np.zeros(count, int)
    cells = yield from texel_steps(uv, np.arange(len(uv)), resolution)
    pairs, certain = _sharing(cells, uv, face, resolution)
    if not len(pairs):
        return layer
    from scipy.sparse import csr_matrix  # which most meshes do without

    rows, columns = np.repeat(face, 3), corners.ravel()
    touches = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(count, columns.max() + 1))
    apart = np.asarray(touches[pairs[:, 0]].multiply(touches[pairs[:, 1]]).sum(1)).ravel() == 0
    pairs = pairs[apart | certain]
    involved = np.unique(pairs)
    if len(involved):
        near = touches[involved] @ touches[involved].T
        layer[involved] = _color(np.searchsorted(involved, pairs), near.tocsr())
    return layer


def _sharing(cells: Receivers, uv, face, resolution) -> tuple[np.ndarray, np.ndarray]:
    """(m, 2) unique pairs of faces, smaller first, found in one texel covered more than once;
    (m,) bool: they were alone in it, so it is they that overlap."""
    area = np.abs(doubled_areas(cells.corners)) * np.where(cells.square, 1.0, 0.5)
    area = area * np.abs(doubled_areas(uv))[cells.triangle] * resolution**2
    covered = np.bincount(cells.receiver, area, cells.count)
    chosen = (covered[cells.receiver] > OVERLAP) & (area > SHARED)
    texel, who = cells.receiver[chosen], face[cells.triangle[chosen]]
    start = np.nonzero(np.diff(texel, prepend=-1))[0]
    size = np.diff(start, append=len(texel))
    first, offset = expand(np.repeat(size, size))
    second = np.repeat(start, size)[first] + offset
    a, b = who[first], who[second]
    found = a < b
    several = np.repeat(size, size)[first][found] > 2
    rows = np.unique(np.stack([a[found], b[found], several], 1), axis=0)
    new = np.diff(rows[:, 0] * (1 + face.max()) + rows[:, 1], prepend=-1) != 0
    return rows[new, :2], rows[new, 2] == 0


def _color(pairs: np.ndarray, near) -> np.ndarray:
    """Greedy colours: no pair has one colour; faces are taken from neighbour to neighbour."""
    from scipy.sparse.csgraph import breadth_first_order

    count = near.shape[0]
    conflicts = [[] for _ in range(count)]
    for a, b in pairs.tolist():
        conflicts[a].append(b)
        conflicts[b].append(a)
    colors = np.full(count, -1)
    for seed in range(count):
        if colors[seed] < 0:
            for node in breadth_first_order(near, seed, False, False).tolist():
                taken = {colors[other] for other in conflicts[node]}
                colors[node] = next(c for c in range(count + 1) if c not in taken)
    return colors
