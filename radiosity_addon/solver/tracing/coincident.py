"""Coincident lights: emissive faces that lie on one another shine once, not twice.

A wall modeled twice, or a lamp with a reversed copy behind it, is one surface to any ray: the
first one met. Sampled explicitly each would add its light. Of exact copies the first one stays; of
faces that overlap otherwise each keeps what no earlier one covers. Where very many do, none is
sampled, so that rays decide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..geometry.planar import clip, doubled_areas, fan
from ..geometry.triangles import OFFSET, Geometry
from ..materials.emissive_parts import EmissiveParts
from .embree import Tracer

MANY = 1024  # number [overlapping faces] that are cut, at most: where there are more, rays have to find their light
MOST_PAIRS = 1 << 24  # number [pairs of faces] that are compared, at most
SLIVER = 1e-9  # area [of a triangle]: a smaller remainder is left out
COPIES = 4  # number [copies of one triangle] that are traced: of more, only the first
# Odd numbers that scatter the bits of coordinates: the golden ratio's and two primes (xxHash).
FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
# Places [barycentric] at which a face is looked at, (10, 2).
PROBES = np.array([[i + 0.5, j + 0.5] for i in range(4) for j in range(4 - i)]) / 4.5


def uncovered(geometry: Geometry, tracer: Tracer, cells: EmissiveParts) -> tuple[EmissiveParts, np.ndarray]:
    """The parts of ``cells`` that no earlier face covers; and (n_triangles,) bool: faces that are
    left to rays instead."""
    chosen = np.zeros(len(geometry.area), bool)
    chosen[cells.triangle] = True
    copies = exact_copies(geometry, chosen)
    shared = np.flatnonzero(overlapping(geometry, tracer, chosen & ~copies))
    if len(shared) <= MANY:
        shared = _with_flush(geometry, shared, np.flatnonzero(chosen & ~copies))
    if len(shared) > MANY:
        return cells.take(~copies[cells.triangle]), overlapping(geometry, tracer, chosen)
    alone = ~copies
    alone[shared] = False
    parts = [cells.take(alone[cells.triangle])]
    for i, triangle in enumerate(shared):
        covers = _covers(geometry, triangle, shared[:i])
        parts.append(_cut_away(cells.take(cells.triangle == triangle), covers))
    return EmissiveParts.join(parts), np.zeros(len(chosen), bool)


def _with_flush(geometry: Geometry, shared: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(k,) int: ``shared`` and those ``others`` (n,) in the plane of one of them whose boxes meet:
    probes miss what overlaps by a corner only."""
    if len(shared) * len(others) > MOST_PAIRS:
        return shared
    corners = geometry.vertices[geometry.triangles[others]]
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = np.isin(others, shared)
    for triangle in shared:
        own = geometry.vertices[geometry.triangles[triangle]]
        meets = ((low <= own.max(axis=0)) & (high >= own.min(axis=0))).all(axis=1)
        near = np.flatnonzero(meets)
        height = (corners[near] - own[0]) @ geometry.normal[triangle]
        found[near[np.abs(height).max(axis=1) <= 4 * OFFSET]] = True
    return others[found]


def _covers(geometry: Geometry, triangle: int, others: np.ndarray) -> np.ndarray:
    """(k, 3, 2) those of ``others`` in the plane of ``triangle``, in its barycentric coordinates,
    turning counter-clockwise there."""
    normal, p0 = geometry.normal[triangle], geometry.p0[triangle]
    away = geometry.vertices[geometry.triangles[others]] - p0
    flat = np.abs(away @ normal).max(axis=1, initial=0) <= 4 * OFFSET
    edges = np.stack([geometry.e1[triangle], geometry.e2[triangle]])
    corners = away[flat] @ edges.T @ np.linalg.inv(edges @ edges.T)
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    clockwise = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    corners[clockwise] = corners[clockwise, ::-1]
    return corners


def _cut_away(cells: EmissiveParts, covers: np.ndarray) -> EmissiveParts:
    """What triangles ``covers`` (k, 3, 2) leave of one triangle's cells."""
    owner, corners = [], []
    for i, cell in enumerate(cells.corners):
        left = [cell]
        for cover in covers:
            left = [piece for polygon in left for piece in _difference(polygon, cover)]
        parts = [fan(polygon) for polygon in left]
        owner += [i] * sum(map(len, parts))
        corners += parts
    kept = cells.take(np.array(owner, int))
    corners = np.concatenate([np.zeros((0, 3, 2)), *corners])
    return replace(kept, corners=corners, share=np.abs(doubled_areas(corners)))


def _difference(polygon: np.ndarray, cover: np.ndarray) -> list[np.ndarray]:
    """The parts of a convex ``polygon`` (k, 2) outside a counter-clockwise triangle (3, 2)."""
    outside, inside = [], polygon
    for start, end in zip(cover, np.roll(cover, -1, axis=0)):
        outside.append(_left_of(inside, end, start))
        inside = _left_of(inside, start, end)
        if _area(inside) <= SLIVER:
            return [polygon]
    return [piece for piece in outside if _area(piece) > SLIVER]


def _left_of(polygon: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The part (m, 2) of a convex polygon (k, 2) left of a line."""
    along, away = end - start, polygon - start
    return clip(polygon, along[0] * away[:, 1] - along[1] * away[:, 0])


def _area(polygon: np.ndarray) -> float:
    """Of a convex polygon (k, 2), 0 for fewer than three corners."""
    return float(np.abs(doubled_areas(fan(polygon))).sum()) / 2


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


def copied_often(geometry: Geometry, chosen: np.ndarray) -> np.ndarray:
    """(n_triangles,) bool: of those ``chosen`` all but the first of triangles that are there more
    than COPIES times. A tree cannot tell them apart, so that every ray would be tried with each."""
    bits = (geometry.vertices + 0.0).view(np.uint64)  # the same for 0 and -0
    vertex = (bits * FACTORS).sum(axis=1)
    vertex ^= vertex >> np.uint64(29)
    triangles = np.flatnonzero(chosen)
    key = (vertex * FACTORS[0])[geometry.triangles[triangles]].sum(axis=1)
    _, group, number = np.unique(key, return_inverse=True, return_counts=True)
    often = np.zeros(len(chosen), bool)
    often[triangles] = number[group.reshape(-1)] > COPIES
    return exact_copies(geometry, often)


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
    separate = np.abs(hits.distance[other] - 2 * OFFSET) > OFFSET
    same = flat & ~separate & chosen[met]
    found[met[same]] = found[own[same]] = True
    return found
