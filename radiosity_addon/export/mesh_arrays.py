"""Mesh arrays: evaluated geometry as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.layers import bulk, within_range


@dataclass(frozen=True)
class MeshArrays:
    """One evaluated mesh in its own space.

    ``loops`` are the mesh's face corners; ``active_uv`` and ``active_color`` the names that
    shaders use by default, "" when there are none.
    """

    vertices: np.ndarray  # (n_vertices, 3) float64
    triangles: np.ndarray  # (n, 3) int32, into vertices
    triangle_loops: np.ndarray  # (n, 3) int32
    polygon: np.ndarray  # (n,) int32
    slot: np.ndarray  # (n,) int32, material slot
    loop_vertex: np.ndarray  # (n_loops,) int32
    uvs: dict[str, np.ndarray]  # name -> (n_loops, 2) float32
    colors: dict[str, np.ndarray]  # name -> (n_loops, 4) float32, linear
    active_uv: str = ""
    active_color: str = ""
    normals: np.ndarray | None = None  # (n_loops, 3) float32; None: all faces are flat


def read_mesh(mesh) -> MeshArrays:
    """Copy an evaluated bpy mesh out of Blender."""
    mesh.calc_loop_triangles()
    polygon = bulk(mesh.loop_triangle_polygons, "value", np.int32)
    loops, vertex = bulk(mesh.loop_triangles, "loops", np.int32, 3), read_loop_vertices(mesh)
    slots = bulk(mesh.polygons, "material_index", np.int32)
    active = next((layer.name for layer in mesh.uv_layers if layer.active_render), "")
    return MeshArrays(
        vertices=bulk(mesh.vertices, "co", np.float32, 3).astype(np.float64),
        triangles=vertex[loops],
        triangle_loops=loops,
        polygon=polygon,
        slot=slots[polygon],
        loop_vertex=vertex,
        uvs={layer.name: read_uv(layer) for layer in mesh.uv_layers},
        colors=_read_colors(mesh, vertex),
        active_uv=active,
        active_color=_default_color(mesh),
        normals=_read_normals(mesh),
    )


def read_loop_vertices(mesh) -> np.ndarray:
    """(n_loops,) int32: the vertex of each; from the attribute, which is forty times as fast as
    ``mesh.loops``, but empty where a mesh is edited."""
    found = mesh.attributes.get(".corner_vert")
    if found is not None and len(found.data) == len(mesh.loops):
        return bulk(found.data, "value", np.int32)
    return bulk(mesh.loops, "vertex_index", np.int32)


def _read_normals(mesh) -> np.ndarray | None:
    """How each loop is shaded, (n_loops, 3) float32; None where that is how the faces lie."""
    if mesh.normals_domain == "FACE":
        return None
    return bulk(mesh.corner_normals, "vector", np.float32, 3)


def read_uv(layer) -> np.ndarray:
    """UV of each loop, (n_loops, 2) float32."""
    return bulk(layer.uv, "vector", np.float32, 2)


def _default_color(mesh) -> str:
    index = mesh.color_attributes.render_color_index
    return mesh.color_attributes[index].name if 0 <= index < len(mesh.color_attributes) else ""


def _read_colors(mesh, vertex: np.ndarray) -> dict[str, np.ndarray]:
    """Color attributes per loop, given each loop's vertex; Blender hands byte colors out as
    linear floats."""
    result = {}
    for attribute in mesh.color_attributes:
        values = bulk(attribute.data, "color", np.float32, 4)
        if attribute.domain == "POINT":
            values = values[vertex]
        result[attribute.name] = values
    return result


def sound_triangles(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, int, int]:
    """(n,) bool: ``triangles`` (n, 3) of ``vertices`` (v, 3) that are finite and have area; and the numbers of
    triangles that are not finite and of those without area.

    A triangle has no area when twice its area is below 1e-12 of its longest edge squared: at
    float32 coordinates that is three points on one line.
    """
    corners = vertices[triangles]
    finite = within_range(corners).all(axis=(1, 2))
    safe = np.where(finite[:, None, None], corners, 0.0)
    edges = safe[:, [1, 2, 0]] - safe
    longest = np.max(np.einsum("nij,nij->ni", edges, edges), axis=1, initial=0.0)
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    thick = area > 1e-12 * longest
    return finite & thick, int(np.sum(~finite)), int(np.sum(finite & ~thick))
