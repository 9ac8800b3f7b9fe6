"""Lambert's formula: irradiance from a polygon of constant radiance, without obstacles, exactly.

Lambert 1760, Photometria; in this vector form Baum, Rushmeier & Winget
1989, eq. 8: F = 1/2π Σ Γ_k · n, with Γ_k along r_k × r_{k+1} and the angle between them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .vectors import columns, cross, dot


def polygon_form_factor(
    position: np.ndarray, normal: np.ndarray, polygon: Sequence[np.ndarray]
) -> np.ndarray:
    """(n,) float64: form factor from points (n, 3) with unit normals (n, 3) to a convex polygon.

    ``polygon``: k corners in order, (3,) each, or (n, 3) where every point has its own. The part
    below the horizon of a point is clipped away. Irradiance is π times this times the radiance. The
    polygon counts from both of its sides.
    """
    position, normal = columns(position), columns(normal)
    corners = [np.asarray(corner).T for corner in polygon]
    rays = [(corner if corner.ndim > 1 else corner[:, None]) - position for corner in corners]
    heights = [dot(ray, normal) for ray in rays]
    lowest, highest = np.minimum.reduce(heights), np.maximum.reduce(heights)
    if lowest.min(initial=1) > 0:
        result = _edge_sum(rays, normal)
    else:
        result = np.zeros(len(lowest))
        above = np.flatnonzero(lowest > 0)
        result[above] = _edge_sum(*_take(above, rays, normal))
        cut = np.flatnonzero((lowest <= 0) & (highest > 0))
        rays, normal = _take(cut, rays, normal)
        result[cut] = _clipped(rays, [height[cut] for height in heights], normal)
    return np.abs(result) / (2 * np.pi)


def _take(some: np.ndarray, rays: list, normal: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
    """Of some points."""
    return [np.take(ray, some, axis=1) for ray in rays], np.take(normal, some, axis=1)


def _edge_sum(rays: list, normal: np.ndarray) -> np.ndarray:
    """(n,) Σ Γ·n of whole polygons: k arrays (3, n) from the point to the corners."""
    total = np.zeros(normal.shape[1])
    for a, b in zip(rays, rays[1:] + rays[:1]):
        total += _edge(a, b, normal)
    return total


def _edge(a: np.ndarray, b: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(n,) Γ·n of the edges a → b, (3, n) each, seen from the origin."""
    across = cross(a, b)
    sine = np.sqrt(dot(across, across))
    angle = np.arctan2(sine, dot(a, b))
    angle /= np.maximum(sine, 1e-300)
    angle *= dot(across, normal)
    return angle


def _clipped(rays: list, heights: list, normal: np.ndarray) -> np.ndarray:
    """Σ Γ·n of polygons cut by the horizon: each edge's upper part, and the edge that closes it."""
    total = np.zeros(normal.shape[1])
    leaving, entering = np.zeros(normal.shape), np.zeros(normal.shape)
    for a, b, ha, hb in zip(rays, rays[1:] + rays[:1], heights, heights[1:] + heights[:1]):
        crossing = (ha > 0) != (hb > 0)
        middle = a + np.where(crossing, ha / np.where(crossing, ha - hb, 1), 0) * (b - a)
        start, end = np.where(ha > 0, a, middle), np.where(hb > 0, b, middle)
        total += _edge(start, end, normal)  # of none where both are below
        leaving += np.where(crossing & (ha > 0), middle, 0)
        entering += np.where(crossing & (hb > 0), middle, 0)
    return total + _edge(leaving, entering, normal)
