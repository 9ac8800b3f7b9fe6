"""Layers: values per vertex or face corner, in and out of a mesh in Object or Edit Mode. bpy.

In Edit Mode Blender keeps the mesh in a BMesh and overwrites ``Mesh`` with it on leaving, so
values go there. The order of vertices and face corners is that of ``Object.update_from_editmode``.
"""

from __future__ import annotations

import numpy as np

from ..settings import Domain
from ..solver.expected import Refused

FARTHEST = 1e18  # distance [scene's length] from the origin: what is farther is left out


def check_editable(name: str, mesh) -> None:
    """Raise Refused when ``mesh`` of object ``name`` belongs to a linked library."""
    if not mesh.is_editable or mesh.library is not None:
        raise Refused(
            f"the mesh of {name!r} is linked from another file and cannot be changed; make it "
            "local (Object > Relations > Make Local > All) or bake it in its own file"
        )


def item_count(mesh, domain: str) -> int:
    """Face corners ("corner") or vertices ("point") of the mesh as it is now, in any mode."""
    if not mesh.is_editmode:
        return len(mesh.loops if domain == Domain.CORNER else mesh.vertices)
    edited = _bmesh(mesh)
    if domain == Domain.POINT:
        return len(edited.verts)
    return sum(len(face.verts) for face in edited.faces)


def write_attribute(mesh, name: str, values: np.ndarray) -> None:
    """Set the color or FLOAT2 attribute ``name`` to ``values`` (n, 4 or 2) float32, linear.

    Raises Refused when the rows do not match the mesh: it was changed meanwhile.
    """
    attribute = mesh.attributes[name]
    if mesh.is_editmode:
        _write_bmesh(mesh, attribute, values)
        return
    if len(attribute.data) != len(values):
        raise Refused(_mismatch(mesh, len(values), len(attribute.data)))
    field = "vector" if attribute.data_type == "FLOAT2" else "color"
    attribute.data.foreach_set(field, np.ascontiguousarray(values, np.float32).ravel())
    mesh.update()


def bulk(collection, field: str, dtype, width: int = 1) -> np.ndarray:
    """``field`` of every item: (n,), or (n, ``width``) where that is more than 1."""
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(field, values)
    return values if width == 1 else values.reshape(-1, width)


def within_range(points: np.ndarray) -> np.ndarray:
    """Bool of the shape of ``points``: coordinates that are numbers: neither NaN nor infinite, which Blender stores as
    3.4e38 where it is typed. Squares of what is farther than FARTHEST are none in float32."""
    return np.abs(points) < FARTHEST


def _write_bmesh(mesh, attribute, values: np.ndarray) -> None:
    """``write_attribute`` of a mesh that is edited. Raises Refused where it cannot hold the values."""
    import bmesh

    if attribute.data_type == "BYTE_COLOR":
        raise Refused(f"mesh {mesh.name!r} is in Edit Mode; leave it to bake byte colors")
    name, data_type, domain = attribute.name, attribute.data_type, attribute.domain
    edited = _bmesh(mesh)
    corners = domain == "CORNER"
    owners = edited.loops.layers if corners else edited.verts.layers
    layer = owners.float_color[name] if data_type == "FLOAT_COLOR" else owners.uv[name]
    items = [loop for face in edited.faces for loop in face.loops] if corners else edited.verts
    if len(items) != len(values):
        raise Refused(_mismatch(mesh, len(values), len(items)))
    for item, value in zip(items, values.tolist()):
        if data_type == "FLOAT_COLOR":
            item[layer] = value
        else:
            item[layer].uv = value
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def _bmesh(mesh):
    import bmesh

    return bmesh.from_edit_mesh(mesh)


def _mismatch(mesh, given: int, has: int) -> str:
    return f"mesh {mesh.name!r} has {has} items where {given} were baked; it changed: bake again"
