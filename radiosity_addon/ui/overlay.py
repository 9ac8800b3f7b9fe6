"""The bake drawn over the viewport, with no material in between, as the display shows light. bpy.

Drawn in a canvas of its own with a depth buffer of its own, several samples a pixel: what the
viewport draws has moved pixels for smooth edges. Meshes are read in a timer, when something
changed, as drawing may be asked for while Blender's data are in use.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from .display import table_of, view_of
from .overlay_pieces import asked, pieces_of

# Number [samples of a canvas], 8 bytes each: four a pixel on a display of 4K.
MOST_SAMPLES = 36_000_000
SAMPLES = {"OFF": 1, "FXAA": 2, "5": 2, "8": 2, "11": 3, "16": 3, "32": 3}  # along a pixel's edge


@dataclass
class Shown:
    """What one 3D View shows."""

    pieces: dict = field(default_factory=dict)  # {session id: Piece}
    batches: dict = field(default_factory=dict)  # {session id: (Piece, batch)}, on the card
    changed: set | None = None  # session ids of what is to be read again; None: all
    fresh: bool = False  # whether nothing is to be read
    asked: tuple = ()  # the settings it was read with
    view: tuple = ()  # of the table
    table: object = None  # array, then texture
    canvases: dict = field(default_factory=dict)  # {region's address: GPUOffScreen}


_spaces: dict[int, Shown] = {}  # by the space's address
_handle = None


def add(space) -> None:
    """Show the bake in this viewport from now on."""
    global _handle
    _spaces[space.as_pointer()] = Shown()
    if _handle is None:
        _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")


def remove(space) -> None:
    """Show it no more in this viewport; nothing happens if it was not shown."""
    _spaces.pop(space.as_pointer(), None)
    if not _spaces:
        clear()


def clear() -> None:
    """Draw nothing anywhere, and take the handler away."""
    global _handle
    from . import overlay_shaders

    _spaces.clear()
    if _handle is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
        _handle = None
    if bpy.app.timers.is_registered(refresh):
        bpy.app.timers.unregister(refresh)
    overlay_shaders.forget()


@bpy.app.handlers.persistent
def outdate(*_) -> None:
    """Anything may have changed: all is read again before it is drawn next."""
    for shown in _spaces.values():
        shown.changed, shown.fresh = None, False
    if _spaces:
        _wake()


@bpy.app.handlers.persistent
def follow(scene, depsgraph=None) -> None:
    """After an edit: note what has another shape or other colors. Moves are seen anyway."""
    if not _spaces or depsgraph is None:
        return
    for update in depsgraph.updates:
        plain = isinstance(update.id, bpy.types.Object) and not update.is_updated_geometry
        if plain and update.is_updated_transform:
            continue
        for shown in _spaces.values():
            shown.fresh = False
            if shown.changed is not None and update.is_updated_geometry:
                shown.changed.add(update.id.original.session_uid)


def _wake() -> None:
    if not bpy.app.timers.is_registered(refresh):
        bpy.app.timers.register(refresh, first_interval=0.0)


def refresh() -> None:
    """Read what changed, for every viewport on a screen, and have it drawn."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            shown = _spaces.get(area.spaces.active.as_pointer()) if area.type == "VIEW_3D" else None
            if shown is not None:
                with bpy.context.temp_override(window=window, area=area):
                    _read(bpy.context, shown)
                area.tag_redraw()


def _read(context, shown: Shown) -> None:
    properties, view = context.scene.radiosity, view_of(context.scene)
    depsgraph = context.evaluated_depsgraph_get()  # may evaluate, and so call ``follow``
    changed, shown.changed, shown.fresh = shown.changed, set(), True
    shown.asked = asked(properties)
    shown.pieces = pieces_of(context.view_layer, depsgraph, properties, shown.pieces, changed)
    if shown.view != view:
        shown.view = view  # first, so that what fails is not tried again and again
        shown.table = table_of(view)


def _draw() -> None:
    context = bpy.context
    shown = _spaces.get(context.space_data.as_pointer())
    if shown is None:
        return
    if shown.table is not None:
        from .overlay_canvas import draw

        draw(context, shown, samples(context))
    wanted = asked(context.scene.radiosity), view_of(context.scene)
    if not shown.fresh or (shown.asked, shown.view) != wanted:
        _wake()


def samples(context) -> int:
    """Samples along a pixel's edge, by the viewport's own setting and the canvas's size."""
    number = SAMPLES.get(context.preferences.system.viewport_aa, 2)
    pixels = context.region.width * context.region.height
    while number > 1 and pixels * number**2 > MOST_SAMPLES:
        number -= 1
    return number
