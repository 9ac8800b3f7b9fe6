"""Convex: scenes in which nothing can stand between a surface and a light.

Where all of the scene and all lights lie on one side of every triangle's plane, no triangle crosses
the way from any surface to any light: an empty room with its lamps inside, a floor under the sun.
Shadow rays would tell nothing there.
"""

from __future__ import annotations

import numpy as np

from ..geometry.triangles import OFFSET, Geometry
from .flat_shapes import TRIANGLE
from .polygons import Polygons
from .sources import Sources
from .suns import Suns

MOST = 1 << 26  # number [heights of points over planes] that are worth computing
# Number [triangles, and points] looked at first: nearly all scenes show there that they are not convex.
GLANCE = 256
BLOCK = 1 << 22  # number [heights] at once


def is_unobstructed(geometry: Geometry, sources: Sources) -> bool:
    """Whether all surfaces see all lights, but for those they face away from.

    False also where that would take long to find out: shadow rays then tell.
    """
    triangles = np.flatnonzero(geometry.area > 0)
    corner, radius = _lights(sources)
    toward, sine = _suns(sources)
    glance = triangles[:: max(1, len(triangles) // GLANCE)]
    for chosen in (glance, triangles):
        corners = geometry.vertices[np.unique(geometry.triangles[chosen])]
        points = np.concatenate([corners, corner])
        margins = np.concatenate([np.zeros(len(corners)), radius])
        if len(chosen) * len(points) > MOST:
            return False
        step = max(1, BLOCK // len(points)) if len(points) else len(chosen) + 1
        for start in range(0, len(chosen), step):
            some = chosen[start : start + step]
            if not _one_sided(geometry, some, points, margins, toward, sine):
                return False
    return True


def _one_sided(
    geometry: Geometry, triangles: np.ndarray, points: np.ndarray, margins: np.ndarray,
    toward: np.ndarray, sine: np.ndarray,
) -> bool:
    """Whether each triangle's plane has all points (k, 3), spheres of radius ``margins`` (k,), and
    all suns (m, 3) on one of its sides."""
    normal = geometry.normal[triangles]
    offset = np.einsum("ti,ti->t", normal, geometry.vertices[geometry.triangles[triangles, 0]])
    height, slope = points @ normal.T - offset, toward @ normal.T
    margins, sine = margins[:, None] - OFFSET, sine[:, None]
    above = (height >= margins).all(axis=0) & (slope >= sine).all(axis=0)
    below = (height <= -margins).all(axis=0) & (slope <= -sine).all(axis=0)
    return bool((above | below).all())


def _lights(sources: Sources) -> tuple[np.ndarray, np.ndarray]:
    """Corners of flat lights and centers of round ones (k, 3), and their radii (k,)."""
    places, radii = [np.zeros((0, 3))], [np.zeros(0)]
    for batch in sources.batches:
        if isinstance(batch, Polygons):
            whole = batch.shape != TRIANGLE
            corners = [batch.origin, batch.origin + batch.u, batch.origin + batch.v,
                       (batch.origin + batch.u + batch.v)[whole]]  # fmt: skip
            places += corners
            radii += [np.zeros(len(corner)) for corner in corners]
        elif not isinstance(batch, Suns):
            places.append(batch.position)
            radii.append(batch.radius)
    return np.concatenate(places), np.concatenate(radii)


def _suns(sources: Sources) -> tuple[np.ndarray, np.ndarray]:
    """Directions (m, 3) to the middles of suns, and the sines (m,) of their angular radii."""
    suns = [batch for batch in sources.batches if isinstance(batch, Suns)]
    toward = np.concatenate([np.zeros((0, 3)), *(batch.toward for batch in suns)])
    tangent = np.concatenate([np.zeros(0), *(batch.radius for batch in suns)])
    return toward, np.sin(np.arctan(tangent))
