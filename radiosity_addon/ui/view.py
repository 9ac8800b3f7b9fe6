"""One button that shows the bake in the viewport, and back. Materials stay untouched.

Vertex colours are shown by the viewport's own Solid mode; images by ``overlay``. What the
viewport looked like is remembered for as long as Blender runs.
"""

import bpy

from . import overlay
from .results import any_baked, attribute_of, baked_objects

SHADING = ("type", "light", "color_type", "show_xray")
_before: dict[int, dict] = {}  # by the space's address: its shading before it showed a bake
_active: dict[int, str] = {}  # by the object's session id: the attribute that was active


class RADIOSITY_OT_show(bpy.types.Operator):
    """Show the baked light in this viewport, or go back to how it looked. Materials are not
    touched"""

    bl_idname = "radiosity.show"
    bl_label = "Show Result"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        space = context.space_data
        if space is None or space.type != "VIEW_3D":
            cls.poll_message_set("Use it in a 3D View")
            return False
        if not shows(space) and not any_baked(context):
            cls.poll_message_set("Nothing visible carries a bake of this target and name")
            return False
        return True

    def execute(self, context):
        space = context.space_data
        if shows(space):
            restore(space)
        else:
            show(context, space)
        context.area.tag_redraw()
        return {"FINISHED"}


def shows(space) -> bool:
    """Whether this viewport shows a bake by our doing."""
    return space.as_pointer() in _before


def show(context, space) -> None:
    """Make the viewport show the chosen target's bake."""
    shading = space.shading
    _before[space.as_pointer()] = {name: getattr(shading, name) for name in SHADING}
    shading.type, shading.light, shading.color_type = "SOLID", "FLAT", "VERTEX"
    shading.show_xray = False
    if context.scene.radiosity.target == "IMAGE":
        shading.color_type = "OBJECT"
        overlay.add(context, space)
        return
    for item in baked_objects(context):
        attributes = item.data.color_attributes
        name = attribute_of(context.scene.radiosity, item.data)
        if attributes.active_color_name != name:
            _active[item.session_uid] = attributes.active_color_name
            attributes.active_color_name = name


def restore(space) -> None:
    """Give the viewport back its look, and the meshes the attribute that was active."""
    overlay.remove(space)
    for name, value in _before.pop(space.as_pointer()).items():
        setattr(space.shading, name, value)
    if _before:
        return
    for item in bpy.data.objects:
        name = _active.pop(item.session_uid, "")
        if name and item.type == "MESH" and name in item.data.color_attributes:
            item.data.color_attributes.active_color_name = name


def forget() -> None:
    """Give every viewport its look back and remove the overlay: the add-on is going away."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D" and shows(space):
                    restore(space)
    overlay.clear()
    _before.clear()
    _active.clear()


CLASSES = (RADIOSITY_OT_show,)
