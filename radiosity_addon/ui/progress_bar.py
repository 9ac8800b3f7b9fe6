"""The progress of a bake, in the panel and in Blender's status bar."""

from bpy.app.translations import pgettext_iface as iface_

from . import session, words

CATEGORY = "Radiosity"  # the tab's name


def draw_progress(layout, bake) -> None:
    """The bake's state, percent and time left, and the way to stop it."""
    row = layout.row(align=True)
    row.scale_y = 1.5
    row.progress(factor=bake.fraction, text=progress_text(bake))
    row.operator("radiosity.cancel", text="", icon="X")


def draw_status(self, context) -> None:
    """The same in Blender's status bar."""
    bake = session.current()
    if bake is not None:
        row = self.layout.row(align=True)
        row.ui_units_x = 16
        row.progress(factor=bake.fraction, text=progress_text(bake))
        row.operator("radiosity.cancel", text="", icon="X")


def progress_text(bake) -> str:
    """``Solving: gather 42 %, 3 s left``; the time only when there is enough to judge by."""
    text = iface_(bake.state.value)
    if bake.detail:
        text = f"{text}: {iface_(bake.detail)}"
    text = f"{text} {100 * bake.fraction:.0f} %"
    left = bake.seconds_left
    if left is None:
        return text
    return iface_("{:s}, {:s} left").format(text, words.duration(left))


def redraw(context) -> None:
    """Show the progress of now wherever it is shown, and draw nothing else anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI" and region.active_panel_category == CATEGORY:
                        region.tag_redraw()
        window.workspace.status_text_set(None)
