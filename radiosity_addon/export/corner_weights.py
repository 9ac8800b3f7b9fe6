"""Corner maps: colors at evaluated corners as weighted sums over the user's own loops.

Without modifiers that change faces the weights are one-hot. Otherwise
a corner has the bilinear weights of its place in the quad it came from, as Blender's own
interpolation has, or barycentric weights in the nearest triangle of a face that is no quad.
"""

from __future__ import annotations

import numpy as np

from .exported import CornerMap
from .meshes import bulk, read_loop_vertices
from .tracing import Trace

QUAD_TOLERANCE = 0.02  # of the face's size: how far bilinear weights may miss the corner's place


def one_hot(loops: np.ndarray, n_loops: int) -> CornerMap:
    """The map of a mesh without modifiers, from the loop at each triangle corner, (n, 3)."""
    return CornerMap(loops.reshape(-1, 1), np.ones((loops.size, 1)), n_loops)


def traced(loops: np.ndarray, polygon: np.ndarray, trace: Trace, mesh) -> CornerMap | None:
    """The map of triangle corners ``loops`` (n, 3) of evaluated faces ``polygon`` (n,), over the
    loops of the user's bpy ``mesh``.

    Corners without a source have no weight. None when the modifiers dropped the attributes or no
    corner has a source.
    """
    if trace.face is None or trace.place is None or trace.square is None:
        return None
    corner = loops.reshape(-1)
    face = np.repeat(trace.face[polygon], 3) - 1
    rows = np.flatnonzero((face >= 0) & (face < len(mesh.polygons)))
    if not len(rows):
        return None
    face, corner = face[rows], corner[rows]
    base, weights = barycentric(mesh, face, trace.place[corner])
    quad = bilinear(mesh, face, trace.place[corner], trace.square[corner])
    base[quad[0]], weights[quad[0]] = quad[1], quad[2]
    found = CornerMap(np.zeros((loops.size, 4), int), np.zeros((loops.size, 4)), len(mesh.loops))
    found.loops[rows], found.weights[rows] = base, weights
    return found


def _loop_places(mesh) -> np.ndarray:
    places = bulk(mesh.vertices, "co", np.float32, 3).astype(np.float64)
    return places[read_loop_vertices(mesh)]


def bilinear(mesh, face: np.ndarray, place: np.ndarray, square: np.ndarray):
    """(mask, loops (k, 4), weights (k, 4)) for corners whose place in a quad is trustworthy."""
    start = bulk(mesh.polygons, "loop_start", np.int32)[face]
    quad = bulk(mesh.polygons, "loop_total", np.int32)[face] == 4
    loops = start[:, None] + np.where(quad[:, None], np.arange(4), 0)
    s, t = np.clip(square, 0.0, 1.0).T
    weights = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)
    points = _loop_places(mesh)[loops]
    miss = np.linalg.norm(np.einsum("ni,nij->nj", weights, points) - place, axis=1)
    size = np.linalg.norm(np.ptp(points, axis=1), axis=1)
    good = quad & (np.abs(square - np.clip(square, 0, 1)).max(axis=1) < 1e-3)
    good &= miss <= QUAD_TOLERANCE * size
    return good, loops[good], weights[good]


def barycentric(mesh, face: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loops (m, 4) and weights (m, 4, last 0) in the triangle of the face nearest to the place."""
    mesh.calc_loop_triangles()
    owner = bulk(mesh.loop_triangles, "polygon_index", np.int32)
    loops = bulk(mesh.loop_triangles, "loops", np.int32, 3)
    count = np.bincount(owner, minlength=len(mesh.polygons))
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    order = np.argsort(owner, kind="stable")
    places = _loop_places(mesh)
    best = np.full(len(face), np.inf)
    chosen, weights = np.zeros((len(face), 4), np.int64), np.zeros((len(face), 4))
    for step in range(int(count[face].max(initial=0))):
        have = np.flatnonzero(count[face] > step)
        three = loops[order[first[face[have]] + step]]
        weight, distance = nearest_in_triangle(places[three], place[have])
        closer = distance < best[have]
        have = have[closer]
        best[have], chosen[have, :3] = distance[closer], three[closer]
        weights[have, :3] = weight[closer]
    return chosen, weights


def nearest_in_triangle(corners: np.ndarray, points: np.ndarray):
    """Barycentric weights (m, 3) >= 0 of the projections, cut off at the border and renormalized,
    and the distances (m,) of what they name to the points."""
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
