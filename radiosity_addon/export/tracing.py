"""Tracing: which of the user's faces an evaluated face came from.

A temporary copy of an object carries three attributes through its modifiers: the face a face came
from (plus one, so that 0 means none), the place of a corner before them, and the corner's place
in the unit square when its face is a quad. The user's mesh is not touched.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .meshes import bulk, read_loop_vertices

FACE, PLACE, SQUARE = "radiosity_face", "radiosity_place", "radiosity_square"
UNIT_SQUARE = np.array(((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), np.float32)
KEEPS_FACES = {
    "ARMATURE", "CAST", "CLOTH", "CORRECTIVE_SMOOTH", "CURVE", "DATA_TRANSFER", "DISPLACE", "HOOK",
    "LAPLACIANDEFORM", "LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE", "MESH_DEFORM",
    "MESH_SEQUENCE_CACHE", "NORMAL_EDIT", "PARTICLE_SYSTEM", "SHRINKWRAP", "SIMPLE_DEFORM",
    "SMOOTH", "SOFT_BODY", "SURFACE", "SURFACE_DEFORM", "UV_PROJECT", "UV_WARP",
    "VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY", "WARP", "WAVE",
    "WEIGHTED_NORMAL", "COLLISION",
}  # fmt: skip


@dataclass(frozen=True)
class Trace:
    """What the evaluated copy says; arrays are None where the modifiers dropped an attribute."""

    face: np.ndarray | None  # (n_polygons,) int32, the source face plus one
    place: np.ndarray | None  # (n_loops, 3) float64
    square: np.ndarray | None  # (n_loops, 2) float64
    n_loops: int


def changes_faces(thing) -> bool:
    """Whether a modifier that renders may change faces."""
    return bool(face_modifiers(thing))


def face_modifiers(thing) -> tuple[str, ...]:
    """Names of the modifiers that render and may change faces."""
    changing = (m for m in thing.modifiers if m.show_render and m.type not in KEEPS_FACES)
    return tuple(modifier.name for modifier in changing)


def add_copies(scene, things) -> dict[str, str]:
    """Link an attributed copy of each object to a temporary scene; name of the copy -> object."""
    names = {}
    for thing in things:
        copy = thing.copy()
        copy.data = thing.data.copy()
        copy.hide_render = False
        _attach(copy.data)
        scene.collection.objects.link(copy)
        names[copy.name] = thing.name
    return names


def _attach(mesh) -> None:
    n_loops = len(mesh.loops)
    count = bulk(mesh.polygons, "loop_total", np.int32)
    start = bulk(mesh.polygons, "loop_start", np.int32)
    place = bulk(mesh.vertices, "co", np.float32, 3)[read_loop_vertices(mesh)]
    square = np.full((n_loops, 3), -1.0, np.float32)
    quads = start[count == 4]
    square[quads[:, None] + np.arange(4)] = UNIT_SQUARE
    face = np.arange(1, len(count) + 1, dtype=np.int32)
    for name, kind, domain, key, values in (
        (FACE, "INT", "FACE", "value", face),
        (PLACE, "FLOAT_VECTOR", "CORNER", "vector", place),
        (SQUARE, "FLOAT_VECTOR", "CORNER", "vector", square),
    ):
        attribute = mesh.attributes.new(name, kind, domain)
        attribute.data.foreach_set(key, np.ascontiguousarray(values).reshape(-1))


def read_trace(mesh) -> Trace:
    """The attributes of an evaluated copy."""

    def fetch(name, domain, key, dtype, width):
        attribute = mesh.attributes.get(name)
        if attribute is None or attribute.domain != domain:
            return None
        return bulk(attribute.data, key, dtype, width)

    place = fetch(PLACE, "CORNER", "vector", np.float32, 3)
    square = fetch(SQUARE, "CORNER", "vector", np.float32, 3)
    return Trace(
        fetch(FACE, "FACE", "value", np.int32, 1),
        None if place is None else place.astype(np.float64),
        None if square is None else square[:, :2].astype(np.float64),
        len(mesh.loops),
    )
