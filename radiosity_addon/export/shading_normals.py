"""Shading normals: how receivers' faces are shaded, smooth, by custom normals, and by the normal
and bump maps of their materials.

Cycles bakes the normals that any node tree shows, on a temporary copy of the object. Between two
steps names and arrays are held, nothing of Blender's: see ``steps``.
"""

from __future__ import annotations

import numpy as np

from ..bake.windows import TexelRect
from ..solver.geometry.vectors import unit_rows
from .assemble import Placed, corner_loops
from .baked_copy import aim, bake_pass, baked_copy, user_materials
from .material_slots import slot_keys
from .parts import Part, material_key, world_vertices
from .remarks import bends_light, turns_shaders
from .traceless import traceless

SAME = 1e-4  # difference [of 1]: normals whose parts differ by less are one
PARTS = 4  # number [parts of a texel's edge], each with its own normal
FINEST = 4096  # edge [pixels] of a picture of such parts, at most


def corner_normals(placed: Placed, flat_too: bool = False) -> np.ndarray | None:
    """(n, 3, 3) float32 unit normals in the world at the corners of a part's triangles; 0 where
    there is none. Where all triangles are shaded as they lie None, or if ``flat_too`` those."""
    part, found = placed.part, None
    true = np.repeat(_true_normals(placed)[:, None], 3, axis=1)
    if part.mesh.normals is not None:
        found = _to_world(part, part.mesh.normals[corner_loops(placed)].astype(float))
    if found is None or (np.abs(found - true) < SAME).all():
        return true.astype(np.float32) if flat_too else None
    return found.astype(np.float32)


def texel_normal_steps(rects, find_scene, found: dict):
    """Put into ``found``, by number of the (Placed, TexelRect, UVs in its window), what the normals
    that maps turn are in the mean over texels: (height, width, 3) float32, 0 where no face is. In
    steps that yield the fraction done."""
    for index, (where, rect, uv) in enumerate(rects):
        if len(where.kept) == 0 or not _bent_keys(where.part):
            continue
        with traceless():
            found[index] = _texel_normals(where, uv, rect, find_scene())
        yield index / len(rects)


def bent_materials(parts: list[Part]) -> list:
    """The user's materials on these parts whose maps turn light away from the faces' normals."""
    keys = dict.fromkeys(key for part in parts for key in _used_keys(part))
    return [known for key, known in _known(keys).items() if bends_light(known)]


def light_fades(part: Part) -> bool:
    """Whether Cycles lets light that grazes the part fade where maps turn it: where they turn
    shaders, and the material's Bump Map Correction is on."""
    return any(
        turns_shaders(known) and known.cycles.use_bump_map_correction
        for known in _known(_used_keys(part)).values()
    )


def _bent_keys(part: Part) -> list:
    return [key for key, known in _known(_used_keys(part)).items() if bends_light(known)]


def _used_keys(part: Part) -> list:
    return [part.materials[slot] for slot in np.unique(slot_keys(part))]


def _known(keys) -> dict:
    """{key: the user's material} of those that there are."""
    import bpy

    known = {material_key(material): material for material in bpy.data.materials}
    return {key: known[key] for key in keys if key in known}


def _texel_normals(placed: Placed, turned_uv: np.ndarray, rect: TexelRect, like) -> np.ndarray:
    """(height, width, 3) float32 mean normals in the world, of a window."""
    import bpy

    part, width, height = placed.part, rect.width, rect.height
    finer = int(np.clip(FINEST // max(width, height), 1, PARTS))
    uv = turned_uv[:, placed.order]
    keys = tuple(dict.fromkeys(part.materials))
    scene, item, image = baked_copy(part, placed.kept, keys, (width * finer, height * finer), uv, like)
    _shade(item.data, part, placed.kept)
    originals = user_materials([key for key in keys if key is not None])
    for slot, key in enumerate(keys):
        material = originals[key].copy() if key in originals else bpy.data.materials.new("None")
        if material.node_tree is None:
            material.use_nodes = True
        aim(material, image)
        item.data.materials[slot] = material
    picture = bake_pass(
        scene, item, image, "NORMAL", set(), normal_space="OBJECT",
        normal_r="POS_X", normal_g="POS_Y", normal_b="POS_Z",
    )
    local = 2 * picture - 1
    local[(picture == 0).all(axis=2)] = 0  # no face: no normal is (-1, -1, -1)
    world = _to_world(part, local).astype(np.float32)
    return world.reshape(height, finer, width, finer, 3).mean(axis=(1, 3))


def _shade(mesh, part: Part, chosen: np.ndarray) -> None:
    """Shade a temporary mesh of the chosen triangles as the part is."""
    if part.mesh.normals is None:
        mesh.shade_flat()
    else:
        mesh.normals_split_custom_set(part.mesh.normals[part.mesh.triangle_loops[chosen].ravel()])


def _to_world(part: Part, normals: np.ndarray) -> np.ndarray:
    """(..., 3) unit normals in the world of those in the part's own space; 0 where there is none."""
    inverse = np.linalg.pinv(part.matrix[:3, :3])
    return unit_rows(np.nan_to_num(normals) @ inverse)


def _true_normals(placed: Placed) -> np.ndarray:
    """(n, 3) unit normals of a part's triangles."""
    mesh = placed.part.mesh
    corners = world_vertices(placed.part)[mesh.triangles[placed.kept][:, placed.order]]
    return unit_rows(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
