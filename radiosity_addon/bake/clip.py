"""Clipping unit squares by triangles, many at once.

Places are complex numbers x + iy. A batch of convex polygons is a pair ``points (k, m) complex128,
count (m,)``: of column i the first ``count[i]`` points are its vertices in order, the rest is
padding. NumPy's inner loops then run over polygons, not over a few vertices or two coordinates.
"""

from __future__ import annotations

import numpy as np

from ..solver.geometry.planar import doubled_areas


def clip_squares(corner: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of each unit square that lies in its triangle.

    ``corner`` (m, 2) lower left of the squares; ``triangles`` (m, 3, 2) in the same coordinates,
    turning either way. Returns polygons relative to ``corner``, at most 7 vertices each
    (Sutherland & Hodgman 1974), count 0 where nothing is left.
    """
    local = triangles - corner[:, None]
    sense = np.sign(doubled_areas(local))
    points = np.repeat(np.array([0, 1, 1 + 1j, 1j])[:, None], len(corner), axis=1)
    count = np.full(len(corner), 4)
    ends = np.ascontiguousarray(local).view(complex)[..., 0].T
    for a, b in ((0, 1), (1, 2), (2, 0)):
        points, count = clip(points, count, ends[a], 1j * (ends[b] - ends[a]) * sense)
    return points, count


def clip(points, count, origin, normal) -> tuple[np.ndarray, np.ndarray]:
    """(points, count) of what each polygon has where ``(p - origin)·normal >= 0``; one vertex more at
    most. ``origin`` and ``normal`` are complex numbers, one or (k,)."""
    away = points - origin
    height = away.real * normal.real + away.imag * normal.imag
    valid = np.arange(len(points))[:, None] < count
    inside = valid & (height >= 0)
    some = inside.any(axis=0)
    cut = np.flatnonzero(some & (inside != valid).any(axis=0))
    out = np.concatenate([points, np.zeros((1, len(count)))])
    left = np.where(some, count, 0)
    parts = (np.take(part, cut, axis=-1) for part in (points, count, height, inside))
    out[:, cut], left[cut] = _cut(*parts)
    return out, left


def _cut(points, count, height, inside) -> tuple[np.ndarray, np.ndarray]:
    """Polygons with vertices on both sides: each crossing of an edge becomes a vertex."""
    k, m = points.shape
    last = np.arange(k)[:, None] == count - 1
    following, next_height, next_inside = (
        np.where(last, part[0], np.roll(part, -1, axis=0)) for part in (points, height, inside)
    )
    crosses = (np.arange(k)[:, None] < count) & (inside != next_inside)
    share = height / np.where(crosses, height - next_height, 1.0)
    crossing = points + share * (following - points)
    both = np.stack([points, crossing], 1).reshape(2 * k, m)
    return _compact(both, np.stack([inside, crosses], 1).reshape(2 * k, m), k + 1)


def _compact(points, keep, width) -> tuple[np.ndarray, np.ndarray]:
    """Move the kept points of each column to its front, at most ``width`` of them."""
    slot = np.cumsum(keep, axis=0) - 1
    keep = keep & (slot < width)
    kept = np.flatnonzero(keep)
    m = points.shape[1]
    out = np.zeros((width, m), complex)
    out.ravel()[slot.ravel()[kept] * m + kept % m] = points.ravel()[kept]
    return out, keep.sum(axis=0)


def fan(points, count) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut polygons into cells: ``(owner (c,), corners (c, 3, 2) float64, square (c,) bool)``.

    A parallelogram is one square cell; any other polygon becomes triangles around its vertex 0.
    """
    gap = points[0] + points[2] - points[1] - points[3]
    square = (count == 4) & (np.maximum(np.abs(gap.real), np.abs(gap.imag)) < 1e-9)
    owners, vertices = [np.flatnonzero(square)], [(0, 1, 3)]
    for k in range(1, len(points) - 1):
        owners.append(np.flatnonzero(~square & (count > k + 1)))
        vertices.append((0, k, k + 1))
    corners = [
        np.stack([points[vertex, owner] for vertex in three], 1)
        for owner, three in zip(owners, vertices)
    ]
    owner = np.concatenate(owners)
    corners = np.concatenate(corners)[..., None].view(float)
    return owner, corners, np.arange(len(owner)) < len(owners[0])
