"""Baked copy: Cycles bakes copies of a part's triangles in a temporary scene.

Call inside ``traceless()``: what is made here is gone afterward.
"""

from __future__ import annotations

import numpy as np

from ..bake.texels import width_and_height
from ..solver.expected import Refused
from .material_slots import slot_keys
from .panorama import set_up_cycles
from .parts import Part, material_key

SAMPLES = 4  # number [samples of a pixel]: what is baked has no noise
UV_LIMIT = 7  # number [UV maps] of an object: of Blender's 8 one is ours


def user_materials(keys) -> dict:
    """{key: the user's material}. Raises Refused for one that was removed."""
    import bpy

    known = {material_key(material): material for material in bpy.data.materials}
    removed = [key for key in keys if key not in known]
    if removed:
        raise Refused(f"material {removed[0]!r} was removed while it was read; bake again")
    return {key: known[key] for key in keys}


def baked_copy(part: Part, chosen, keys, size: int | tuple[int, int], uv: np.ndarray, like):
    """A temporary scene, the chosen triangles (k,) in it with a slot for each key, and the image of
    ``size`` that a bake writes, where their corners lie at ``uv`` (k, 3, 2)."""
    import bpy
    from mathutils import Matrix

    scene = bpy.data.scenes.new("Radiosity temporary")
    scene.frame_current = like.frame_current
    set_up_cycles(scene, SAMPLES)
    image = bpy.data.images.new(
        "Radiosity temporary", *width_and_height(size), float_buffer=True, is_data=True
    )
    mesh = _mesh(part, chosen, uv)
    item = bpy.data.objects.new("Radiosity temporary", mesh)
    original = bpy.data.objects.get(part.name)
    if original is not None:
        item.pass_index, item.color = original.pass_index, original.color
    item.matrix_world = Matrix(part.matrix.tolist())  # nested lists would be taken for columns
    scene.collection.objects.link(item)
    for _ in keys:
        mesh.materials.append(None)
    slots = np.array([keys.index(k) if k in keys else 0 for k in part.materials])
    mesh.polygons.foreach_set("material_index", slots[slot_keys(part)[chosen]].astype(np.int32))
    mesh.update()
    return scene, item, image


def aim(material, image) -> None:
    """Make the image, which the bake writes, the active node of a temporary material."""
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    for other in nodes:
        other.select = False
    node.select = True
    nodes.active = node


def _mesh(part: Part, chosen, uv: np.ndarray):
    """A temporary mesh of the chosen triangles with all UV maps, colors and the map baked to."""
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
    layer = mesh.uv_layers.new(name="Radiosity temporary map", do_init=False)
    layer.uv.foreach_set("vector", uv.astype(np.float32).reshape(-1))
    mesh.uv_layers.active = layer
    return mesh


def bake_pass(scene, item, image, pass_type: str, passes: set, **options) -> np.ndarray:
    """(height, width, 3) float32 of one bake."""
    import bpy

    layer = scene.view_layers[0]
    layer.update()
    bake = scene.render.bake
    bake.margin, bake.margin_type, bake.use_clear = 2, "EXTEND", True
    bake.use_selected_to_active = False
    item.select_set(True, view_layer=layer)
    layer.objects.active = item
    items = [item]
    with bpy.context.temp_override(
        scene=scene, view_layer=layer, active_object=item, object=item,
        selected_objects=items, selected_editable_objects=items,
    ):  # fmt: skip
        bpy.ops.object.bake(type=pass_type, pass_filter=passes, margin=2, use_clear=True, **options)
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)[..., :3].copy()
