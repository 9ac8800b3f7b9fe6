"""Before the bake: what will be baked, what will not and why, how long and how much. bpy.

The estimate scales the last bake's report where the scene has one; the constants for the first
bake are the order of what a laptop of two cores takes.
"""

from __future__ import annotations

from dataclasses import dataclass

from .choice import survey
from .properties import CUSTOM
from .report_store import load_report
from ..memory import ALWAYS, of_a_bake
from ..settings import QUALITY_ERROR

MOST_SHOWN = 8  # names in the panel
COVERED = 0.6  # of an image's texels, as a rule
FIRST_SECONDS = 0.4  # start of the solver's process
RATE = 20_000.0  # receivers a second at 3 % error
POWER = 1.2  # time grows like error to this power


@dataclass(frozen=True)
class Preflight:
    """The list before the bake; estimates are orders of magnitude."""

    baked: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]  # (object, reason)
    seconds: float
    bytes: float


def preflight(context) -> Preflight:
    """Look at the chosen objects, changing nothing. Cheap enough for a panel's redraw."""
    properties = context.scene.radiosity
    baked, skipped, receivers = [], [], 0
    for item, reason in survey(context):
        if reason:
            skipped.append((item.name, reason))
        else:
            baked.append(item.name)
            receivers += _receivers(item, properties)
    triangles = sum(
        len(item.data.polygons) * 2 for item in context.view_layer.objects if item.type == "MESH"
    )
    return Preflight(
        baked=tuple(baked),
        left_out=tuple(skipped),
        seconds=_seconds(properties, load_report(context.scene), receivers),
        bytes=ALWAYS + of_a_bake(receivers, triangles),
    )


def _receivers(item, properties) -> float:
    if properties.target == "IMAGE":
        return COVERED * properties.resolution**2
    return len(item.data.loops)


def target_error(properties) -> float:
    """The relative error that the properties ask for."""
    if properties.quality == CUSTOM:
        return properties.error
    return QUALITY_ERROR[properties.quality.lower()]


def _seconds(properties, last: dict | None, receivers: float) -> float:
    """Time grows with the receivers and shrinks with the error; the last bake sets the scale."""
    error = target_error(properties)
    if last is None or not last["receivers"]:
        seconds = FIRST_SECONDS + receivers / RATE * (0.03 / error) ** POWER
    else:
        more = max(receivers / last["receivers"], 0.1)
        seconds = last["seconds"]["total"] * more * (last["target_error"] / error) ** POWER
    limit = properties.time_limit if properties.use_time_limit else float("inf")
    return min(max(seconds, FIRST_SECONDS), limit + FIRST_SECONDS)
