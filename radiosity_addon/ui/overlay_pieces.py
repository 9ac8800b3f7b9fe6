"""What is drawn of each object to show its bake: triangles and what they carry, as arrays. bpy.

An object without a bake, or one that is edited or painted, is a hole in the picture: Blender's own
drawing of it is seen there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.layers import bulk
from .results import attribute_of, has_result, image_of, stored_scale, uv_map_of


@dataclass(frozen=True)
class Piece:
    """The evaluated triangles of one object. Names, as nothing of Blender's may be held."""

    name: str  # of the object
    source: tuple[str, str]  # the attribute or UV map, and the image; empty ones for a hole
    points: np.ndarray  # (3 n_triangles, 3) float32 in the object's space
    baked: np.ndarray | None  # (3 n_triangles, 3) float32: light, or texture coordinates and 0


def asked(properties) -> tuple:
    """The settings on which it depends what is shown."""
    return properties.target, properties.bake_name, properties.uv_map


def pieces_of(view_layer, depsgraph, properties, earlier: dict, changed: set | None) -> dict:
    """{session id: Piece} of the view layer's meshes. Those of ``earlier`` are used again but
    where the object or its mesh is among the ``changed`` ids, or all are where that is None."""
    found = {}
    for item in view_layer.objects:
        if item.type != "MESH":
            continue
        source, piece = source_of(item, properties), earlier.get(item.session_uid)
        again = changed is None or {item.session_uid, item.data.session_uid} & changed
        if again or piece is None or (piece.name, piece.source) != (item.name, source):
            piece = _read(item, depsgraph, source, stored_scale(properties, item))
        if piece is not None:
            found[item.session_uid] = piece
    return found


def source_of(item, properties) -> tuple[str, str]:
    """The names of what carries the bake of ``item``; empty where it is drawn as a hole."""
    if item.mode != "OBJECT" or not has_result(item, properties):
        return "", ""
    if properties.target == "VERTEX":
        return attribute_of(properties, item.data), ""
    return uv_map_of(properties, item.data), image_of(properties, item).name


def _read(item, depsgraph, source: tuple[str, str], scale: float) -> Piece | None:
    """None without triangles."""
    evaluated = item.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        if mesh is None or not len(mesh.loop_triangles):
            return None
        corners = bulk(mesh.loop_triangles, "vertices", np.int32, 3).ravel()
        points = bulk(mesh.vertices, "co", np.float32, 3)[corners]
        carrier, image = source
        baked = _coordinates(mesh, carrier) if image else _colors(mesh, carrier, corners, scale)
        return Piece(item.name, source, points, baked)
    finally:
        evaluated.to_mesh_clear()


def _coordinates(mesh, name: str):
    """(n, 3) of the UV map at the triangles' corners; None where modifiers have lost it."""
    if name not in mesh.uv_layers:
        return None
    coordinates = bulk(mesh.uv_layers[name].uv, "vector", np.float32, 2)
    loops = bulk(mesh.loop_triangles, "loops", np.int32, 3).ravel()
    return np.pad(coordinates[loops], ((0, 0), (0, 1)))


def _colors(mesh, name: str, corners: np.ndarray, scale: float):
    """(n, 3) of the color attribute there; None where there is none."""
    if not name or name not in mesh.color_attributes:
        return None
    attribute = mesh.color_attributes[name]
    colors = bulk(attribute.data, "color", np.float32, 4)[:, :3] * np.float32(scale)
    if attribute.domain == "POINT":
        return colors[corners]
    return colors[bulk(mesh.loop_triangles, "loops", np.int32, 3).ravel()]
