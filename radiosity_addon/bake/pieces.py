"""Pieces: corners of meshes that are one place of one surface have one color. NumPy only.

A floor of slabs, a level made of parts, or one mesh in loose pieces: where the surface goes on over
an edge that two faces have with the same ends, flat or bent as little as smooth faces, the corners
there are one unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..components import connected_components
from .continuations import Parts, face_normals_of, find_whole_seams, into_faces
from .islands import Charted, Edges

SMOOTH = np.cos(np.radians(30.0))  # flatter edges blend colors, as within a mesh
ASIDE = 0.25  # of an edge's length, or a face's height over it: where ways over it begin


@dataclass(frozen=True)
class Ways:
    """From places a little to one side of edges to places to the other [scene's length]."""

    starts: np.ndarray  # (k, 3)
    start_up: np.ndarray  # (k, 3) the faces' unit normals
    ends: np.ndarray  # (k, 3)
    end_up: np.ndarray  # (k, 3)


def joined_unknowns(
    vertices: np.ndarray, triangles: np.ndarray, unknown: np.ndarray, count: int,
    material: np.ndarray, is_free, group: np.ndarray | None = None,
) -> np.ndarray:
    """(count,) int: which of ``count`` unknowns are one, numbered from 0.

    ``unknown`` (n, 3) int are those at the corners of ``triangles`` (n, 3), -1: none. ``material``
    (n,) int: faces of different ones show different light. ``is_free(ways)`` (k,) bool: nothing
    stands on an edge. ``group`` (n, 3) int: the smooth groups of the corners, by which a surface ends
    at its sharp edges even where its vertices have one color each; None: the unknowns are.
    """
    n = len(triangles)
    charted = Charted(vertices, triangles, np.zeros((n, 3, 2)), np.zeros(n, int), np.zeros((n, 3, 3)))
    edges = _open_edges(triangles, unknown if group is None else group)
    seams = find_whole_seams(charted, edges, SMOOTH)
    sides = seams.one, seams.other
    owners = [edges.take(part.edge) for part in sides]
    same = np.flatnonzero(material[owners[0].triangle] == material[owners[1].triangle])
    sides = [part.take(same) for part in sides]
    places = [_beside(charted, edges.take(part.edge)) for part in sides]
    free = is_free(Ways(*places[0], *places[1]))
    one, other = (_at_ends(edges, part.take(free), unknown) for part in sides)
    known = (one >= 0) & (other >= 0)
    return connected_components(count, one[known], other[known])


def _open_edges(triangles: np.ndarray, group: np.ndarray) -> Edges:
    """Sides of triangles but those over which two triangles share vertices and smooth groups."""
    n = len(triangles)
    edges = Edges(np.tile(np.arange(n), 3), np.repeat(np.arange(3), n))
    ends = np.stack([*edges.ends(triangles), *edges.ends(group)], 1).astype(np.int64)
    turned = ends[:, 0] > ends[:, 1]
    ends[turned] = ends[turned][:, [1, 0, 3, 2]]
    order = np.lexsort(ends.T)
    new = (np.diff(ends[order], axis=0, prepend=-2) != 0).any(1)
    first = np.flatnonzero(new)
    size = np.diff(first, append=len(order))
    alone = np.repeat(size == 1, size)
    return edges.take(np.sort(order[alone]))


def _beside(charted: Charted, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) places beside the middles of edges, in their faces, and (k, 3) these' normals."""
    start, end = edges.ends(charted.vertices[charted.triangles])
    third = charted.vertices[charted.triangles[edges.triangle, (edges.side + 2) % 3]]
    way = into_faces(charted, edges)
    far = np.minimum(
        np.linalg.norm(end - start, axis=1), np.einsum("ij,ij->i", third - start, way)
    )
    return (start + end) / 2 + ASIDE * far[:, None] * way, face_normals_of(charted, edges.triangle)


def _at_ends(edges: Edges, part: Parts, unknown: np.ndarray) -> np.ndarray:
    """(2 k,) unknowns at the low, then at the high ends."""
    own = edges.take(part.edge)
    start, end = own.ends(unknown)
    turned = part.along[:, 0] > part.along[:, 1]
    return np.concatenate([np.where(turned, end, start), np.where(turned, start, end)])
