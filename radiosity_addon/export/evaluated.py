"""Evaluated materials: Cycles bakes what a node tree shows.

For node trees that ``shaders`` cannot read. Everything happens on temporary copies in a temporary
scene. An instanced mesh is evaluated once, where it first stands.
"""

from __future__ import annotations

import numpy as np

from .atlas import Atlas, atlas_texels, make_atlas
from .colors import Color, Mapping, constant
from .materials import Palette, slot_keys
from .panorama import set_up_cycles
from .parts import Part, material_key, world_vertices
from .shaders import Surface
from .sides import sees_sides, turn_around
from .traceless import traceless
from .transparency import emit_transmittance, lets_light_through

ATLAS = "\0atlas"  # the name under which the scene's atlas coordinates are asked for
SAMPLES = 4
FLAT = 1e-4  # relative variation below which a picture is one colour
UV_LIMIT = 7  # of Blender's 8 maps one is ours


def evaluate_steps(parts: list[Part], palette: Palette, find_scene):
    """Bake the difficult materials of all parts into ``palette.per_part`` and ``.atlases``, in
    steps that yield the fraction done. ``find_scene()`` gives the user's scene."""
    done = {}
    for index, part in enumerate(parts):
        keys = tuple(k for k in dict.fromkeys(part.materials) if palette.index.get(k, 0) is None)
        if not keys:
            continue
        group = (id(part.mesh), part.materials)
        if group not in done:
            with traceless():
                done[group] = _evaluate_part(part, keys, palette, find_scene())
            yield index / len(parts)
        found, where = done[group]
        palette.per_part.update({(index, key): number for key, number in found.items()})
        if where is not None:
            palette.atlases[index] = where


def _evaluate_part(part: Part, keys, palette: Palette, like):
    """{key: index in the palette}, and the triangles evaluated with their places in the atlas."""
    import bpy

    wanted = np.array([key in keys for key in part.materials])[slot_keys(part)]
    chosen = np.flatnonzero(wanted)
    if not len(chosen):
        return {}, None
    atlas = make_atlas(_areas(part, chosen))
    stage, thing, image = _stage(part, chosen, keys, atlas, like)
    cells = {}
    for key in keys:
        mine = np.array([name == key for name in part.materials])[slot_keys(part)[chosen]]
        cells[key] = atlas_texels(atlas, mine)
    originals = _originals(keys)
    fronts = _surfaces(stage, thing, image, {k: m.copy() for k, m in originals.items()}, cells)
    turned = {k: m.copy() for k, m in originals.items() if sees_sides(m.node_tree)}
    for material in turned.values():
        turn_around(material.node_tree)
    backs = _surfaces(stage, thing, image, turned, cells) if turned else {}
    found = {key: palette.add(key, fronts[key], backs.get(key)) for key in keys}
    bpy.data.batch_remove([thing, thing.data, image, stage])
    return found, (chosen, atlas.lookup)


def _surfaces(stage, thing, image, materials: dict, cells: dict) -> dict[str, Surface]:
    """What temporary materials {key: bpy material} show on the texels ``cells[key]``; each takes
    the slot of its key. They are used up and removed."""
    import bpy

    keys = list(cells)
    for key, material in materials.items():
        _aim(material, image)
        thing.data.materials[keys.index(key)] = material
    pictures = [_bake(stage, thing, image, "DIFFUSE", {"COLOR"})]
    pictures.append(_bake(stage, thing, image, "EMIT", set()))
    clear = {key for key, material in materials.items() if lets_light_through(material.node_tree)}
    for key in clear:
        emit_transmittance(materials[key].node_tree)
    if clear:
        pictures.append(_bake(stage, thing, image, "EMIT", set()))
    mapping = Mapping(image.name, ATLAS, "EXTEND", "Linear")
    found = {}
    for key in materials:
        shown = pictures if key in clear else pictures[:2]
        found[key] = Surface(*(_color(picture, cells[key], mapping) for picture in shown))
    for index in range(len(keys)):
        thing.data.materials[index] = None
    bpy.data.batch_remove(list(materials.values()))
    return found


def _originals(keys) -> dict:
    """{key: the user's material}."""
    import bpy

    known = {material_key(material): material for material in bpy.data.materials}
    gone = [key for key in keys if key not in known]
    if gone:
        raise ValueError(f"material {gone[0]!r} was removed while it was read; bake again")
    return {key: known[key] for key in keys}


