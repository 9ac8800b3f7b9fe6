"""Mesh trace: which of the user's faces, and which of their corners, an evaluated corner came from.

A temporary copy of an object carries attributes through its modifiers: the face a face came from (plus
one, so that 0 means none); and of each corner its position before them, its face, and a 1 at its number
within the face. Blender mixes these as it mixes colors of corners, so that what arrives are the
weights of the corners that a color came from. The user's mesh is not touched.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.layers import bulk
from .mesh_arrays import read_loop_vertices

FACE, POSITION = "radiosity_face", "radiosity_position"
SOURCE, SHARE = "radiosity_source", "radiosity_share_{}"
MOST_CORNERS = 64  # number [corners of a face]: those of larger ones have no attributes of their own
# Number [shares of all corners of a mesh]: of larger meshes only small faces' corners have them.
MOST_SHARES = 1 << 26
# Base [of a number]: faces are numbered in two digits, which 32-bit floats hold, and their means as well.
DIGIT = 1 << 12
# Difference [of a digit] from a whole number: up to it a digit is one face's, and no mean of several.
OFF = 0.02
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
    position: np.ndarray | None  # (n_loops, 3) float64
    source: np.ndarray | None  # (n_loops,) int32, the corner's one source face plus one; 0: not known
    shares: np.ndarray | None  # (n_loops, k) float32: weights of the source face's first corners
    n_loops: int


def changes_faces(item) -> bool:
    """Whether a modifier that renders may change faces."""
    return bool(face_modifiers(item))


def face_modifiers(item) -> tuple[str, ...]:
    """Names of the modifiers that render and may change faces."""
    changing = (m for m in item.modifiers if m.show_render and m.type not in KEEPS_FACES)
    return tuple(modifier.name for modifier in changing)


def add_copies(scene, items) -> dict[str, str]:
    """Link an attributed copy of each object to a temporary scene; name of the copy -> object."""
    names = {}
    for item in items:
        copy = item.copy()
        copy.data = item.data.copy()
        copy.hide_render = False
        _attach(copy.data)
        scene.collection.objects.link(copy)
        names[copy.name] = item.name
    return names


def _attach(mesh) -> None:
    """Give a copied mesh the attributes by which its corners are found again behind its modifiers."""
    count = bulk(mesh.polygons, "loop_total", np.int32)
    start = bulk(mesh.polygons, "loop_start", np.int32)
    position = bulk(mesh.vertices, "co", np.float32, 3)[read_loop_vertices(mesh)]
    face = np.arange(1, len(count) + 1, dtype=np.int32)
    _add(mesh, FACE, "INT", "FACE", "value", face)
    _add(mesh, POSITION, "FLOAT_VECTOR", "CORNER", "vector", position)
    _add(mesh, SOURCE, "FLOAT_VECTOR", "CORNER", "vector", np.repeat(_digits(face), count, axis=0))
    most = _numbered_corners(count)
    number = np.where(np.repeat(count > most, count), -1, np.arange(len(position)) - np.repeat(start, count))
    for first in range(0, most, 4):
        share = number[:, None] == first + np.arange(4)
        _add(mesh, SHARE.format(first), "FLOAT_COLOR", "CORNER", "color", share.astype(np.float32))


def _add(mesh, name: str, data_type: str, domain: str, key: str, values: np.ndarray) -> None:
    attribute = mesh.attributes.new(name, data_type, domain)
    attribute.data.foreach_set(key, np.ascontiguousarray(values).reshape(-1))


def _numbered_corners(count: np.ndarray) -> int:
    """How many corners of faces with ``count`` (n,) corners get attributes of their own."""
    return min(int(count.max(initial=0)), MOST_CORNERS, MOST_SHARES // max(int(count.sum()), 1))


def _digits(face: np.ndarray) -> np.ndarray:
    """(n, 3) float32: two digits of faces' numbers and a third, scattered one (mixed as in MurmurHash3, Appleby
    2011), by which the mean of several faces' digits is seen to be no face's."""
    mixed = face.astype(np.uint32) * np.uint32(0x85EBCA6B)
    mixed = (mixed ^ (mixed >> np.uint32(13))) * np.uint32(0xC2B2AE35)
    return np.stack([*np.divmod(face, DIGIT), mixed >> np.uint32(20)], 1).astype(np.float32)


def _number(digits: np.ndarray) -> np.ndarray:
    """(n,) int32: faces from their ``_digits`` (n, 3), 0 where these are of no one face."""
    with np.errstate(invalid="ignore"):
        rounded = np.where(np.isfinite(digits), np.rint(digits), 0)
        face = (rounded[:, 0] * DIGIT + rounded[:, 1]).astype(np.int32)
        same = (np.abs(_digits(face) - digits) < OFF).all(1)
    return np.where(same, face, 0)


def read_trace(mesh) -> Trace:
    """The attributes of an evaluated copy."""

    def fetch(name, domain, key, dtype, width):
        attribute = mesh.attributes.get(name)
        if attribute is None or attribute.domain != domain:
            return None
        return bulk(attribute.data, key, dtype, width)

    position = fetch(POSITION, "CORNER", "vector", np.float32, 3)
    digits = fetch(SOURCE, "CORNER", "vector", np.float32, 3)
    shares = []
    while (share := fetch(SHARE.format(4 * len(shares)), "CORNER", "color", np.float32, 4)) is not None:
        shares.append(share)
    return Trace(
        fetch(FACE, "FACE", "value", np.int32, 1),
        None if position is None else position.astype(np.float64),
        None if digits is None else _number(digits),
        np.concatenate(shares, 1) if shares else None,
        len(mesh.loops),
    )
