"""Baked images drawn over the viewport's meshes, with no material in between. bpy and its gpu.

The meshes are read once, when the overlay is added: adding it again shows later edits.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from .results import baked_objects, image_of, uv_map_of

_handle = None
_spaces: dict[int, list] = {}  # by the space's address: what is drawn there


@dataclass(frozen=True)
class Piece:
    """One object's triangles on the graphics card, and the names to find the rest by."""

    object_name: str
    image_name: str
    batch: object


def add(context, space) -> None:
    """Draw the baked images in this viewport from now on."""
    global _handle
    properties, depsgraph = context.scene.radiosity, context.evaluated_depsgraph_get()
    shader = _shader()
    _spaces[space.as_pointer()] = [
        Piece(item.name, image_of(properties, item).name, batch)
        for item in baked_objects(context)
        if (batch := _batch(shader, item, depsgraph, uv_map_of(properties, item.data)))
    ]
    if _handle is None:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def remove(space) -> None:
    """Draw them no more in this viewport; nothing happens if they were not drawn."""
    _spaces.pop(space.as_pointer(), None)
    if not _spaces:
        clear()


def clear() -> None:
    """Draw nothing anywhere, and take the handler away."""
    global _handle
    _spaces.clear()
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None


def _draw() -> None:
    import gpu

    pieces = _spaces.get(bpy.context.space_data.as_pointer())
    if not pieces:
        return
    shader = _shader()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    for piece in pieces:
        item = bpy.data.objects.get(piece.object_name)
        image = bpy.data.images.get(piece.image_name)
        if item is None or image is None or not item.visible_get():
            continue
        with gpu.matrix.push_pop():
            gpu.matrix.multiply_matrix(item.matrix_world)
            shader.bind()
            shader.uniform_sampler("image", gpu.texture.from_image(image))
            piece.batch.draw(shader)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _shader():
    import gpu

    return gpu.shader.from_builtin("IMAGE")


def _batch(shader, item, depsgraph, uv_map: str):
    """The evaluated triangles with their UV coordinates, or None without any."""
    import numpy as np
    from gpu_extras.batch import batch_for_shader

    evaluated = item.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    layer = mesh.uv_layers.get(uv_map)
    count = len(mesh.loop_triangles)
    if layer is None or count == 0:
        evaluated.to_mesh_clear()
        return None
    points = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", points)
    uv = np.empty(len(mesh.loops) * 2, np.float32)
    layer.uv.foreach_get("vector", uv)
    loops, vertices = np.empty(count * 3, np.int32), np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    evaluated.to_mesh_clear()
    content = {"pos": points.reshape(-1, 3)[vertices], "texCoord": uv.reshape(-1, 2)[loops]}
    return batch_for_shader(shader, "TRIS", content)