def _areas(part: Part, chosen: np.ndarray) -> np.ndarray:
    corners = np.nan_to_num(world_vertices(part)[part.mesh.triangles[chosen]])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(cross, axis=1)


def _stage(part: Part, chosen, keys, atlas: Atlas, like):
    """A temporary scene, the chosen triangles in it with a slot for each key, and the image."""
    import bpy

    stage = bpy.data.scenes.new("Radiosity temporary")
    stage.frame_current = like.frame_current
    set_up_cycles(stage, SAMPLES)
    image = bpy.data.images.new(
        "Radiosity temporary", atlas.size, atlas.size, float_buffer=True, is_data=True
    )
    mesh = _mesh(part, chosen, atlas)
    thing = bpy.data.objects.new("Radiosity temporary", mesh)
    original = bpy.data.objects.get(part.name)
    if original is not None:
        thing.pass_index, thing.color = original.pass_index, original.color
    thing.matrix_world = part.matrix.tolist()
    stage.collection.objects.link(thing)
    for _ in keys:
        mesh.materials.append(None)
    slots = np.array([keys.index(k) if k in keys else 0 for k in part.materials])
    mesh.polygons.foreach_set("material_index", slots[slot_keys(part)[chosen]].astype(np.int32))
    mesh.update()
    return stage, thing, image


def _aim(material, image) -> None:
    """Make the image, which the bake writes, the active node of a temporary material."""
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    for other in nodes:
        other.select = False
    node.select = True
    nodes.active = node


def _mesh(part: Part, chosen, atlas: Atlas):
    """A temporary mesh of the chosen triangles with all UV maps, colours and the atlas."""
    import bpy

    source, loops = part.mesh, part.mesh.triangle_loops[chosen].reshape(-1)
    mesh = bpy.data.meshes.new("Radiosity temporary")
    mesh.vertices.add(len(source.vertices))
    mesh.loops.add(len(loops))
    mesh.polygons.add(len(chosen))
    points = np.nan_to_num(source.vertices, posinf=0.0, neginf=0.0)
    mesh.vertices.foreach_set("co", points.astype(np.float32).reshape(-1))
    mesh.loops.foreach_set("vertex_index", source.triangles[chosen].astype(np.int32).reshape(-1))
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(loops), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    for name, values in list(source.uvs.items())[:UV_LIMIT]:
        layer = mesh.uv_layers.new(name=name, do_init=False)
        layer.uv.foreach_set("vector", np.ascontiguousarray(values[loops]).reshape(-1))
        layer.active_render = name == source.active_uv
    for name, values in source.colors.items():
        attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        attribute.data.foreach_set("color", np.ascontiguousarray(values[loops]).reshape(-1))
    names = [attribute.name for attribute in mesh.color_attributes]
    if source.active_color in names:
        mesh.color_attributes.render_color_index = names.index(source.active_color)
    layer = mesh.uv_layers.new(name="Radiosity temporary atlas", do_init=False)
    layer.uv.foreach_set("vector", atlas.bake.astype(np.float32).reshape(-1))
    mesh.uv_layers.active = layer
    return mesh


def _bake(stage, thing, image, kind: str, passes: set) -> np.ndarray:
    """(size, size, 3) float32 of one bake."""
    import bpy

    layer = stage.view_layers[0]
    layer.update()
    bake = stage.render.bake
    bake.margin, bake.margin_type, bake.use_clear = 2, "EXTEND", True
    bake.use_selected_to_active = False
    thing.select_set(True, view_layer=layer)
    layer.objects.active = thing
    things = [thing]
    with bpy.context.temp_override(
        scene=stage, view_layer=layer, active_object=thing, object=thing,
        selected_objects=things, selected_editable_objects=things,
    ):  # fmt: skip
        bpy.ops.object.bake(type=kind, pass_filter=passes, margin=2, use_clear=True)
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[..., :3].copy()


def _color(pixels: np.ndarray, cells, mapping: Mapping) -> Color:
    """A picture as a colour; a constant when it varies by less than FLAT."""
    inside = [pixels[rows, columns].reshape(-1, 3) for rows, columns in cells]
    low = np.min([values.min(axis=0) for values in inside], axis=0)
    high = np.max([values.max(axis=0) for values in inside], axis=0)
    if np.max(high - low) <= FLAT * np.max(np.abs(high)):
        return constant(0.5 * (low + high))
    return Color(np.ones(3), pixels=pixels, mapping=mapping)
