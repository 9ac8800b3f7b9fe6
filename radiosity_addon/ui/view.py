"""One button that shows the bake in the viewport, and back. Materials stay untouched.

``overlay`` shows it, over the viewport in Solid mode. What the viewport looked like is remembered
for as long as Blender runs.
"""

import bpy

from . import overlay
from .results import CarriesBake

SHADING = ("type", "show_xray")
_before: dict[int, dict] = {}  # by the space's address: its shading before it showed a bake


class RADIOSITY_OT_show(CarriesBake, bpy.types.Operator):
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
        return shows(space) or super().poll(context)

    def execute(self, context):
        space = context.space_data
        if shows(space):
            restore(space)
        else:
            show(space)
        context.area.tag_redraw()
        return {"FINISHED"}


def shows(space) -> bool:
    """Whether this viewport shows a bake by our doing."""
    return space.as_pointer() in _before


def show(space) -> None:
    """Make the viewport show the bake of the target and name that are chosen, whichever these are
    then."""
    shading = space.shading
    _before[space.as_pointer()] = {name: getattr(shading, name) for name in SHADING}
    shading.type, shading.show_xray = "SOLID", False
    overlay.add(space)


def restore(space) -> None:
    """Give the viewport back its look."""
    overlay.remove(space)
    for name, value in _before.pop(space.as_pointer()).items():
        setattr(space.shading, name, value)


def forget() -> None:
    """Give every viewport its look back and remove the overlay: the add-on is going away."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D" and shows(space):
                    restore(space)
    overlay.clear()
    _before.clear()


CLASSES = (RADIOSITY_OT_show,)
