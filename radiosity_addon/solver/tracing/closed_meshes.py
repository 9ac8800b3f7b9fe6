"""Closed meshes: those whose triangles run along each edge as often in one direction as in the other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ..geometry.triangles import Geometry
from ..scene import Scene
from .embree import Tracer

# Directions [unit vectors] of the rays that decide what is inside: any three along which no modeled face or edge lies.
DIRECTIONS = np.array([[0.5377, 0.6139, 0.5782], [-0.7071, 0.1623, 0.6882], [0.2113, -0.8147, 0.54]])


@dataclass(frozen=True)
class ClosedMesh:
    """``triangles`` (n,) int of a scene, inside the box from ``low`` (3,) to ``high`` (3,);
    ``outward``: its fronts are outside."""

    geometry: Geometry
    triangles: np.ndarray
    low: np.ndarray
    high: np.ndarray
    outward: bool

    @cached_property
    def tracer(self) -> Tracer:
        """Of its triangles alone: of faces of several meshes on one another a ray meets one."""
        used, corner = np.unique(self.geometry.triangles[self.triangles], return_inverse=True)
        return Tracer(self.geometry.vertices[used], corner.reshape(-1, 3))

    def surrounds(self, position: np.ndarray) -> np.ndarray:
        """(k,) bool: places (k, 3) lie inside: what a ray meets first is seen from there. Two of
        three rays decide, as one may slip through an edge."""
        inside = ((position > self.low) & (position < self.high)).all(axis=1)
        some = np.flatnonzero(inside)
        if len(some) == 0:
            return inside
        start = position[some].astype(np.float32)
        votes = np.zeros(len(some), int)
        for direction in DIRECTIONS:
            along = np.ascontiguousarray(np.broadcast_to(direction, start.shape), np.float32)
            hits = self.tracer.intersect(start, along)
            votes += (hits.triangle >= 0) & (hits.front != self.outward)
        inside[some] = votes >= 2
        return inside


def closed_meshes(scene: Scene, geometry: Geometry, chosen: np.ndarray) -> list[ClosedMesh]:
    """The closed ones of triangles ``chosen`` (n_triangles,) bool, the largest first. Vertices of
    an object at one place are one; meshes are joined by edges."""
    chosen = np.flatnonzero(chosen & (geometry.area > 0))
    label, leaks = _joined(_welded(scene, geometry, chosen))
    kept = np.flatnonzero(~leaks[label])
    kept = kept[np.argsort(label[kept], kind="stable")]
    if len(kept) == 0:
        return []
    chosen, start = chosen[kept], np.flatnonzero(np.diff(label[kept], prepend=-1))
    corners = geometry.vertices[geometry.triangles[chosen]]
    low = np.minimum.reduceat(corners.min(axis=1), start)
    high = np.maximum.reduceat(corners.max(axis=1), start)
    number = np.repeat(np.arange(len(start)), np.diff(np.append(start, len(chosen))))
    a, b, c = (corners[:, k] - low[number] for k in range(3))
    volume = np.add.reduceat(np.einsum("ij,ij->i", a, np.cross(b, c)), start) / 6
    order = np.argsort(-np.abs(volume), kind="stable")
    parts = np.split(chosen, start[1:])
    return [
        ClosedMesh(geometry, np.sort(parts[k]), low[k], high[k], bool(volume[k] > 0)) for k in order
    ]


def _welded(scene: Scene, geometry: Geometry, chosen: np.ndarray) -> np.ndarray:
    """(k, 3) int64: corners of triangles (k,), numbered by object and place."""
    used, corner = np.unique(geometry.triangles[chosen], return_inverse=True)
    corner = corner.reshape(-1)
    owner = np.zeros(len(used))
    owner[corner] = np.repeat(scene.object[chosen], 3)
    key = np.column_stack([owner, geometry.vertices[used]]) + 0.0
    order = np.lexsort(key.T)
    new = np.ones(len(order), bool)
    new[1:] = (key[order[1:]] != key[order[:-1]]).any(axis=1)
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(new) - 1
    return number[corner].reshape(-1, 3)


def _joined(vertex: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k,) int: which mesh triangles with these vertices (k, 3) are of, and (m,) bool: whether it
    has an open edge."""
    n, count = len(vertex), int(vertex.max(initial=-1)) + 1
    tail, head = vertex.ravel(), np.roll(vertex, -1, axis=1).ravel()
    key = np.minimum(tail, head) * np.int64(count) + np.maximum(tail, head)
    keys, edge = np.unique(key, return_inverse=True)
    edge, owner = edge.reshape(-1), np.repeat(np.arange(n), 3)
    unpaired = np.bincount(edge, np.where(tail < head, 1, -1), len(keys)) != 0
    size = n + len(keys)
    links = coo_matrix((np.ones(3 * n, bool), (owner, n + edge)), shape=(size, size))
    _, label = connected_components(links, directed=False)
    label = label[:n]
    leaks = np.zeros(label.max(initial=-1) + 1, bool)
    leaks[label[owner[unpaired[edge]]]] = True
    return label, leaks
