"""Smooth groups: which loops of a mesh are one unknown.

Loops at a vertex belong together when one gets from face to face around the vertex over edges
that are flatter than SMOOTH_ANGLE, not marked sharp, shared by just two faces and wound alike.
"""

from __future__ import annotations

import numpy as np

from ..bake.layers import bulk
from ..bake.seams import face_normals, next_corners
from ..components import connected_components
from .mesh_arrays import read_loop_vertices

SMOOTH_ANGLE = np.radians(30.0)  # angle [rad] between faces: Blender's own where none is set


def smooth_groups(mesh) -> np.ndarray:
    """(n_loops,) int32 group of each loop of a bpy mesh, numbered from 0."""
    loop_vertex = read_loop_vertices(mesh)
    loop_edge = bulk(mesh.loops, "edge_index", np.int32)
    start = bulk(mesh.polygons, "loop_start", np.int32)
    count = bulk(mesh.polygons, "loop_total", np.int32)
    vertices = bulk(mesh.vertices, "co", np.float32, 3).astype(np.float64)
    vertices = np.where(np.isfinite(vertices), vertices, 0.0)
    normals = face_normals(vertices, loop_vertex, start)
    sharp = bulk(mesh.edges, "use_edge_sharp", bool) if len(mesh.edges) else np.zeros(0, bool)
    return group_loops(loop_vertex, loop_edge, start, count, normals, sharp)


def group_loops(loop_vertex, loop_edge, start, count, normals, sharp) -> np.ndarray:
    """(n_loops,) int groups from plain arrays: ``loop_vertex`` and ``loop_edge`` (n_loops,) are a loop's vertex
    and the edge to the next one, ``start`` and ``count`` (n_polygons,) the loops of each face, ``normals``
    (n_polygons, 3), ``sharp`` (n_edges,) bool."""
    n_loops = len(loop_vertex)
    polygon = np.repeat(np.arange(len(start)), count)
    follow = next_corners(n_loops, start)
    first, second = _pairs(loop_edge)
    opposite = loop_vertex[first] == loop_vertex[follow[second]]
    cosine = np.einsum("ij,ij->i", normals[polygon[first]], normals[polygon[second]])
    flat = opposite & (cosine > np.cos(SMOOTH_ANGLE)) & ~sharp[loop_edge[first]]
    first, second = first[flat], second[flat]
    rows = np.concatenate([first, follow[first]])
    columns = np.concatenate([follow[second], second])
    return connected_components(n_loops, rows, columns).astype(np.int32)


def _pairs(loop_edge: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two loops of every edge that has exactly two."""
    order = np.argsort(loop_edge, kind="stable")
    edges, first, uses = np.unique(loop_edge[order], return_index=True, return_counts=True)
    pair = first[uses == 2]
    return order[pair], order[pair + 1]
