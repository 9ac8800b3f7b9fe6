"""Seams: a mesh cut open along its sharp edges. NumPy only.

A mesh is ``points (v, 3)``, ``corner (n_loops,)`` the vertex of each face corner, face after face,
and ``start (n_faces,)`` the first corner of each face.
"""

from __future__ import annotations

import numpy as np

from ..components import connected_components
from ..solver.geometry.vectors import unit_rows


def cut_sharp_edges(
    points: np.ndarray, corner: np.ndarray, start: np.ndarray, angle: float
) -> tuple[np.ndarray, np.ndarray]:
    """The mesh as (points, corner) in which faces hang together only across smooth edges.

    An edge is smooth when exactly two faces use it, in opposite directions, and their normals
    differ by at most ``angle`` [rad].
    """
    count = len(corner)
    following = next_corners(count, start)
    face = np.repeat(np.arange(len(start)), np.diff(start, append=count))
    normal = face_normals(points, corner, start)
    a, b = _smooth_pairs(corner, following, normal[face], np.cos(angle))
    rows, columns = np.concatenate([a, following[a]]), np.concatenate([following[b], b])
    label = connected_components(count, rows, columns)
    _, first = np.unique(label, return_index=True)
    return points[corner[first]], label


def face_normals(points: np.ndarray, corner: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(n_faces, 3) unit normals, zero for faces without area."""
    return unit_rows(_doubled_areas(points, corner, start))


def face_areas(points: np.ndarray, corner: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(n_faces,) float64 [squared length]."""
    return np.linalg.norm(_doubled_areas(points, corner, start), axis=1) / 2


def next_corners(count: int, start: np.ndarray) -> np.ndarray:
    """(count,) int: of each of ``count`` corners the next of its face."""
    following = np.arange(1, count + 1)
    following[np.append(start[1:], count)[: len(start)] - 1] = start
    return following


def _doubled_areas(points: np.ndarray, corner: np.ndarray, start: np.ndarray) -> np.ndarray:
    """(n_faces, 3) vectors along the normals, as long as twice the area (Newell 1972)."""
    if not len(start):
        return np.zeros((0, 3))
    following = next_corners(len(corner), start)
    origin = points[corner[start]]
    size = np.diff(start, append=len(corner))
    local = points[corner] - np.repeat(origin, size, axis=0)
    return np.add.reduceat(np.cross(local, local[following]), start, axis=0)


def _smooth_pairs(corner, following, normal, cosine) -> tuple[np.ndarray, np.ndarray]:
    """Corners a, b whose edges (to the next corner) are one smooth edge seen from both sides."""
    ends = np.stack([corner, corner[following]], 1)
    key = ends.min(1) * (corner.max(initial=0) + 1) + ends.max(1)
    order = np.argsort(key, kind="stable")
    first = np.nonzero(np.diff(key[order], prepend=-1))[0]
    double = first[np.diff(first, append=len(key)) == 2]
    a, b = order[double], order[double + 1]
    smooth = (corner[a] != corner[b]) & (np.einsum("ij,ij->i", normal[a], normal[b]) >= cosine)
    return a[smooth], b[smooth]
