"""Cell normals: how receivers' cells are shaded, from the normals of their triangles' corners and,
where maps turn them, those of the texels. NumPy only."""

from __future__ import annotations

import numpy as np

from ..solver.geometry.planar import cell_middles
from ..solver.geometry.vectors import unit_rows
from ..solver.receivers import Receivers, Shading
from ..solver.workers.parallel import ranges

BAND = 1 << 15  # number [cells] that are worked on together


def shading_of(
    receivers: Receivers, vertices: np.ndarray, triangles: np.ndarray, start: int,
    normals: np.ndarray, texel_normals: np.ndarray | None = None, fades: bool = False,
) -> Shading:
    """Shading of one object's receivers.

    ``vertices`` (v, 3), ``triangles`` (n, 3) and ``normals`` (n, 3, 3) of the object's corners, of
    which ``start`` is the first in the scene; ``texel_normals`` (height, width, 3) are means over the
    texels of its window, 0 where there is none, on which grazing light ``fades``.
    """
    count = len(receivers.triangle)
    smooth, height = np.empty((count, 3), np.float32), np.empty(count, np.float32)
    for band in ranges(count, BAND):
        own = receivers.triangle[band] - start
        weight = _middles(receivers.corners[band], receivers.square[band])
        corners = normals[own].astype(float)
        smooth[band] = mean = unit_rows(np.einsum("ki,kij->kj", weight, corners))
        height[band] = _heights(vertices[triangles[own]], corners, weight, mean)
    if texel_normals is None:
        return Shading(smooth, None, height)
    cell = receivers.grid[receivers.receiver]
    turned = texel_normals[cell[:, 1], cell[:, 2]]
    # A texel with parts of faces that turn away from each other has one normal for all.
    away = ~(np.einsum("ij,ij->i", turned, smooth) > 0)
    turned[away] = smooth[away]
    return Shading(turned, smooth if fades else None, height)


def _middles(corners: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(k, 3) weights of a triangle's corners in the middle of each cell."""
    middle = cell_middles(corners, square)
    return np.concatenate([1 - middle.sum(axis=1, keepdims=True), middle], axis=1)


def _heights(corners, normals, weight, mean) -> np.ndarray:
    """(k,) how high the rounded surface lies over points of ``weight`` (k, 3) in triangles
    (k, 3, 3), along the unit normal ``mean`` (k, 3) there: the point's projections on the planes that touch the
    corners, where these are above it (Hanika 2021, "Hacking the Shadow Terminator")."""
    point = np.einsum("ki,kij->kj", weight, corners)
    depth = np.einsum("kij,kij->ki", point[:, None] - corners, normals)
    lift = -np.einsum("ki,kij->kj", weight * np.minimum(depth, 0), normals)
    return np.maximum(np.einsum("kj,kj->k", lift, mean), 0)
