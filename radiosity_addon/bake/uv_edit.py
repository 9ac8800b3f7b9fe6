"""UV edits: Blender's UV operators on a plain copy of a mesh in a scene of its own. bpy.

So selection, mode, active object and the user's UV maps never change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable

import numpy as np

from .layers import bulk, within_range


@dataclass(frozen=True)
class Shape:
    """What of a mesh an unwrap looks at."""

    points: np.ndarray  # (v, 3) in world size, so that texels are alike on all sides
    corner: np.ndarray  # (n_loops,) int64: vertex of each loop
    start: np.ndarray  # (n_faces,) int32: first loop of each face

    @property
    def sizes(self) -> np.ndarray:
        """(n_faces,) loops of each face."""
        return np.diff(self.start, append=len(self.corner))


def shape_of(item) -> Shape:
    """The mesh of an object; points out of reach move to the origin."""
    source = item.data
    points = bulk(source.vertices, "co", np.float32, 3)
    size = np.array(item.matrix_world, float)[:3, :3]
    if np.isfinite(size).all() and abs(np.linalg.det(size)) > 0:
        points = points @ size.T
    points = np.where(within_range(points), points, 0.0)  # else Blender never ends
    corner = bulk(source.loops, "vertex_index", np.int32).astype(np.int64)
    return Shape(points, corner, bulk(source.polygons, "loop_start", np.int32))


def edit_uvs(shape: Shape, uv: np.ndarray | None, operate: Callable[[], object]):
    """UVs (n_loops, 2), loops of the triangles (n, 3) and the face of each (n,) after ``operate``,
    which is called in Edit Mode with all selected. ``uv`` (n_loops, 2) are those before."""
    import bpy

    mesh = _plain_mesh(shape, uv)
    copy = bpy.data.objects.new(mesh.name, mesh)
    scene = bpy.data.scenes.new(mesh.name)
    try:
        scene.collection.objects.link(copy)
        _in_edit_mode(scene, copy, operate)
        uv = bulk(mesh.uv_layers.active.data, "uv", np.float32, 2)
        mesh.calc_loop_triangles()
        triangles = bulk(mesh.loop_triangles, "loops", np.int32, 3)
        face = bulk(mesh.loop_triangles, "polygon_index", np.int32)
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)
        bpy.data.scenes.remove(scene)
    return np.nan_to_num(uv, posinf=0.0, neginf=0.0), triangles, face


def _plain_mesh(shape: Shape, uv: np.ndarray | None):
    """A mesh of nothing but the shape and one UV map, empty unless given."""
    import bpy

    mesh = bpy.data.meshes.new("radiosity unwrap")
    mesh.vertices.add(len(shape.points))
    mesh.vertices.foreach_set("co", _of_usual_size(shape.points).astype(np.float32).ravel())
    mesh.loops.add(len(shape.corner))
    mesh.loops.foreach_set("vertex_index", shape.corner.astype(np.int32))
    mesh.polygons.add(len(shape.start))
    mesh.polygons.foreach_set("loop_start", shape.start.astype(np.int32))
    mesh.update(calc_edges=True)
    layer = mesh.uv_layers.new(name="uv", do_init=False)
    if uv is not None:
        layer.data.foreach_set("uv", np.ascontiguousarray(uv, np.float32).ravel())
    return mesh


def _of_usual_size(points: np.ndarray) -> np.ndarray:
    """(v, 3) times a power of two that makes their extent 1 to 2: Blender's operators give no UVs to faces of
    1e5 or of 1e-6."""
    extent = float(np.ptp(points.astype(float), axis=0).max(initial=0)) if len(points) else 0.0
    return np.ldexp(points.astype(float), -math.frexp(extent)[1] + 1) if extent > 0 else points


def _in_edit_mode(scene, copy, operate) -> None:
    """Call ``operate`` with the ``copy`` in Edit Mode, all of it selected; the user's context stays as
    it is."""
    import bpy

    layer = scene.view_layers[0]
    layer.objects.active = copy
    copy.select_set(True, view_layer=layer)
    scene.tool_settings.use_uv_select_sync = True  # what is selected in the mesh is in its UVs
    with bpy.context.temp_override(
        scene=scene, view_layer=layer, object=copy, active_object=copy, edit_object=copy,
        selected_objects=[copy], selected_editable_objects=[copy], objects_in_mode=[copy],
        objects_in_mode_unique_data=[copy],
    ):
        bpy.ops.object.mode_set(mode="EDIT")
        try:
            bpy.ops.mesh.select_all(action="SELECT")
            operate()
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
