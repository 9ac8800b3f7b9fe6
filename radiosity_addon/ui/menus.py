"""Where the operators stand in Blender's own menus, in which its menu search looks."""

import bpy


def draw_bake(self, context) -> None:
    """Render menu: the bake alone."""
    self.layout.separator()
    _bake(self.layout)


def draw_object(self, context) -> None:
    """Object menu: all there is to do with objects."""
    self.layout.separator()
    _bake(self.layout)
    shown = self.layout.operator("radiosity.build_material", text="Build and Put On Radiosity")
    shown.assign = True
    self.layout.operator("radiosity.remove_bake", text="Remove Radiosity Bake")


def _bake(layout) -> None:
    row = layout.row()
    row.operator_context = "INVOKE_DEFAULT"
    row.operator("radiosity.bake", icon="RENDER_STILL")


MENUS = (("TOPBAR_MT_render", draw_bake), ("VIEW3D_MT_object", draw_object))


def add() -> None:
    """Add the entries."""
    for name, draw in MENUS:
        getattr(bpy.types, name).append(draw)


def take_away() -> None:
    """Remove the entries."""
    for name, draw in MENUS:
        getattr(bpy.types, name).remove(draw)
