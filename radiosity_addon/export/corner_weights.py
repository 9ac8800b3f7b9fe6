"""Corner maps: colors at evaluated corners as weighted sums over the user's own loops.

Without modifiers that change faces the weights are one-hot. Otherwise they are those by which Blender
itself mixed the corners of the face that a corner came from (see ``mesh_trace``). Where it came from
several faces, or from one of more corners than are numbered, they are barycentric ones of its
position before the modifiers, in the nearest triangle of the face that its own face came from.
"""

from __future__ import annotations

import numpy as np

from ..bake.exported_object import CornerMap
from ..bake.layers import bulk
from .mesh_arrays import read_loop_vertices
from .mesh_trace import Trace

NEGLIGIBLE = 1e-6  # weight [of 1]: smaller ones are rounding
LEAST_SOURCED = 0.5  # weight [of 1]: a corner that has less of the user's corners has no source


def one_hot(loops: np.ndarray, n_loops: int) -> CornerMap:
    """The map of a mesh without modifiers, from ``loops`` (n, 3) int, the loop at each triangle corner."""
    return CornerMap(np.arange(loops.size + 1), loops.reshape(-1), np.ones(loops.size), n_loops)


def traced(loops: np.ndarray, polygon: np.ndarray, trace: Trace, mesh) -> CornerMap | None:
    """The map of triangle corners ``loops`` (n, 3) of evaluated faces ``polygon`` (n,), over the
    loops of the user's bpy ``mesh``.

    Corners without a source have no weight. None when the modifiers dropped the attributes or no
    corner has a source.
    """
    if trace.face is None or trace.position is None:
        return None
    corner = loops.reshape(-1)
    face = np.repeat(trace.face[polygon], 3) - 1
    face[face >= len(mesh.polygons)] = -1
    if not (face >= 0).any():
        return None
    sourced, mixed = _mixed(mesh, trace, corner)
    rest = np.flatnonzero((face >= 0) & ~sourced)
    nearest = barycentric(mesh, face[rest], trace.position[corner[rest]])
    entries = zip(mixed, (np.repeat(rest, 3), *(x.ravel() for x in nearest)))
    row, loop, weight = (np.concatenate(pair) for pair in entries)
    order = np.argsort(row, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=len(corner)))])
    return CornerMap(start, loop[order], weight[order], len(mesh.loops))


def _mixed(mesh, trace: Trace, corner: np.ndarray):
    """(m,) bool: which evaluated corners (m,) came from one face by known weights; and these as
    (rows, loops, weights) with ``rows`` counted among the m."""
    if trace.source is None or trace.shares is None:
        return np.zeros(len(corner), bool), (np.zeros(0, int), np.zeros(0, int), np.zeros(0))
    shares = trace.shares[corner].astype(np.float64)
    face, total = trace.source[corner] - 1, shares.sum(axis=1)
    sourced = (face >= 0) & (face < len(mesh.polygons)) & (total > LEAST_SOURCED)
    row, number = np.nonzero((np.abs(shares) > NEGLIGIBLE) & sourced[:, None])
    start = bulk(mesh.polygons, "loop_start", np.int32)
    return sourced, (row, start[face[row]] + number, shares[row, number] / total[row])


def _loop_positions(mesh) -> np.ndarray:
    positions = bulk(mesh.vertices, "co", np.float32, 3).astype(np.float64)
    return positions[read_loop_vertices(mesh)]


def barycentric(mesh, face: np.ndarray, position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loops (m, 3) int and weights (m, 3) of each ``position`` (m, 3), in the triangle of the ``face`` (m,)
    that is nearest to it."""
    mesh.calc_loop_triangles()
    owner = bulk(mesh.loop_triangles, "polygon_index", np.int32)
    loops = bulk(mesh.loop_triangles, "loops", np.int32, 3)
    count = np.bincount(owner, minlength=len(mesh.polygons))
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    order = np.argsort(owner, kind="stable")
    positions = _loop_positions(mesh)
    best = np.full(len(face), np.inf)
    chosen, weights = np.zeros((len(face), 3), np.int64), np.zeros((len(face), 3))
    for step in range(int(count[face].max(initial=0))):
        have = np.flatnonzero(count[face] > step)
        three = loops[order[first[face[have]] + step]]
        weight, distance = nearest_in_triangle(positions[three], position[have])
        closer = distance < best[have]
        have = have[closer]
        best[have], chosen[have] = distance[closer], three[closer]
        weights[have] = weight[closer]
    return chosen, weights


def nearest_in_triangle(corners: np.ndarray, points: np.ndarray):
    """Barycentric weights (m, 3) >= 0 of the projections of ``points`` (m, 3) on triangles ``corners``
    (m, 3, 3), cut off at the border and renormalized, and the distances (m,) of what they name to the
    points."""
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d = points - a
    ee, ff, ef, de, df = (np.einsum("ij,ij->i", p, q) for p, q in
                          ((e, e), (f, f), (e, f), (d, e), (d, f)))  # fmt: skip
    area = ee * ff - ef * ef
    safe = np.where(area > 0.0, area, 1.0)
    u, v = (de * ff - df * ef) / safe, (df * ee - de * ef) / safe
    weights = np.maximum(np.stack([1.0 - u - v, u, v], axis=1), 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    miss = np.linalg.norm(np.einsum("ni,nij->nj", weights, corners) - points, axis=1)
    return weights, np.where(area > 0.0, miss, np.inf)
