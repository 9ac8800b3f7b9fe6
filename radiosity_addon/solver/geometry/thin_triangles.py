"""Thin triangles: where two walls meet under a small angle, a ray's origin must keep its distance.

Origins are lifted off their triangle (``geometry.OFFSET``). Nearer to a
sharp edge than the lift over the tangent of its angle, that would put them behind the other wall:
a sealed attic would see the sun. So points keep away from the edges of such triangles.
"""

from __future__ import annotations

import numpy as np

LEAST_SHRINK = 1e-5  # share [of a triangle] that points leave out at its edges, at least: float32 rounds
MOST_SHRINK = 0.5  # share [of a triangle] that points leave out, at most
# Cosine [of 15°] between two triangles: those that meet more sharply keep points away.
SHARP = np.cos(np.radians(15))
# Sine [of an angle] between two triangles: below it they are the same wall twice, and no distance helps.
COINCIDENT = 1e-5


def edge_shrink(
    triangles: np.ndarray, p0: np.ndarray, e1: np.ndarray, e2: np.ndarray, lift: float
) -> np.ndarray:
    """(n,) float64: how much of each triangle, drawn together about its centroid, points leave out.

    ``triangles`` (n, 3) int; ``p0``, ``e1``, ``e2`` (n, 3) as in ``geometry``; ``lift`` in the
    same length. Only walls that share the edge's vertices are known to meet there.
    """
    shrink = np.full(len(triangles), LEAST_SHRINK)
    first, second, corner_a, corner_b = _edge_pairs(triangles)
    if len(first) == 0:
        return shrink
    toward_a, height_a = _from_edge(first, corner_a, p0, e1, e2)
    toward_b, height_b = _from_edge(second, corner_b, p0, e1, e2)
    cosine = np.einsum("ij,ij->i", toward_a, toward_b)
    sharp = np.flatnonzero((cosine > SHARP) & (height_a > 0) & (height_b > 0))
    sine = np.linalg.norm(np.cross(toward_a[sharp], toward_b[sharp]), axis=1)
    sharp, sine = sharp[sine > COINCIDENT], sine[sine > COINCIDENT]
    distance = 2 * lift / sine
    for whose, height in ((first, height_a), (second, height_b)):
        # A triangle drawn together by s about its centroid leaves s/3 of its height at each edge.
        np.maximum.at(shrink, whose[sharp], np.minimum(3 * distance / height[sharp], MOST_SHRINK))
    return shrink


def _edge_pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Triangles that share an edge, (k,) int each, and the number (0-2) of the edge in either."""
    low = np.minimum(triangles, np.roll(triangles, -1, axis=1)).astype(np.int64)
    high = np.maximum(triangles, np.roll(triangles, -1, axis=1))
    key = (low * (int(triangles.max(initial=0)) + 1) + high).ravel()
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    a, b = order[same], order[same + 1]
    return a // 3, b // 3, a % 3, b % 3


def _from_edge(
    triangle: np.ndarray, edge: np.ndarray, p0: np.ndarray, e1: np.ndarray, e2: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) unit direction in the triangle's plane away from its edge, and (k,) its height."""
    origin = p0[triangle]
    corners = np.stack([origin, origin + e1[triangle], origin + e2[triangle]], 1)
    rows = np.arange(len(triangle))
    start, end = corners[rows, edge], corners[rows, (edge + 1) % 3]
    apex = corners[rows, (edge + 2) % 3] - start
    along = end - start
    square = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", apex, along) / np.where(square > 0, square, 1)
    away = apex - share[:, None] * along
    height = np.linalg.norm(away, axis=1)
    height = np.where(square > 0, height, 0)
    return away / np.where(height > 0, height, 1)[:, None], height
