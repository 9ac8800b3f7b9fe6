"""Traceless: temporary data-blocks and scenes that are gone afterward, whatever happens.

Every data-block made inside ``traceless()`` is removed when it ends, so that the
user's file holds what it held before.
"""

from __future__ import annotations

import contextlib

RENDER_HANDLERS = ("render_init", "render_pre", "render_post", "render_write", "render_stats",
                   "render_complete", "render_cancel")  # fmt: skip
BAKE_HANDLERS = ("object_bake_pre", "object_bake_complete", "object_bake_cancel")


@contextlib.contextmanager
def traceless():
    """Remove, on leaving, all data-blocks that were made inside; users' handlers stay silent."""
    import bpy

    before = {_key(block) for block in _blocks()}
    active = bpy.context.view_layer.objects.active
    with _silenced(RENDER_HANDLERS + BAKE_HANDLERS):
        try:
            yield
        finally:
            made = [block for block in _blocks() if _key(block) not in before]
            if made:  # to remove nothing makes Blender draw every window anew, too
                bpy.data.batch_remove(made)
            if bpy.context.view_layer.objects.active is not active:
                bpy.context.view_layer.objects.active = active


def temporary_scene(scene, view_layer):
    """A copy of ``scene`` that shares its objects and renders only ``view_layer``, 4 x 4 pixels."""
    copy = scene.copy()
    copy.name = "Radiosity temporary"
    for layer in copy.view_layers:
        layer.use = layer.name == view_layer.name
    render = copy.render
    render.resolution_x = render.resolution_y = 4
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.use_border = render.use_multiview = render.use_motion_blur = False
    render.use_compositing = render.use_sequencer = render.use_freestyle = False
    render.use_stamp = render.use_persistent_data = False
    if copy.camera is None:
        copy.camera = temporary_camera(copy)
    return copy


def temporary_camera(scene):
    """A camera object linked to ``scene``; its data-blocks end with ``traceless``."""
    import bpy

    name = "Radiosity temporary"
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    scene.collection.objects.link(camera)
    return camera


def _blocks():
    """All data-blocks of the file, each once."""
    import bpy

    for prop in bpy.data.bl_rna.properties:
        if prop.type == "COLLECTION":
            blocks = getattr(bpy.data, prop.identifier)
            yield from (block for block in blocks if isinstance(block, bpy.types.ID))


def _key(block) -> int:
    return block.session_uid


@contextlib.contextmanager
def _silenced(names):
    """Application handlers of these names are set aside and put back."""
    import bpy

    lists = [getattr(bpy.app.handlers, name) for name in names if hasattr(bpy.app.handlers, name)]
    saved = [list(handlers) for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, old in zip(lists, saved):
            handlers[:] = old
