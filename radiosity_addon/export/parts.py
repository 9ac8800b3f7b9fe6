"""Parts: every mesh that the render sees, placed in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.own_materials import own_material
from .mesh_arrays import MeshArrays, read_mesh

NOT_MODELED = {"VOLUME": "volume", "CURVES": "hair", "POINTCLOUD": "point cloud"}


@dataclass(frozen=True)
class Part:
    """A mesh placed in the world: an object's own mesh or one of its instances."""

    name: str  # of the Blender object
    mesh: MeshArrays
    matrix: np.ndarray  # (4, 4) float64, local to world
    materials: tuple[str | None, ...]  # names (see material_key) by slot
    instance: bool  # made by an instancer; not an object of its own
    casts_shadow: bool
    visible: bool  # to diffuse rays
    owners: frozenset[str] = frozenset()  # names of the object and of the one that instances it


def material_key(material) -> str | None:
    """A name by which local and linked materials of one name differ; None stays None."""
    if material is None:
        return None
    library = material.library
    return material.name if library is None else f"{material.name} [{library.filepath}]"


def read_parts(depsgraph, progress, copies=()) -> tuple[list[Part], set[str], list[str]]:
    """All parts of an evaluated scene in Blender's order, the names of all objects that render,
    and warnings on what has no surface.

    ``copies`` are names of temporary objects that take no part. ``progress(0)`` may raise.

    Curves, texts, metaballs and surfaces arrive as meshes that Blender itself instances.
    """
    meshes: dict[int, MeshArrays] = {}
    parts, seen, warnings = [], set(), {}
    override = material_key(depsgraph.view_layer.material_override)
    for count, entry in enumerate(depsgraph.object_instances):
        item = entry.object
        if count % 64 == 0:
            progress(0.0)
        if item.name in copies or (entry.parent is not None and entry.parent.name in copies):
            continue
        if not entry.is_instance:
            seen.add(item.name)
        if item.type in NOT_MODELED and item.type not in warnings:
            warnings[item.type] = (
                f'object "{item.name}" is a {NOT_MODELED[item.type]}, which neither lights nor '
                "shadows the bake; convert it to a mesh if it should"
            )
        if item.type != "MESH" or not entry.show_self or item.data is None:
            continue
        key = item.data.as_pointer()
        if key not in meshes:
            meshes[key] = _read(item, depsgraph)
        if len(meshes[key].triangles):
            parts.append(_part(entry, item, meshes[key], override))
    return parts, seen, list(warnings.values())


def _read(item, depsgraph) -> MeshArrays:
    """The mesh of an evaluated object; one in edit mode has to be converted first."""
    if not item.data.is_editmode:
        return read_mesh(item.data)
    try:
        return read_mesh(item.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph))
    finally:
        item.to_mesh_clear()


def _part(entry, item, mesh: MeshArrays, override: str | None) -> Part:
    """A mesh as the entry of the evaluated scene places it; ``override`` is the material of all slots,
    or None."""
    slots = tuple(material_key(own_material(item, i)) for i in range(len(item.material_slots)))
    if override is not None:
        slots = (override,) * max(len(slots), 1)
    shown = entry.parent if entry.is_instance and entry.parent is not None else item
    return Part(
        name=item.name if not entry.is_instance else _instance_name(entry, item),
        mesh=mesh,
        matrix=np.array(entry.matrix_world, dtype=np.float64),
        materials=slots or (None,),
        instance=bool(entry.is_instance),
        casts_shadow=bool(item.visible_shadow and shown.visible_shadow),
        visible=bool(item.visible_diffuse and shown.visible_diffuse),
        owners=frozenset((item.name, shown.name)),
    )


def _instance_name(entry, item) -> str:
    parent = entry.parent.name if entry.parent is not None else "?"
    return item.name if parent == item.name else f"{parent}: {item.name}"


def world_vertices(part: Part) -> np.ndarray:
    """(n_vertices, 3) float64 world positions."""
    with np.errstate(invalid="ignore"):  # vertices that are not finite are found and left out later
        return part.mesh.vertices @ part.matrix[:3, :3].T + part.matrix[:3, 3]


def is_mirrored(part: Part) -> bool:
    """Whether the transform turns the winding of faces around."""
    return float(np.linalg.det(part.matrix[:3, :3])) < 0.0
