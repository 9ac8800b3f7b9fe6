"""Which objects are baked, and why the Bake button is grey. Depends on bpy."""

import bpy
from bpy.app.translations import pgettext_tip as tip_

from . import session


def chosen_objects(context) -> tuple[str, ...]:
    """Names of the receivers; empty for all that are rendered, as ``Settings`` has it."""
    if context.scene.radiosity.objects_from == "ALL":
        return ()
    return tuple(item.name for item in context.selected_objects if item.type == "MESH")


def candidates(context):
    """The objects that the user's choice points at, one by one."""
    if context.scene.radiosity.objects_from == "SELECTED":
        return iter(context.selected_objects)
    return (item for item in context.view_layer.objects if item.type == "MESH")


def left_out(item, properties) -> str:
    """Why ``item`` cannot be baked; empty when it can."""
    if item.type != "MESH":
        return tip_("it is no mesh")
    if item.hide_render:
        return tip_("it is disabled in renders")
    if not item.data.polygons and not item.data.is_editmode:
        return tip_("it has no faces")
    if item.library or item.data.library:
        return tip_("it is linked from another file: make it local")
    uv_map = properties.uv_map.strip()
    if properties.target == "IMAGE" and uv_map and uv_map not in item.data.uv_layers:
        return tip_("it lacks the UV map")
    return ""


def why_not(context) -> str:
    """Why a bake cannot start now; empty when it can. Cheap: asked at every redraw."""
    if session.current() is not None:
        return tip_("A bake is running: wait for it or cancel it")
    if context.mode != "OBJECT":
        return tip_("Leave the current mode for Object Mode first")
    properties = context.scene.radiosity
    if not properties.passes:
        return tip_("Choose at least one pass")
    if not properties.bake_name.strip():
        return tip_("Give the color attribute and the images a name")
    if properties.write_files and properties.target == "IMAGE":
        if properties.image_dir.startswith("//") and not bpy.data.filepath:
            return tip_("Save the file first: the image folder is relative to it")
    if any(not left_out(item, properties) for item in candidates(context)):
        return ""
    if properties.objects_from == "SELECTED":
        return tip_("Select a mesh that is rendered")
    return tip_("Add a mesh: the view layer has none that can be baked")
