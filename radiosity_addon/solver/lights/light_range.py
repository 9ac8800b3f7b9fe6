"""Light range: which lights can light anything at all. The others are not sampled.

A lamp whose beam passes the scene by, that faces away from all of it, or that is linked to nothing
in it, costs neither rays nor choices.
"""

from __future__ import annotations

import numpy as np

from ..geometry.triangles import Geometry
from ..scene import Scene
from .light_batch import LightBatch
from .light_blocks import morton_order

GROUPS = 256  # number [boxes around neighboring triangles] by which it is decided what lights may reach


def useful_lights(
    batches: tuple[LightBatch, ...], linked: tuple, scene: Scene, geometry: Geometry
) -> np.ndarray:
    """(n,) bool: lights, numbered through their ``batches``, that may light some triangle.
    ``linked`` (n,): the objects each lights, or None for all."""
    center, half = _boxes(geometry)
    able = [batch.reaches(center, half) for batch in batches]
    present = np.bincount(scene.object, minlength=len(scene.objects)) > 0
    lit = [objects is None or bool(present[objects].any()) for objects in linked]
    return np.concatenate([np.zeros(0, bool), *able]) & np.array(lit, bool)


def _boxes(geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Centers (g, 3) and half edges (g, 3) of boxes that hold all triangles."""
    corners = geometry.vertices[geometry.triangles]
    if len(corners) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    order = morton_order(corners.mean(axis=1))
    start = np.unique(np.arange(GROUPS) * len(order) // GROUPS)
    corners = corners[order]
    low = np.minimum.reduceat(corners.min(axis=1), start)
    high = np.maximum.reduceat(corners.max(axis=1), start)
    return (low + high) / 2, (high - low) / 2
