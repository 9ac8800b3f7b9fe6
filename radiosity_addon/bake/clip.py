"""Clipping unit squares by triangles, many at once. Depends on NumPy only.

A batch of convex polygons is a pair ``points (m, k, 2) float64, count (m,)``: of row i the first
``count[i]`` points are its vertices in order, the rest is padding.
"""

from __future__ import annotations

import numpy as np


def clip_squares(corner: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of each unit square that lies in its triangle.

    ``corner`` (m, 2) lower left of the squares; ``triangles`` (m, 3, 2) in the same coordinates,
    turning either way. Returns polygons relative to ``corner``, at most 7 vertices each
    (Sutherland & Hodgman 1974), count 0 where nothing is left.
    """
    m = len(corner)
    points = np.broadcast_to([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], (m, 4, 2))
    count = np.full(m, 4)
    local = triangles - corner[:, None]
    turn = np.sign(doubled_areas(local))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = local[:, b] - local[:, a]
        normal = np.stack([-edge[:, 1], edge[:, 0]], 1) * turn[:, None]
        points, count = clip(points, count, local[:, a], normal)
    return points, count


def clip(points, count, origin, normal) -> tuple[np.ndarray, np.ndarray]:
    """Keep of each polygon what has ``(p - origin)·normal >= 0``; one vertex more at most."""
    m, k, _ = points.shape
    height = np.einsum("mkd,md->mk", points - origin[:, None], normal)
    valid = np.arange(k) < count[:, None]
    inside = valid & (height >= 0)
    cut = np.nonzero(inside.any(1) & (inside != valid).any(1))[0]
    out = np.zeros((m, k + 1, 2))
    out[:, :k] = points
    left = np.where(inside.any(1), count, 0)
    out[cut], left[cut] = _cut(points[cut], count[cut], height[cut], inside[cut])
    return out, left


def _cut(points, count, height, inside) -> tuple[np.ndarray, np.ndarray]:
    """Polygons with vertices on both sides: each crossing of an edge becomes a vertex."""
    m, k, _ = points.shape
    rows, slots = np.arange(m)[:, None], np.arange(k)
    following = np.where(slots + 1 < count[:, None], slots + 1, 0)
    next_height = height[rows, following]
    crosses = (slots < count[:, None]) & (inside != inside[rows, following])
    share = height / np.where(crosses, height - next_height, 1.0)
    crossing = points + share[..., None] * (points[rows, following] - points)
    both = np.stack([points, crossing], 2).reshape(m, 2 * k, 2)
    return _compact(both, np.stack([inside, crosses], 2).reshape(m, 2 * k), k + 1)


def _compact(points, keep, width) -> tuple[np.ndarray, np.ndarray]:
    """Move the kept points of each row to its front, at most ``width`` of them."""
    slot = np.cumsum(keep, 1) - 1
    keep = keep & (slot < width)
    row = np.nonzero(keep)[0]
    out = np.zeros((len(points), width, 2))
    out[row, slot[keep]] = points[keep]
    return out, keep.sum(1)


def fan(points, count) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut polygons into cells: ``(owner (c,), corners (c, 3, 2), square (c,) bool)``.

    A parallelogram is one square cell; any other polygon becomes triangles around its vertex 0.
    """
    square = count == 4
    four = points[square]
    gap = np.abs(four[:, 0] + four[:, 2] - four[:, 1] - four[:, 3]).max(1, initial=0.0)
    square[square] = gap < 1e-9
    owners, corners = [np.nonzero(square)[0]], [points[square][:, (0, 1, 3)]]
    for k in range(1, points.shape[1] - 1):
        has = np.nonzero(~square & (count > k + 1))[0]
        owners.append(has)
        corners.append(points[has][:, (0, k, k + 1)])
    owner = np.concatenate(owners)
    return owner, np.concatenate(corners), np.arange(len(owner)) < len(owners[0])


def doubled_areas(triangles: np.ndarray) -> np.ndarray:
    """Twice the signed area of ``triangles`` (..., 3, 2): that of the parallelogram they span."""
    u, v = triangles[..., 1, :] - triangles[..., 0, :], triangles[..., 2, :] - triangles[..., 0, :]
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
