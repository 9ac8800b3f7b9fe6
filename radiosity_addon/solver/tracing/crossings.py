"""Crossings: triangles that another one cuts through, or stands on, and along which line.

Light on the two sides of such a line has nothing in common: a blob through the wall of a dark room
is lit outside and black inside. Two triangles meet along a line whose ends lie on edges of the one
or the other, so rays along all edges, just off their faces and a little longer, find all pairs;
each pair is then looked at in float64.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_struct import ArrayStruct
from ..geometry.triangles import OFFSET, Geometry
from ..workers.parallel import Tick, map_chunks, ranges
from .embree import Tracer

TOUCHING = 4 * OFFSET  # distance [unit box]: nearer triangles touch
LARGE = 0.02  # edge [unit box] of a triangle: along longer ones rays follow the back of the face as well
PARALLEL = 0.3  # sine [of an angle] between two triangles: flatter crossings are left out
MOST = 1 << 18  # number [pairs] that are kept, at most
LAYERS = 32  # number [triangles met along one edge], at most
CHUNK = 1 << 15  # number [triangles] whose edges are followed at a time
CORNERS = np.array([[0.0, 0], [1, 0], [0, 1]])  # places [barycentric] of a triangle's corners


@dataclass(frozen=True)
class Crossings(ArrayStruct):
    """``triangle`` (k,) int is cut along a line. ``height`` (k, 3) float64 above the other one's
    plane [unit box] at the triangle's corners, ``ends`` (k, 2, 2) barycentric of where they meet.
    ``other`` (k,) int is what cuts it, or, where not ``across`` (k,) bool, stands on its edge.
    """

    triangle: np.ndarray
    height: np.ndarray
    ends: np.ndarray
    other: np.ndarray
    across: np.ndarray

    def large(self, least: float) -> Crossings:
        """Those across triangles that are more than ``least`` [unit box] high over the other."""
        return self.take(self.across & (np.ptp(self.height, axis=1) > least))


def find_crossings(geometry: Geometry, tracer: Tracer, threads: int, tick: Tick) -> Crossings:
    """All crossings of a mesh; where there are more than MOST, those found first."""
    triangles = np.flatnonzero(geometry.area > 0)
    longest = np.sqrt(np.maximum((geometry.e1**2).sum(1), (geometry.e2**2).sum(1)))
    work = [(triangles[part], 1) for part in ranges(len(triangles), CHUNK)]
    large = triangles[longest[triangles] > LARGE]
    work += [(large[part], -1) for part in ranges(len(large), CHUNK)]
    found = map_chunks(lambda some: _met(geometry, tracer, *some), work, threads, tick)
    pairs = np.concatenate([np.zeros((0, 2), np.int64), *found])
    pairs = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)[:MOST]
    return _verified(geometry, pairs[:, 0], pairs[:, 1])


def _met(geometry: Geometry, tracer: Tracer, triangle: np.ndarray, side: int) -> np.ndarray:
    """(k, 2) int: pairs of a triangle among ``triangle`` (n,) and one that rays along its edges meet just off this
    side."""
    corners = geometry.vertices[geometry.triangles[triangle]]
    along = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(along, axis=2, keepdims=True)
    beyond = along * (TOUCHING / np.maximum(length, TOUCHING))
    normal = geometry.normal[triangle][:, None]
    inward = np.cross(normal, beyond)  # where meshes are aligned, edges meet edges
    lifted = corners + (side * TOUCHING) * normal + 2 * inward - beyond
    start = lifted.reshape(-1, 3).astype(np.float32)
    segment = (along + 2 * beyond).reshape(-1, 3).astype(np.float32)
    rays = np.flatnonzero(~tracer.clear(start, segment))
    own = triangle[rays // 3]
    start, segment = start[rays], segment[rays]
    left, step = np.ones(len(rays)), TOUCHING / np.linalg.norm(segment, axis=1).clip(TOUCHING)
    pairs = []
    for _ in range(LAYERS):
        hits = tracer.intersect(start, segment)
        met = np.flatnonzero((hits.triangle >= 0) & (hits.distance < left))
        if len(met) == 0:
            break
        pairs.append(np.stack([own[met], hits.triangle[met]], 1))
        passed = hits.distance[met] + step[met]
        start = (start[met] + passed[:, None] * segment[met]).astype(np.float32)
        own, segment, step, left = own[met], segment[met], step[met], left[met] - passed
    return np.concatenate([np.zeros((0, 2), np.int64), *pairs])


def _verified(geometry: Geometry, triangle: np.ndarray, other: np.ndarray) -> Crossings:
    """Of the pairs (n,) those whose other triangle cuts the triangle along a line, or stands on one of its edges, on
    its front."""
    normal, height = geometry.normal[triangle], _heights(geometry, triangle, other)
    axis = np.cross(normal, geometry.normal[other])
    sine = np.linalg.norm(axis, axis=1)
    across = (height.min(axis=1) < -TOUCHING) & (height.max(axis=1) > TOUCHING)
    kept = (across | _on_edge(geometry, triangle, other, height)) & (sine > PARALLEL)
    triangle, other, height, across = triangle[kept], other[kept], height[kept], across[kept]
    axis = axis[kept] / sine[kept, None]
    ends = np.empty((len(height), 2, 2))
    ends[across], ends[~across] = _line(height[across]), _nearest_edge(height[~across])
    along_axis = np.einsum("kec,kc->ke", geometry.at(triangle[:, None], ends), axis)
    back = along_axis[:, 0] > along_axis[:, 1]
    ends[back], along_axis[back] = ends[back, ::-1], along_axis[back, ::-1]
    low, high = _extent(geometry, triangle, other, axis)
    length = np.maximum(along_axis[:, 1] - along_axis[:, 0], 1e-300)
    share = (np.stack([low - TOUCHING, high + TOUCHING], 1) - along_axis[:, :1]) / length[:, None]
    share = np.clip(share, 0, 1)
    met = (share[:, 1] - share[:, 0]) * length > 4 * TOUCHING
    ends = ends[:, :1] + share[..., None] * (ends[:, 1:] - ends[:, :1])
    return Crossings(triangle[met], height[met], ends[met], other[met], across[met])


def _on_edge(
    geometry: Geometry, triangle: np.ndarray, other: np.ndarray, height: np.ndarray
) -> np.ndarray:
    """(n,) bool: the others (n,) rise over triangles (n,) from an edge of theirs, and are no
    neighbors there in a mesh that bends."""
    distance = np.sort(np.abs(height), axis=1)
    rises = _heights(geometry, other, triangle).max(axis=1) > TOUCHING
    mine, theirs = geometry.triangles[triangle], geometry.triangles[other]
    joined = (mine[:, :, None] == theirs[:, None]).any(axis=2).sum(axis=1) > 1
    return rises & ~joined & (distance[:, 1] <= TOUCHING) & (distance[:, 2] > TOUCHING)


def _nearest_edge(height: np.ndarray) -> np.ndarray:
    """(n, 2, 2) barycentric ends of the edge whose corners have the least ``height``."""
    return CORNERS[np.argsort(np.abs(height), axis=1, kind="stable")[:, :2]]


def _heights(geometry: Geometry, triangle: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n, 3) heights of the corners of triangles (n,) above the planes of others (n,)."""
    away = geometry.vertices[geometry.triangles[triangle]] - geometry.p0[other][:, None]
    return np.einsum("kic,kc->ki", away, geometry.normal[other])


