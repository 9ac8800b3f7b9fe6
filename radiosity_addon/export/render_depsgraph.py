"""Render depsgraph: the scene as the render sees it.

Scripts only get the viewport's dependency graph: render-only modifiers off, viewport levels of
subdivision, objects hidden in the viewport missing. A render engine is given the graph evaluated
for rendering, so a throw-away engine renders four pixels of a temporary copy of the scene and
hands its graph over. This costs milliseconds plus the evaluation itself.
"""

from __future__ import annotations

from ..solver.expected import Refused
from .traceless import temporary_scene

ENGINE = "RADIOSITY_EXPORT"


def with_render_depsgraph(scene, view_layer, read, prepare=None):
    """Return ``read(depsgraph)``, evaluated for rendering; exceptions in it pass through.

    ``prepare(temporary scene)`` may add temporary objects first. Call inside ``traceless()``: the
    temporary scene is removed there. Raises Refused when Blender refuses to render.
    """
    import bpy

    outcome = {}

    class Engine(bpy.types.RenderEngine):
        bl_idname = ENGINE
        bl_label = "Radiosity export"
        bl_use_gpu_context = False

        def render(self, depsgraph):
            try:
                outcome["result"] = read(depsgraph)
            except BaseException as error:  # carried out of Blender's callback, raised below
                outcome["error"] = error

    temporary = temporary_scene(scene, view_layer)
    if prepare is not None:
        prepare(temporary)
    bpy.utils.register_class(Engine)
    try:
        temporary.render.engine = ENGINE
        bpy.ops.render.render(scene=temporary.name)
    finally:
        bpy.utils.unregister_class(Engine)
    if "error" in outcome:
        raise outcome["error"]
    if "result" not in outcome:
        raise Refused("Blender did not evaluate the scene for rendering; is a render running?")
    return outcome["result"]
