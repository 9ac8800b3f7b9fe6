"""Shared meshes made single-user, so that each object gets its own colors."""

import bpy

from ..bake.single_user import make_single_user
from . import session
from .choice import sharing_objects


class RADIOSITY_OT_single_user(bpy.types.Operator):
    """Give each chosen object that shares its mesh a copy of it, so that each gets its own colors.
    Materials and modifiers stay; the meshes are no longer edited together"""

    bl_idname = "radiosity.single_user"
    bl_label = "Make Meshes Single-User"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return session.current() is None and context.mode == "OBJECT"

    def execute(self, context):
        number = make_single_user(sharing_objects(context))
        if not number:
            self.report({"WARNING"}, "No chosen objects share a mesh")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Made {number} meshes single-user")
        return {"FINISHED"}


CLASSES = (RADIOSITY_OT_single_user,)