def _line(height: np.ndarray) -> np.ndarray:
    """(n, 2, 2) barycentric ends of the line across triangles where their ``height`` is 0; each
    has corners above and below."""
    following = np.roll(height, -1, axis=1)
    crossed = (height > 0) != (following > 0)
    share = height / np.where(crossed, height - following, 1)
    point = CORNERS + share[..., None] * (np.roll(CORNERS, -1, axis=0) - CORNERS)
    return point[crossed].reshape(-1, 2, 2)  # two of the three edges, always


def _extent(
    geometry: Geometry, triangle: np.ndarray, other: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Along ``axis`` (n, 3), where the others (n,) lie within 2 · TOUCHING of the triangles' planes:
    (n,) from and to, from > to where they do not."""
    corners = geometry.vertices[geometry.triangles[other]]
    height, along = _heights(geometry, other, triangle), np.einsum("kic,kc->ki", corners, axis)
    mine, theirs = geometry.triangles[triangle], geometry.triangles[other]
    neighbors = (mine[:, :, None] == theirs[:, None]).any(axis=(1, 2))
    tolerance = np.where(neighbors, 0, 2 * TOUCHING)[:, None]  # they touch where they are joined
    limits = tolerance[:, None] * np.array([-1.0, 1.0])[:, None]
    rise = np.roll(height, -1, axis=1) - height
    share = (limits - height[:, None]) / np.where(rise == 0, 1, rise)[:, None]  # (n, 2, 3)
    along_axis = along[:, None] + share * (np.roll(along, -1, axis=1) - along)[:, None]
    inside = (rise[:, None] != 0) & (share >= 0) & (share <= 1)
    along_axis = np.concatenate([along_axis.reshape(-1, 6), along], axis=1)
    inside = np.concatenate([inside.reshape(-1, 6), np.abs(height) <= tolerance], axis=1)
    return np.where(inside, along_axis, np.inf).min(axis=1), np.where(inside, along_axis, -np.inf).max(axis=1)
