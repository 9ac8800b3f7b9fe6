"""Cell shading: the normals by which light on footprint cells counts, in place of the triangles'."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_struct import ArrayStruct
from ..receivers import Receivers
from ..workers.parallel import ranges
from .triangles import Geometry

BAND = 1 << 15  # number [cells] at a time: bounds the memory of their float64 arrays
SAME = 1e-6  # difference [of 1] between coordinates of unit normals: below it the normals are the same


@dataclass(frozen=True)
class CellShading(ArrayStruct):
    """Of n cells; light on those that are not ``turned`` counts by their triangle's normal."""

    normal: np.ndarray  # (n, 3) float32 unit
    level: np.ndarray  # (n,) float32: length of the mean of a cell's normals, at most 1
    smooth: np.ndarray | None  # (n, 3) float32 unit: before bump and normal maps; None: no maps
    height: np.ndarray  # (n,) float32 normalized: of the rounded surface over the cell
    turned: np.ndarray  # (n,) bool


def build_cell_shading(geometry: Geometry, receivers: Receivers) -> CellShading | None:
    """Unit normals, and the triangle's where none is given or it faces away."""
    given = receivers.shading
    if given is None:
        return None
    n = len(receivers.triangle)
    normal = np.empty((n, 3), np.float32)
    smooth = None if given.smooth is None else np.empty((n, 3), np.float32)
    level, turned = np.empty(n, np.float32), np.empty(n, bool)
    for band in ranges(n, BAND):
        true = geometry.normal[receivers.triangle[band]]
        normal[band], level[band] = _facing(given.normal[band], true)
        turned[band] = (np.abs(normal[band] - true) > SAME).any(axis=1) | (level[band] < 1 - SAME)
        if smooth is not None:
            smooth[band], _ = _facing(given.smooth[band], true)
    height = np.where(turned, given.height / geometry.scale, 0).astype(np.float32)
    return CellShading(normal, level, smooth, height, turned)


def _facing(given: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) unit vectors along ``given`` and their lengths before (n,), at most 1; ``true`` and 1
    where there are none, or they face away from it."""
    length = np.sqrt(np.einsum("ij,ij->i", given, given, dtype=float))
    away = ~(np.einsum("ij,ij->i", given, true) > 0)
    unit = given / np.where(away, 1, length)[:, None]
    return np.where(away[:, None], true, unit), np.where(away, 1, np.minimum(length, 1))
