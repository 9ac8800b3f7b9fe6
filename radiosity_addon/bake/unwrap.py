"""UV maps made for objects that lack one; everything else of the user's is left alone. bpy.

The charts come from Blender's Smart UV Project on a plain copy of the mesh in a scene of its own,
so that selection, mode, active object and the user's UV maps never change.
"""

from __future__ import annotations

import math

import numpy as np

from ..export.meshes import within_reach
from ..steps import finish, scaled
from .layers import check_editable
from .overlaps import overlap_steps
from .seams import cut_sharp_edges
from .uv_maps import FALLBACK, HeldMap, find_uv_map, free_name, give_maps

ANGLE = math.radians(66)  # neighbours that differ by less may share a chart
MOST_MAPS = 8  # that Blender renders from
ATTEMPTS = 4  # at a layout without overlaps
CHECKED = 256  # texels along the edge of the image in which overlaps are looked for
LEAST_GAP, GAP_SHARE = 3, 128  # texels between charts: at least, and resolution / GAP_SHARE


def ensure_uv_map(
    objects, name: str = "Radiosity", resolution: int = 1024, margin: int = 8
) -> list[tuple[str, str]]:
    """Make the UV map on the meshes of ``objects`` that lack it.

    Returns (object name, map name) of each map made, one per mesh: objects that share a mesh share
    the map, laid out for the first one's scale. The active map and the one that renders stay.
    Charts are at least three texels apart, more at larger resolutions if the margin asks for it.
    Raises ValueError, with nothing made, for a linked mesh and for one with 8 UV maps.
    """
    names = [item.name for item in objects]
    held = finish(unwrap_steps(names, name, resolution, margin))
    give_maps(held)
    return [each.pair for each in held]


def unwrap_steps(objects, name: str, resolution: int, margin: int):
    """The maps that ``ensure_uv_map`` makes for objects of these names, held outside of the file:
    steps that return a list of HeldMap."""
    import bpy

    lacking = {}
    for each in objects:
        mesh = bpy.data.objects[each].data
        if find_uv_map(mesh, name) is None:
            lacking.setdefault(mesh.name_full, each)
    for each in lacking.values():
        _check_room(bpy.data.objects[each], name)
    gap = max(LEAST_GAP, min(2 * margin, resolution // GAP_SHARE)) / resolution
    held = []
    for index, each in enumerate(lacking.values()):
        item = bpy.data.objects.get(each)
        if item is None or item.type != "MESH":
            continue  # it was deleted between two steps
        if item.data.is_editmode:
            item.update_from_editmode()
        identity, called = item.session_uid, free_name(item.data, name)
        uv = yield from _unwrap(_shape(item), gap, index / len(lacking))
        held.append(HeldMap(identity, each, called, uv))
        yield (index + 1) / len(lacking)
    return held


def _check_room(obj, name: str) -> None:
    check_editable(obj.name, obj.data)
    if len(obj.data.uv_layers) >= MOST_MAPS:
        raise ValueError(
            f"{obj.name!r} has {MOST_MAPS} UV maps, the most that Blender renders from; remove "
            f"one, or name the one to bake to with --uv-map instead of {name!r}"
        )
    if name in obj.data.attributes and FALLBACK.format(name) in obj.data.attributes:
        raise ValueError(f"{obj.name!r} has attributes {name!r} that are no UV map; rename them")


def _unwrap(shape, gap: float, done: float):
    """(n_loops, 2) float32 UVs of a mesh's ``_shape``, charts ``gap`` apart: steps that yield
    ``done``.

    Where the projection folds over itself, the faces on top are cut loose and it is done again.
    """
    points, corner, start = shape
    if not len(start):
        return np.zeros((0, 2), np.float32)
    points, corner = cut_sharp_edges(points, corner, start, ANGLE)
    for _ in range(ATTEMPTS):
        uv, triangles, face = _lay_out(points, corner, start, gap)
        yield done
        layer = yield from scaled(done, done, overlap_steps(
            uv[triangles].astype(float), face, corner[triangles], len(start), CHECKED
        ))  # fmt: skip
        if not layer.any():
            break
        size = np.diff(start, append=len(corner))
        loose, corner = np.unique(
            corner + np.repeat(layer, size) * len(points),
            return_inverse=True,
        )
        points = points[loose % len(points)]
    return np.clip(uv, 0.0, 1.0)


def _shape(obj) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (v, 3) in world size, so that texels are alike on all sides; vertex of each loop
    (n_loops,); first loop of each face. Points out of reach move to the origin."""
    source = obj.data
    points = _get(source.vertices, "co", 3, np.float32)
    size = np.array(obj.matrix_world, float)[:3, :3]
    if np.isfinite(size).all() and abs(np.linalg.det(size)) > 0:
        points = points @ size.T
    points = np.where(within_reach(points), points, 0.0)  # else Blender never ends
    corner = _get(source.loops, "vertex_index", 1, np.int32)[:, 0].astype(np.int64)
    return points, corner, _get(source.polygons, "loop_start", 1, np.int32)[:, 0]


def _lay_out(points, corner, start, gap):
    """UVs (n_loops, 2), loops of the triangles (n, 3) and the face of each (n,)."""
    import bpy

    mesh = _plain_mesh(points, corner, start)
    copy = bpy.data.objects.new(mesh.name, mesh)
    scene = bpy.data.scenes.new(mesh.name)
    try:
        scene.collection.objects.link(copy)
        _project(scene, copy, gap)
        uv = _get(mesh.uv_layers.active.data, "uv", 2, np.float32)
        mesh.calc_loop_triangles()
        triangles = _get(mesh.loop_triangles, "loops", 3, np.int32)
        face = _get(mesh.loop_triangles, "polygon_index", 1, np.int32)[:, 0]
    finally:
        bpy.data.objects.remove(copy)
        bpy.data.meshes.remove(mesh)
        bpy.data.scenes.remove(scene)
    return np.nan_to_num(uv), triangles, face


def _plain_mesh(points, corner, start):
    """A mesh of nothing but the shape and an empty UV map."""
    import bpy

    mesh = bpy.data.meshes.new("radiosity unwrap")
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.astype(np.float32).ravel())
    mesh.loops.add(len(corner))
    mesh.loops.foreach_set("vertex_index", corner.astype(np.int32))
    mesh.polygons.add(len(start))
    mesh.polygons.foreach_set("loop_start", start)
    mesh.update(calc_edges=True)
    mesh.uv_layers.new(name="uv", do_init=False)
    return mesh


def _get(collection, field: str, width: int, kind) -> np.ndarray:
    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(field, values)
    return values.reshape(-1, width)


def _project(scene, copy, gap: float) -> None:
    import bpy

    layer = scene.view_layers[0]
    layer.objects.active = copy
    copy.select_set(True, view_layer=layer)
    with bpy.context.temp_override(
        scene=scene, view_layer=layer, object=copy, active_object=copy, edit_object=copy,
        selected_objects=[copy],
    ):
        bpy.ops.object.mode_set(mode="EDIT")
        try:
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(
                angle_limit=ANGLE, island_margin=gap / 2, margin_method="FRACTION"
            )
        finally:
            bpy.ops.object.mode_set(mode="OBJECT")
