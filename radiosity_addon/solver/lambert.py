"""Lambert's formula: irradiance from a polygon of constant radiance, without obstacles, exactly.

Depends on NumPy only. Lambert 1760, Photometria; in this vector form Baum, Rushmeier & Winget
1989, eq. 8: F = 1/2π Σ Γ_k · n, with Γ_k along r_k × r_{k+1} and the angle between them.
"""

from __future__ import annotations

import numpy as np


def polygon_form_factor(
    position: np.ndarray, normal: np.ndarray, polygon: np.ndarray
) -> np.ndarray:
    """(n,) float64: form factor from points (n, 3) with unit normals (n, 3) to a convex polygon.

    ``polygon`` (k, 3) in order. The part below the horizon of a point is clipped away. Irradiance
    is π times this times the radiance. The polygon counts from both of its sides.
    """
    n, k = len(position), len(polygon)
    ray = polygon.T[None] - position[:, :, None]  # (n, 3, k): components first, long last axes
    x, y, z = ray[:, 0], ray[:, 1], ray[:, 2]  # (n, k)
    height = x * normal[:, :1] + y * normal[:, 1:2] + z * normal[:, 2:]
    above = height > 0
    result = np.zeros(n)
    whole = np.flatnonzero(above.all(axis=1))
    if len(whole):
        total = np.zeros(len(whole))
        for a in range(k):
            total += _edge(ray[whole, :, a], ray[whole, :, (a + 1) % k], normal[whole])
        result[whole] = total
    cut = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    if len(cut):
        result[cut] = _clipped(ray[cut], height[cut], normal[cut])
    return np.abs(result) / (2 * np.pi)


def _edge(a: np.ndarray, b: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(n,) Γ·n of the edges a → b, (n, 3) each, seen from the origin."""
    cx = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    cy = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    cz = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    sine = np.sqrt(cx * cx + cy * cy + cz * cz)
    cosine = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
    along = cx * normal[:, 0] + cy * normal[:, 1] + cz * normal[:, 2]
    return np.arctan2(sine, cosine) * along / np.where(sine > 0, sine, 1)


def _clipped(ray: np.ndarray, height: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Σ Γ·n of polygons cut by the horizon: each edge's upper part, and the edge that closes it."""
    k = ray.shape[2]
    total, leaving, entering = np.zeros(len(ray)), np.zeros(ray[:, :, 0].shape), 0.0
    for i in range(k):
        j = (i + 1) % k
        a, b, ha, hb = ray[:, :, i], ray[:, :, j], height[:, i], height[:, j]
        crossing = (ha > 0) != (hb > 0)
        step = np.where(crossing, ha / np.where(crossing, ha - hb, 1), 0)[:, None]
        middle = a + step * (b - a)
        start = np.where((ha > 0)[:, None], a, middle)
        end = np.where((hb > 0)[:, None], b, middle)
        total += np.where((ha > 0) | (hb > 0), _edge(start, end, normal), 0)
        leaving = leaving + np.where((crossing & (ha > 0))[:, None], middle, 0)
        entering = entering + np.where((crossing & (hb > 0))[:, None], middle, 0)
    return total + _edge(leaving, entering, normal)
