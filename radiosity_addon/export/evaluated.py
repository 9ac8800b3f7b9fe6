"""Evaluated materials: Cycles bakes what a node tree shows.

For node trees that ``shaders`` cannot read. Everything happens on temporary copies in a temporary
scene. An instanced mesh is evaluated once, where it first stands.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np

from ..bake.faces import triangle_areas
from .baked_copy import aim, bake_pass, baked_copy, user_materials
from .colors import ZERO, Color, Mapping, constant
from .gloss import has_gloss, sent_on
from .material_slots import Palette, slot_keys
from .parts import Part, world_vertices
from .picture_detail import detail_lost
from .remarks import blurred_remark
from .shaders import SurfaceShader
from .sides import sees_sides, show_back
from .squares import MOST_TEXELS, first_texels, make_squares, texels_in
from .traceless import traceless
from .transparency import emit_transmittance, lets_light_through

PICTURES = "\0pictures"  # name [as of a UV map] by which the places in pictures of materials are asked for
COATING = 0.1  # share [of the light along the normal] that coatings mirror at most: more is a metal's
FLAT = 1e-4  # variation [relative]: below it a picture is one color
SHARP = 0.02  # error [relative] between a picture's texels: above it the picture gets more of them
FINER = 4  # factor [texels of a picture] by which it gets more
# Numbers [texels of a picture for each of the image's, as half of each square is empty; texels of a picture of what
# has no image]: it gets no more.
FINEST, FINEST_WITHOUT = 8, 1024**2


def evaluate_steps(parts: list[Part], palette: Palette, find_scene, gloss: bool, shown: dict[int, float], error: float):
    """Bake the difficult materials of all parts into ``palette.per_part`` and ``.lookups``, in
    steps that yield the fraction done. ``find_scene()`` gives the user's scene; ``gloss``: what they
    mirror counts, too; ``shown``: the image's texels on the surface of a part, {part index: number}. A warning
    says where a picture lacks more than the ``error`` asked for."""
    done = {}
    for index, part in enumerate(parts):
        keys = tuple(k for k in dict.fromkeys(part.materials) if palette.index.get(k, 0) is None)
        if not keys:
            continue
        group = (id(part.mesh), part.materials)
        if group not in done:
            with traceless():
                done[group] = _evaluate_part(part, keys, palette, find_scene(), gloss, shown.get(index), error)
            yield index / len(parts)
        found, where = done[group]
        palette.per_part.update({(index, key): number for key, number in found.items()})
        if where is not None:
            palette.lookups[index] = where


@dataclass(frozen=True)
class Pictures:
    """Fronts and backs by material key; where they lie, (k, 3, 2) of the triangles evaluated; how many texels lie on
    these, and the detail that is lost between them, relative."""

    fronts: dict[str, SurfaceShader]
    backs: dict[str, SurfaceShader]
    lookup: np.ndarray
    texels: int
    lost: float


def _evaluate_part(part: Part, keys, palette: Palette, like, gloss: bool, shown: float | None, error: float):
    """{key: index in the palette}, and the triangles evaluated with their places in the picture."""
    wanted = np.array([key in keys for key in part.materials])[slot_keys(part)]
    chosen = np.flatnonzero(wanted)
    if not len(chosen):
        return {}, None
    texels = first_texels(len(chosen))
    most = min(FINEST_WITHOUT if shown is None else FINEST * shown, MOST_TEXELS)
    pictures = _pictures(part, chosen, keys, texels, like, gloss)
    while pictures.lost > SHARP and FINER * texels <= most:
        texels *= FINER
        pictures = _pictures(part, chosen, keys, texels, like, gloss)
    lost = pictures.lost * min((shown or 0.0) / pictures.texels, 1)
    if lost > error:
        palette.warnings.append(blurred_remark(part.name, keys, lost))
    found = {key: palette.add(key, pictures.fronts[key], pictures.backs.get(key)) for key in keys}
    return found, (chosen, pictures.lookup)


def _pictures(part: Part, chosen: np.ndarray, keys, count: int, like, gloss: bool) -> Pictures:
    """What materials show on the triangles ``chosen`` (k,) int, in pictures of about ``count`` texels."""
    import bpy

    squares = make_squares(triangle_areas(world_vertices(part), part.mesh.triangles[chosen]), count)
    scene, item, image = baked_copy(part, chosen, keys, squares.size, squares.bake, like)
    texels = {}
    for key in keys:
        mine = np.array([name == key for name in part.materials])[slot_keys(part)[chosen]]
        texels[key] = texels_in(squares, mine)
    originals = user_materials(keys)
    temporary = Temporary(scene, item, image, gloss)
    fronts = _surfaces(temporary, {k: m.copy() for k, m in originals.items()}, texels)
    copies = {k: m.copy() for k, m in originals.items() if sees_sides(m.node_tree)}
    for material in copies.values():
        show_back(material.node_tree)
    backs = _surfaces(temporary, copies, texels) if copies else {}
    bpy.data.batch_remove([item, item.data, image, scene])
    colors = [
        (color.pixels, texels[key])
        for key, surface in fronts.items()
        for color in (surface.diffuse, surface.emission, surface.transmittance)
        if color.pixels is not None
    ]
    number = sum(rows.size for mine in texels.values() for rows, _ in mine)
    lost = max((detail_lost(*each) for each in colors), default=0.0)
    return Pictures(fronts, backs, squares.lookup, max(number, 1), lost)


@dataclass(frozen=True)
class Temporary:
    """A temporary scene, the object in it and the image that bakes write; and whether what materials
    mirror is baked."""

    scene: object
    item: object
    image: object
    gloss: bool

    def bake(self, bake_type: str, *passes: str) -> np.ndarray:
        """(height, width, 3) of one bake."""
        return bake_pass(self.scene, self.item, self.image, bake_type, set(passes))


def _surfaces(temporary: Temporary, materials: dict, texels: dict) -> dict[str, SurfaceShader]:
    """What temporary materials {key: bpy material} show on the texels ``texels[key]``; each takes
    the slot of its key. They are used up and removed."""
    import bpy

    keys, slots = list(texels), temporary.item.data.materials
    for key, material in materials.items():
        aim(material, temporary.image)
        slots[keys.index(key)] = material
    trees = {key: material.node_tree for key, material in materials.items()}
    glossy = {key for key, tree in trees.items() if temporary.gloss and has_gloss(tree)}
    clear = {key for key, tree in trees.items() if lets_light_through(tree)}
    diffuse, emission = temporary.bake("DIFFUSE", "COLOR"), temporary.bake("EMIT")
    mirrored = temporary.bake("GLOSSY", "COLOR") if glossy else None
    for key in clear:
        emit_transmittance(trees[key])
    through = temporary.bake("EMIT") if clear else np.zeros_like(diffuse)
    sent = sent_on(diffuse, mirrored, through) if glossy else None
    mapping, found = Mapping(temporary.image.name, PICTURES, "EXTEND", "Linear"), {}
    for key in materials:
        color = functools.partial(_color, texels=texels[key], mapping=mapping)
        found[key] = SurfaceShader(color(diffuse), color(emission), color(through) if key in clear else ZERO)
        if key in glossy:
            share = float(np.mean([mirrored[some].mean() for some in texels[key]]))
            sharp = share if share > COATING else 0.0
            found[key] = replace(found[key], reflectance=color(sent), glossy=share, sharp=sharp)
    for index in range(len(keys)):
        slots[index] = None
    bpy.data.batch_remove(list(materials.values()))
    return found


def _color(pixels: np.ndarray, texels, mapping: Mapping) -> Color:
    """A picture as a color; a constant when it varies by less than FLAT."""
    inside = [pixels[rows, columns].reshape(-1, 3) for rows, columns in texels]
    low = np.min([values.min(axis=0) for values in inside], axis=0)
    high = np.max([values.max(axis=0) for values in inside], axis=0)
    if np.max(high - low) <= FLAT * np.max(np.abs(high)):
        return constant(0.5 * (low + high))
    return Color(np.ones(3), pixels=pixels, mapping=mapping)
