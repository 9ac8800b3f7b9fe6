"""Evaluated materials: Cycles bakes what a node tree shows. Depends on bpy and NumPy.

For node trees that ``shaders`` cannot read. Everything happens on temporary copies in a temporary
scene; call inside ``traceless()``. An instanced mesh is evaluated once, where it first stands.
"""

from __future__ import annotations

import numpy as np

from .atlas import Atlas, atlas_texels, make_atlas
from .colors import ZERO, Color, Mapping, constant
from .materials import Palette, checked, slot_keys
from .panorama import set_up_cycles
from .parts import Part, material_key, world_vertices
from .shaders import Surface
from .transparency import emit_transmittance, lets_light_through

ATLAS = "\0atlas"  # the name under which the scene's atlas coordinates are asked for
SAMPLES = 4
FLAT = 1e-4  # relative variation below which a picture is one colour
UV_LIMIT = 7  # of Blender's 8 maps one is ours


def evaluate_difficult(parts: list[Part], palette: Palette, like, progress) -> None:
    """Bake the difficult materials of all parts into ``palette.per_part`` and ``.atlases``.

    ``like`` is the user's scene; ``progress`` may raise to cancel.
    """
    done = {}
    for index, part in enumerate(parts):
        keys = tuple(k for k in dict.fromkeys(part.materials) if palette.index.get(k, 0) is None)
        if not keys:
            continue
        progress(0.6)
        group = (id(part.mesh), part.materials)
        if group not in done:
            done[group] = _evaluate_part(part, keys, palette, like)
        found, where = done[group]
        palette.per_part.update({(index, key): number for key, number in found.items()})
        if where is not None:
            palette.atlases[index] = where


def _evaluate_part(part: Part, keys, palette: Palette, like):
    wanted = np.array([key in keys for key in part.materials])[slot_keys(part)]
    chosen = np.flatnonzero(wanted)
    if not len(chosen):
        return {}, None
    atlas = make_atlas(_areas(part, chosen))
    stage, thing, materials, image = _stage(part, chosen, keys, atlas, like)
    mapping = Mapping(image.name, ATLAS, "EXTEND", "Linear")
    reflectance = _bake(stage, thing, image, "DIFFUSE", {"COLOR"})
    emission = _bake(stage, thing, image, "EMIT", set())
    clear = {key: lets_light_through(m.node_tree) for key, m in materials.items()}
    for key, material in materials.items():
        if clear[key]:
            emit_transmittance(material.node_tree)
    through = _bake(stage, thing, image, "EMIT", set()) if any(clear.values()) else None
    found = {}
    for key in keys:
        same = np.array([name == key for name in part.materials])[slot_keys(part)[chosen]]
        cells = atlas_texels(atlas, same)
        pictures = (reflectance, emission, through if clear[key] else None)
        colors = [ZERO if p is None else _color(p, cells, mapping) for p in pictures]
        found[key] = palette.add(key, checked(Surface(*colors), key, palette.warnings))
    _remove(stage, thing, materials, image)
    return found, (chosen, atlas.lookup)


def _areas(part: Part, chosen: np.ndarray) -> np.ndarray:
    corners = np.nan_to_num(world_vertices(part)[part.mesh.triangles[chosen]])
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return 0.5 * np.linalg.norm(cross, axis=1)


def _stage(part: Part, chosen, keys, atlas: Atlas, like):
    """A temporary scene with the chosen triangles, copies of their materials and the image."""
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
    known = {material_key(material): material for material in bpy.data.materials}
    materials = {key: _target_copy(known[key], image) for key in keys}
    for key in keys:
        mesh.materials.append(materials[key])
    slots = np.array([keys.index(k) if k in keys else 0 for k in part.materials])
    mesh.polygons.foreach_set("material_index", slots[slot_keys(part)[chosen]].astype(np.int32))
    mesh.update()
    return stage, thing, materials, image


def _target_copy(material, image):
    """A copy of a material whose active node is the image that the bake writes."""
    copy = material.copy()
    node = copy.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    for other in copy.node_tree.nodes:
        other.select = False
    node.select = True
    copy.node_tree.nodes.active = node
    return copy


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


def _remove(stage, thing, materials: dict, image) -> None:
    """Free what one evaluation made at once: a scene may need many of them."""
    import bpy

    mesh = thing.data
    bpy.data.batch_remove([thing, mesh, *materials.values(), image, stage])
