"""Coincident lights: emissive faces that lie on one another shine once, not twice.

Depends on ``geometry``, ``embree``. A wall modelled twice, or a lamp with a reversed copy behind
it, is one surface to any ray: the first one met. Sampled explicitly each would add its light. Of
exact copies the first one stays; of faces that overlap otherwise none is sampled, so that rays
decide.
"""

from __future__ import annotations

import numpy as np

from .embree import Tracer
from .geometry import OFFSET, Geometry

PROBES = np.array([[i + 0.5, j + 0.5] for i in range(4) for j in range(4 - i)]) / 4.5  # (10, 2)


def exact_copies(geometry: Geometry, chosen: np.ndarray) -> np.ndarray:
    """(n_triangles,) bool: those ``chosen`` whose corners an earlier chosen one has too."""
    triangles = np.flatnonzero(chosen)
    corners = geometry.vertices[geometry.triangles[triangles]]
    order = np.lexsort(corners.transpose(2, 0, 1), axis=-1)
    corners = np.take_along_axis(corners, order[..., None], axis=1).reshape(len(triangles), 9)
    copies = np.zeros(len(chosen), bool)
    if len(triangles):
        _, first = np.unique(corners, axis=0, return_index=True)
        copies[triangles] = True
        copies[triangles[first]] = False
    return copies


def overlapping(geometry: Geometry, tracer: Tracer, chosen: np.ndarray) -> np.ndarray:
    """(n_triangles,) bool: those ``chosen`` that share a part of their surface with another.

    Rays down to each face from just above it meet it, or the other one in its place.
    """
    triangles = np.flatnonzero(chosen)
    normal = np.repeat(geometry.normal[triangles], len(PROBES), axis=0)
    owner = np.repeat(triangles, len(PROBES))
    surface = geometry.at(owner, np.tile(PROBES, (len(triangles), 1)))
    found = np.zeros(len(chosen), bool)
    hits = tracer.intersect(
        (surface + 2 * OFFSET * normal).astype(np.float32), (-normal).astype(np.float32)
    )
    other = np.flatnonzero((hits.triangle >= 0) & (hits.triangle != owner))
    met, own = hits.triangle[other], owner[other]
    flat = np.abs(np.einsum("ij,ij->i", geometry.normal[met], geometry.normal[own])) > 1 - 1e-6
    apart = np.abs(hits.distance[other] - 2 * OFFSET) > OFFSET
    same = flat & ~apart & chosen[met]
    found[met[same]] = found[own[same]] = True
    return found
