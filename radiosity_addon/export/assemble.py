"""Assemble: parts and materials into the solver's arrays.

Vertices that faces share stay shared, so that Embree sees no cracks. Faces without area, or with
vertices that are not finite, are left out, and the warnings say how many of which object.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.layers import FARTHEST, within_range
from ..figures import quoted
from .material_slots import Palette, slot_keys
from .mesh_arrays import sound_triangles
from .parts import Part, is_mirrored, world_vertices


@dataclass(frozen=True)
class Placed:
    """A part's triangles in the scene: ``start:stop``, and which of the mesh's they are."""

    part: Part
    start: int
    stop: int
    kept: np.ndarray  # (stop - start,) int32, into the mesh's triangles
    order: np.ndarray  # (3,) corners of the mesh's triangle in the scene's winding


@dataclass(frozen=True)
class Assembly:
    """The arrays of ``solver.scene.Scene`` that describe triangles."""

    vertices: np.ndarray
    triangles: np.ndarray
    object: np.ndarray
    placed: tuple[Placed, ...]


def assemble(parts: list[Part], warnings: list[str]) -> Assembly:
    """Join all parts in world space, in the order given."""
    vertices, triangles, owners, placed = [], [], [], []
    base = start = 0
    unsound: dict[str, np.ndarray] = {}  # instances of one name have the same mesh
    for index, part in enumerate(parts):
        points = world_vertices(part)
        sound, not_finite, empty = sound_triangles(points, part.mesh.triangles)
        unsound[part.name] = np.maximum(unsound.get(part.name, 0), [not_finite, empty])
        kept = np.flatnonzero(sound).astype(np.int32)
        order = np.array([0, 2, 1] if is_mirrored(part) else [0, 1, 2])
        points = np.where(within_range(points), points, 0.0) if not_finite else points
        vertices.append(points)
        triangles.append(part.mesh.triangles[kept][:, order] + base)
        owners.append(np.full(len(kept), index, np.int32))
        placed.append(Placed(part, start, start + len(kept), kept, order))
        base += len(points)
        start += len(kept)
    warnings += _unsound_warnings(unsound)
    if not parts:
        return Assembly(
            np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32), ()
        )
    return Assembly(
        np.concatenate(vertices),
        np.concatenate(triangles).astype(np.int32),
        np.concatenate(owners),
        tuple(placed),
    )


def _unsound_warnings(unsound: dict[str, np.ndarray]) -> list[str]:
    """One sentence on the triangles of all objects that are not finite, and one on those without area, if there are
    any; ``unsound`` has the numbers of both by the object's name."""
    warnings = []
    for column, fault in enumerate((f"with vertices that are NaN, infinite or beyond {FARTHEST:g}", "without area")):
        counts = {name: numbers[column] for name, numbers in unsound.items() if numbers[column]}
        worst = sorted(counts, key=counts.get, reverse=True)
        if worst:
            start = "objects" if len(worst) > 1 else "object"
            warnings.append(f"{start} {quoted(worst)}: {sum(counts.values())} triangles {fault} left out")
    return warnings


def material_indices(geometry: Assembly, palette: Palette) -> np.ndarray:
    """(n_triangles,) int32 into the palette's surfaces."""
    result = np.zeros(len(geometry.triangles), np.int32)
    for index, placed in enumerate(geometry.placed):
        part = placed.part
        table = [palette.number(index, key) or 0 for key in part.materials]
        result[placed.start : placed.stop] = np.array(table)[slot_keys(part)[placed.kept]]
    return result


def corner_loops(placed: Placed) -> np.ndarray:
    """(n, 3) the mesh's loop at each corner of the part's triangles."""
    return placed.part.mesh.triangle_loops[placed.kept][:, placed.order]


def _scatter(geometry: Assembly, width: int, values_of) -> np.ndarray:
    """(n_triangles, 3, width) float32 of ``values_of(mesh)`` (loops, width), 0 where that is None."""
    result = np.zeros((len(geometry.triangles), 3, width), np.float32)
    for placed in geometry.placed:
        values = values_of(placed.part.mesh)
        if values is not None:
            result[placed.start : placed.stop] = values[corner_loops(placed)]
    return result


def scatter_uvs(geometry: Assembly, name: str) -> np.ndarray:
    """(n_triangles, 3, 2) float32 of the UV map ``name`` ("": each mesh's default); 0 elsewhere."""
    return _scatter(geometry, 2, lambda mesh: mesh.uvs.get(name or mesh.active_uv))


def scatter_colors(geometry: Assembly, name: str) -> np.ndarray:
    """(n_triangles, 3, 4) float32 of the color attribute ``name`` ("": the default), else 0."""
    return _scatter(geometry, 4, lambda mesh: mesh.colors.get(name or mesh.active_color))


def scatter_lookups(geometry: Assembly, lookups: dict) -> np.ndarray:
    """(n_triangles, 3, 2) float32 from {part index: (mesh triangles, their uv (k, 3, 2))}."""
    result = np.zeros((len(geometry.triangles), 3, 2), np.float32)
    for index, (chosen, uv) in lookups.items():
        placed = geometry.placed[index]
        of_mesh = np.zeros((len(placed.part.mesh.triangles), 3, 2), np.float32)
        of_mesh[chosen] = uv
        result[placed.start : placed.stop] = of_mesh[placed.kept][:, placed.order]
    return result
