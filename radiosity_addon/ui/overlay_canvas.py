"""Draws what ``overlay`` holds, by the graphics card. Called by Blender while it draws a viewport."""

from __future__ import annotations

import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from .display import SIZE
from .overlay_shaders import bake_shader, hole_shader, mean_shader

VIEW = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # corners [of the view], from -1 to 1


def draw(context, shown, samples: int) -> None:
    """The bake in the region that is being drawn, ``samples`` squared for each pixel."""
    region = context.region
    canvas = _canvas(shown, region, samples)
    matrix = gpu.matrix.get_projection_matrix() @ gpu.matrix.get_model_view_matrix()
    factor = 2.0**context.scene.view_settings.exposure
    with canvas.bind():
        gpu.state.active_framebuffer_get().clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        gpu.state.blend_set("NONE")
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        for item, piece, batch in _visible(context, shown):
            _draw_piece(item, piece, batch, matrix, factor, _table(shown))
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("ALPHA_PREMULT")
    shader = mean_shader()
    batch = batch_for_shader(shader, "TRI_FAN", {"pos": VIEW})
    shader.bind()
    shader.uniform_int("samples", samples)
    shader.uniform_sampler("canvas", canvas.texture_color)
    batch.draw(shader)
    gpu.state.blend_set("NONE")


def _canvas(shown, region, samples: int):
    """The region's canvas of so many samples, made anew when the region changes its size."""
    size = region.width * samples, region.height * samples
    canvas = shown.canvases.get(region.as_pointer())
    if canvas is None or (canvas.width, canvas.height) != size:
        canvas = gpu.types.GPUOffScreen(*size, format="RGBA8")
        shown.canvases[region.as_pointer()] = canvas
    return canvas


def _table(shown):
    """The table of the view as a texture."""
    if not isinstance(shown.table, gpu.types.GPUTexture):
        values = gpu.types.Buffer("FLOAT", shown.table.size, shown.table.ravel())
        shown.table = gpu.types.GPUTexture((SIZE**2, SIZE), format="RGBA32F", data=values)
    return shown.table


def _visible(context, shown):
    """(object, Piece, batch) of what this viewport shows. A name that is gone makes all names be
    looked up anew."""
    batches = {}
    for key, piece in shown.pieces.items():
        held = shown.batches.get(key)
        batches[key] = held if held and held[0] is piece else (piece, _batch(piece))
        item = bpy.data.objects.get(piece.name)
        if item is None:
            shown.fresh = False
        elif item.visible_in_viewport_get(context.space_data):
            yield item, piece, batches[key][1]
    shown.batches = batches


def _batch(piece):
    content = {"pos": piece.points}
    if piece.baked is None:
        return batch_for_shader(hole_shader(), "TRIS", content)
    content["baked"] = piece.baked
    return batch_for_shader(bake_shader(bool(piece.source[1])), "TRIS", content)


def _draw_piece(item, piece, batch, matrix, factor: float, table) -> None:
    image = bpy.data.images.get(piece.source[1]) if piece.source[1] else None
    if piece.baked is None or (piece.source[1] and image is None):
        _draw_hole(item, batch)
        return
    shader = bake_shader(image is not None)
    shader.bind()
    shader.uniform_float("ModelViewProjectionMatrix", matrix @ item.matrix_world)
    shader.uniform_float("factor", factor)
    shader.uniform_sampler("table", table)
    if image is not None:
        shader.uniform_sampler("image", gpu.texture.from_image(image))
    batch.draw(shader)


def _draw_hole(item, batch) -> None:
    """Depth alone, and nothing where something was drawn behind."""
    shader = hole_shader()
    with gpu.matrix.push_pop():
        gpu.matrix.multiply_matrix(item.matrix_world)
        shader.bind()
        shader.uniform_float("color", (0.0, 0.0, 0.0, 0.0))
        batch.draw(shader)
