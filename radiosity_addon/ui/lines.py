"""Lines of text that panels have in common."""

import bpy
from bpy.app.translations import pgettext_iface as iface_

from .words import by_labels

LINE = 36  # length [characters] of a text in one line of a sidebar as wide as Blender opens it
CHARACTER = 5.6  # width [pixels at scale 1] of a character, rather more than less
BESIDE = 80  # width [pixels at scale 1] of the icon, the tabs and the borders beside a text


def line_length(context) -> int:
    """How many characters fit into a line of the region that is drawn."""
    if context.region is None:
        return LINE
    width = context.region.width / context.preferences.system.ui_scale
    return max(LINE, int((width - BESIDE) / CHARACTER))


def broken(text: str, width: int) -> list[str]:
    """The text in lines of at most so many characters."""
    import textwrap

    return textwrap.wrap(text, width)


def draw_note(column, text: str, icon: str, less: int = 0) -> None:
    """The whole text, broken into lines, the icon before the first; lines are ``less`` characters
    shorter than the region has room for."""
    for index, line in enumerate(broken(by_labels(text), line_length(bpy.context) - less)):
        column.label(text=line, icon="BLANK1" if index else icon, translate=False)


def pair(layout, label: str, value: str) -> None:
    """A label and its value in two columns."""
    row = layout.split(factor=0.55, align=True)
    name = row.row()
    name.alignment = "RIGHT"
    name.label(text=label)
    row.label(text=value, translate=False)


def draw_more(layout, number: int, most: int) -> None:
    """Say how many names are not shown."""
    if number > most:
        layout.label(
            text=iface_("and {:d} more").format(number - most), icon="BLANK1", translate=False
        )
