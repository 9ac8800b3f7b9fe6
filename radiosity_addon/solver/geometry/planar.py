"""Planar: areas, middles and clips of cells and polygons in two coordinates."""

from __future__ import annotations

import numpy as np


def doubled_areas(triangles: np.ndarray) -> np.ndarray:
    """Twice the signed area of ``triangles`` (..., 3, 2): that of the parallelogram they span."""
    first = triangles[..., 0, :]
    return determinants(triangles[..., 1, :] - first, triangles[..., 2, :] - first)


def determinants(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(...) of vectors ``u`` and ``v`` (..., 2): the signed area of the parallelogram that they span."""
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def cell_areas(corners: np.ndarray, square: np.ndarray | bool) -> np.ndarray:
    """(k,) shares of their triangles that cells (k, 3, 2) are, whose corners are barycentric: twice their areas, as
    the whole triangle's is 1/2. Cells are parallelograms where ``square`` (k,) bool."""
    return np.abs(doubled_areas(corners)) * np.where(square, 2.0, 1.0)


def cell_middles(corners: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(k, 2) middles of cells (k, 3, 2), of parallelograms where ``square`` (k,) bool."""
    first, second, third = corners.transpose(1, 0, 2)
    return np.where(square[:, None], (second + third) / 2, (first + second + third) / 3)


def clip(polygon: np.ndarray, height: np.ndarray) -> np.ndarray:
    """The part (m, 2) of a convex polygon (k, 2) where a linear function of these values ``height``
    (k,) at its corners is above 0 (Sutherland and Hodgman 1974)."""
    corners = []
    for k in range(len(polygon)):
        h, g = height[k - 1], height[k]
        if (h > 0) != (g > 0):
            corners.append(polygon[k - 1] + h / (h - g) * (polygon[k] - polygon[k - 1]))
        if g > 0:
            corners.append(polygon[k])
    return np.array(corners).reshape(-1, 2)


def fan(polygon: np.ndarray) -> np.ndarray:
    """(k - 2, 3, 2) triangles around the first corner of a convex polygon (k, 2)."""
    return np.array([polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)]).reshape(-1, 3, 2)
