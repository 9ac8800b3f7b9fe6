"""Before the bake: what will be baked, what will not and why, how long and how much. bpy.

The estimate scales the last bake's report where the scene has one; the constants for the first
bake are the order of what a laptop of two cores takes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import bpy
from bpy.app.translations import pgettext_iface as iface_

from ..bake.windows import own_size
from ..memory import ALWAYS, available_memory, fitting_edge, of_a_bake, of_images
from ..settings import QUALITY_ERROR
from . import words
from .choice import sharing_objects, survey
from .enum_items import CUSTOM
from .open_windows import find_window
from .progress_bar import redraw
from .report_store import load_report

MOST_SHOWN = 8  # number [names] in the panel
COVERED = 0.6  # share [of an image's texels], as a rule
FIRST_SECONDS = 0.4  # time [s] that the start of the solver's process takes
RATE = 20_000.0  # speed [receivers per s] at 3 % error
LONGEST = 2.0  # time [s] that a list is shown before another look at the free memory
PAUSE = 0.3  # time [s] from a change to the next list: rarer lists leave more time for the edit
ASKED = ("target", "objects_from", "resolution", "quality", "error", "use_time_limit",
         "time_limit", "uv_map", "height", "use_atlas", "atlas_images",
         "density")  # fmt: skip
POWER = 1.2  # exponent [of the error] by which time grows


@dataclass(frozen=True)
class Preflight:
    """The list before the bake; estimates are orders of magnitude."""

    baked: tuple[str, ...]
    left_out: tuple[tuple[str, str], ...]  # (object, reason)
    seconds: float
    bytes: float
    free: float | None = None  # bytes that may still be taken; None where unknown
    sharing: tuple[str, ...] = ()  # objects whose mesh others among the chosen have too
    edge: int = 0  # texels along an image's lower edge that would fit; 0: no images, or none would

    @property
    def problems(self) -> tuple[str, ...]:
        """What will not fit; empty when all will."""
        if self.free is None or self.bytes <= self.free:
            return ()
        sizes = words.size(self.bytes), words.size(self.free)
        if self.edge:
            text = iface_("Needs about {} of memory, {} are free: {} texels would fit, or fewer objects")
            return (text.format(*sizes, self.edge),)
        text = iface_("Needs about {} of memory, {} are free: lower the resolution or bake less")
        return (text.format(*sizes),)


@dataclass
class _LastLook:
    """The list as it was last made."""

    plan: Preflight
    basis: tuple  # the settings it was made with
    checked: float  # when the free memory was looked at [s]
    stale: bool = False  # whether something of the file has changed since
    window: int | None = None  # address of the window it is drawn in


_last: _LastLook | None = None


def preflight_to_draw(context, longest: float = LONGEST) -> Preflight:
    """The list of the last look. A look takes 7 ms for 1,000 objects and more, so where something
    has changed a timer takes another soon, and not while an animation plays. The free memory is looked at again
    after ``longest`` seconds."""
    global _last
    basis = _basis(context)
    if _last is None or (bpy.app.background and (_last.stale or _last.basis != basis)):
        _last = _LastLook(preflight(context), basis, time.monotonic())
    playing = context.screen is not None and context.screen.is_animation_playing
    if (_last.stale or _last.basis != basis) and not playing:
        _last.window = context.window.as_pointer()
        if not bpy.app.timers.is_registered(_look):
            bpy.app.timers.register(_look, first_interval=PAUSE)
    elif time.monotonic() - _last.checked > longest:
        _last.checked = time.monotonic()
        _last.plan = replace(_last.plan, free=available_memory())
    return _last.plan


def _basis(context) -> tuple:
    properties = context.scene.radiosity
    return (context.scene.session_uid, context.view_layer.name, len(properties.report),
            *(str(getattr(properties, name)) for name in ASKED))  # fmt: skip


def _look() -> None:
    """Make the list anew, and have it drawn."""
    global _last
    if _last is not None:
        with bpy.context.temp_override(window=find_window(_last.window)):
            context = bpy.context
            _last = _LastLook(preflight(context), _basis(context), time.monotonic())
            redraw(context)


@bpy.app.handlers.persistent
def outdate(*_) -> None:
    """Something of the file changed."""
    if _last is not None:
        _last.stale = True


def forget() -> None:
    """The add-on is going away."""
    global _last
    _last = None
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)


def preflight(context) -> Preflight:
    """Look at the chosen objects, changing nothing."""
    properties = context.scene.radiosity
    baked, skipped, receivers, largest = [], [], 0, 0
    for item, reason in survey(context):
        if reason:
            skipped.append((item.name, reason))
        else:
            baked.append(item.name)
            receivers += _receivers(item, properties)
            largest = max(largest, _receivers(item, properties))
    if properties.target == "IMAGE" and properties.use_atlas:
        receivers = _atlas_texels(context, baked)
        largest = min(receivers, _texels(_size(properties)))
    triangles = sum(
        len(item.data.polygons) * 2 for item in context.view_layer.objects if item.type == "MESH"
    )
    free, edge = available_memory(), 0
    needed = ALWAYS + of_a_bake(receivers, triangles)
    if properties.target == "IMAGE":
        texels = receivers / COVERED, largest / COVERED, triangles
        needed = ALWAYS + of_images(*texels)
        if free is not None:
            edge = fitting_edge(properties.resolution, free - ALWAYS, *texels)
    return Preflight(
        baked=tuple(baked),
        left_out=tuple(skipped),
        seconds=_seconds(properties, load_report(context.scene), receivers),
        bytes=needed,
        free=free,
        sharing=_sharing(context),
        edge=edge,
    )


def _sharing(context) -> tuple[str, ...]:
    return tuple(item.name for item in sharing_objects(context))


def _receivers(item, properties) -> float:
    if properties.target == "IMAGE":
        return _texels(_own_size(item, properties))
    return len(item.data.loops)


def _atlas_texels(context, baked: list[str]) -> float:
    """As many as the images have; with a density those of the objects' bounding boxes, if less."""
    properties = context.scene.radiosity
    most = _texels(_size(properties)) * min(properties.atlas_images, len(baked))
    if not properties.density or properties.uv_map.strip():
        return most
    area = 0.0
    for name in baked:
        x, y, z = bpy.data.objects[name].dimensions
        area += 2 * (x * y + y * z + z * x)
    return min(most, area * properties.density**2)


def _size(properties) -> tuple[int, int]:
    return properties.resolution, properties.height or properties.resolution


def _own_size(item, properties) -> tuple[int, int]:
    try:
        return own_size(item, _size(properties))
    except ValueError:
        return _size(properties)


def _texels(size: tuple[int, int]) -> float:
    return COVERED * size[0] * size[1]


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
