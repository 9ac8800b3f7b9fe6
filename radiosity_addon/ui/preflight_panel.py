"""Before the Bake: the list beside the button, open and red when something will not fit."""

from . import words
from .lines import draw_more, draw_note, pair
from .preflight import MOST_SHOWN, preflight_to_draw

FITS, FITS_NOT = "radiosity_fits", "radiosity_fits_not"  # each is opened and closed for itself
INDENT = 2  # width [characters] of the indent of a list


def draw_preflight(layout, context) -> None:
    """The list, which is closed until it is opened; where something will not fit, the other way
    round, and what it is stands in red in any case."""
    plan = preflight_to_draw(context)
    problems = plan.problems
    header, body = layout.panel(FITS_NOT if problems else FITS, default_closed=not problems)
    header.alert = bool(problems)
    header.label(text="Before the Bake", icon="ERROR" if problems else "NONE")
    red = layout.column(align=True) if body is None else body.column(align=True)
    red.alert = True
    for text in problems:
        draw_note(red, text, "BLANK1", INDENT)
    if body is not None:
        _draw_list(body.column(align=True), plan)


def _draw_list(column, plan) -> None:
    pair(column, "Objects", words.count(len(plan.baked)))
    for name in plan.baked[:MOST_SHOWN]:
        column.label(text=name, icon="CHECKMARK", translate=False)
    draw_more(column, len(plan.baked), MOST_SHOWN)
    if plan.left_out:
        column.separator()
        pair(column, "Left Out", words.count(len(plan.left_out)))
        for name, reason in plan.left_out[:MOST_SHOWN]:
            draw_note(column, f"{name}: {reason}", "X")
        draw_more(column, len(plan.left_out), MOST_SHOWN)
    column.separator()
    pair(column, "Time, about", words.duration(plan.seconds))
    pair(column, "Memory, about", words.size(plan.bytes))
    if plan.sharing:
        column.separator()
        pair(column, "Sharing a Mesh", words.count(len(plan.sharing)))
        column.operator("radiosity.single_user", icon="DUPLICATE")
