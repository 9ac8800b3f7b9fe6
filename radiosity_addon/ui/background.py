"""A timer takes the steps of a bake until there is something to write, or a failure to report.

No operator runs meanwhile: Blender saves no file by itself (auto-save) while one runs modally. The
bake operator is invoked at the end, as only an operator makes an undo step and reports.
"""

from __future__ import annotations

import time

import bpy

from . import session
from .open_windows import find_window
from .progress_bar import progress_text, redraw

TICK = 0.05  # time [s] between two looks at the solver
AT_WORK = 0.005  # time [s] between two steps of reading or writing, for Blender's events
REDRAW = 0.25  # time [s] between two pictures of the progress: each draws the window anew
# Factor [time that a picture took] to the next one: where drawing is slow the work goes on.
REST = 4


class Ticker:
    """The timer of one bake: Blender calls it again after as many seconds as it returns."""

    def __init__(self, bake, window: int | None, given: dict) -> None:
        self._bake, self._window, self._given = bake, window, given
        self._progress = Progress()

    def __call__(self) -> float | None:
        bake = self._bake
        with bpy.context.temp_override(window=find_window(self._window)):
            if session.current() is not bake:  # canceled
                redraw(bpy.context)
                return None
            self._step()
            if bake.wants_operator:
                bpy.ops.radiosity.bake("INVOKE_DEFAULT", **self._given)
                return None
            self._progress.show(bpy.context, bake)
        waiting = bake.state in (session.State.SOLVE, session.State.WAIT)
        return TICK if waiting else AT_WORK

    def _step(self) -> None:
        try:
            self._bake.step(bpy.context)
        except Exception as error:  # noqa: BLE001  reported by the operator
            self._bake.failure = error


class Progress:
    """Brings the progress bars up to date, if they changed and not too often."""

    def __init__(self) -> None:
        self._shown, self._next = "", 0.0
        self._drawn: float | None = None  # when the last picture was asked for, until it is there

    def show(self, context, bake) -> None:
        now, text = time.perf_counter(), progress_text(bake)
        if self._drawn is not None:
            self._next = max(self._next, now + REST * (now - self._drawn))
            self._drawn = None
        if text != self._shown and now >= self._next:
            self._shown, self._next, self._drawn = text, now + REDRAW, now
            redraw(context)


def carry_on(window, given: dict) -> None:
    """Take the steps of the current bake from now on. ``given``: the operator's keywords. All is drawn anew once before the
    first step: so the pace knows how long that takes here."""
    bpy.data.batch_remove(())  # removes nothing, and has Blender draw what steps have it draw: what stands still is a copy
    session.current().await_drawing()
    ticker = Ticker(session.current(), window and window.as_pointer(), given)
    bpy.app.timers.register(ticker, first_interval=0.0)


def press(window: int | None, given: dict) -> None:
    """Press the Bake button, with these keywords. Nothing happens where it is gray."""
    with bpy.context.temp_override(window=find_window(window)):
        if bpy.ops.radiosity.bake.poll():
            bpy.ops.radiosity.bake("INVOKE_DEFAULT", **given)
