"""Lines of text that panels have in common."""

from bpy.app.translations import pgettext_iface as iface_

LINE = 44  # length [characters] of a text in one line of the panel


def broken(text: str, width: int = LINE) -> list[str]:
    """The text in lines that fit a sidebar."""
    import textwrap

    return textwrap.wrap(text, width)


def draw_note(column, text: str, icon: str, width: int = LINE) -> None:
    """The whole text, broken into lines, the icon before the first."""
    for index, line in enumerate(broken(text, width)):
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
