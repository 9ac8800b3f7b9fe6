"""Baked images drawn over the viewport's meshes, with no material in between. bpy and its gpu.

The viewport's own picture is drawn over whole, with a depth buffer of our own: equal depths would
flicker, as the viewport moves its pixels for smooth edges. Meshes without a bake are grey. The
meshes are read once, when the overlay is added: adding it again shows later edits.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import bpy

from .results import has_result, image_of, uv_map_of

VERTEX = """
void main() {
  place = uv;
  gl_Position = ModelViewProjectionMatrix * vec4(pos, 1.0);
}
"""
# The frame buffer encodes for the display. The alpha is not looked at: it is 0 in the margin.
FRAGMENT = """
void main() {
  shown = vec4(max(texture(image, place).rgb, vec3(0.0)), 1.0);
}
"""
GREY = (0.35, 0.35, 0.35, 1.0)  # of meshes without a bake, as displayed
_handle = None
_spaces: dict[int, list] = {}  # by the space's address: what is drawn there


@dataclass(frozen=True)
class Piece:
    """One object's triangles on the graphics card, and the names to find the rest by."""

    object_name: str
    image_name: str  # empty: drawn grey
    batch: object


def add(context, space) -> None:
    """Draw the baked images in this viewport from now on."""
    global _handle
    depsgraph = context.evaluated_depsgraph_get()
    pieces = [
        _piece(context.scene.radiosity, item, depsgraph)
        for item in context.view_layer.objects
        if item.type == "MESH" and item.visible_get()
    ]
    _spaces[space.as_pointer()] = [piece for piece in pieces if piece.batch is not None]
    if _handle is None:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def _piece(properties, item, depsgraph) -> Piece:
    if not has_result(item, properties):
        return Piece(item.name, "", _batch(item, depsgraph, None))
    uv_map = uv_map_of(properties, item.data)
    return Piece(item.name, image_of(properties, item).name, _batch(item, depsgraph, uv_map))


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
    _image_shader.cache_clear()


def _draw() -> None:
    import gpu

    pieces = _spaces.get(bpy.context.space_data.as_pointer())
    if not pieces:
        return
    gpu.state.active_framebuffer_get().clear(depth=1.0)
    gpu.state.blend_set("NONE")  # the margin's texels have alpha 0
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    for piece in pieces:
        _draw_piece(piece)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


def _draw_piece(piece: Piece) -> None:
    """Draw it, unless its object is gone or hidden by now; grey if its image is gone."""
    import gpu

    item = bpy.data.objects.get(piece.object_name)
    if item is None or not item.visible_get():
        return
    image = bpy.data.images.get(piece.image_name) if piece.image_name else None
    shader = _image_shader() if image else _plain_shader()
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(item.matrix_world)
        shader.bind()
        if image:
            matrix = gpu.matrix.get_projection_matrix() @ gpu.matrix.get_model_view_matrix()
            shader.uniform_float("ModelViewProjectionMatrix", matrix)
            shader.uniform_sampler("image", gpu.texture.from_image(image))
        else:
            shader.uniform_float("color", GREY)
        piece.batch.draw(shader)


def _plain_shader():
    import gpu

    return gpu.shader.from_builtin("UNIFORM_COLOR")


@lru_cache(maxsize=1)
def _image_shader():
    """Draws an image of linear colours."""
    import gpu

    between = gpu.types.GPUStageInterfaceInfo("radiosity_interface")
    between.smooth("VEC2", "place")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.sampler(0, "FLOAT_2D", "image")
    info.vertex_in(0, "VEC3", "pos")
    info.vertex_in(1, "VEC2", "uv")
    info.vertex_out(between)
    info.fragment_out(0, "VEC4", "shown")
    info.vertex_source(VERTEX)
    info.fragment_source(FRAGMENT)
    return gpu.shader.create_from_info(info)


def _batch(item, depsgraph, uv_map: str | None):
    """The evaluated triangles, with UV coordinates if a map is named; None without triangles."""
    import numpy as np
    from gpu_extras.batch import batch_for_shader

    evaluated = item.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    count = len(mesh.loop_triangles)
    content, shader = {}, _plain_shader
    if count:
        points = _values(mesh.vertices, "co", 3, np.float32)
        content["pos"] = points[_values(mesh.loop_triangles, "vertices", 3, np.int32).ravel()]
    if count and uv_map and uv_map in mesh.uv_layers:
        uv = _values(mesh.uv_layers[uv_map].uv, "vector", 2, np.float32)
        content["uv"] = uv[_values(mesh.loop_triangles, "loops", 3, np.int32).ravel()]
        shader = _image_shader
    evaluated.to_mesh_clear()
    if not content:
        return None
    return batch_for_shader(shader(), "TRIS", content)


def _values(collection, name: str, width: int, kind):
    """(n, width) of one property of all items."""
    import numpy as np

    values = np.empty(len(collection) * width, kind)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)
