"""One bake from the first export to the last write, cut into steps that a timer takes.

The scene is read and written here, in Blender's main thread; the light is solved in a process of
its own. Between two steps nothing of Blender's is held but names and session ids.
"""

from __future__ import annotations

import importlib
import time
from dataclasses import replace
from enum import Enum
from pathlib import Path

from ..bake.uv_maps import give_maps
from ..settings import Settings
from ..solver.expected import Refused
from ..steps import scaled
from .changed_objects import follow
from .keep_file import NAME, forget_kept
from .pace import Pace
from .payload import PACKAGE

# Shares [of the progress bar] from and to which the solver has it.
SOLVE_FROM, SOLVE_TO = 0.05, 0.97
# What reading and writing import, in pieces. SciPy and embreex are the solver's process's alone.
IMPORTS = ("bake.texels", "bake.unwrap", "export.shaders", "export.material_slots", "export.light_objects",
           "export.world", "export.evaluated", "export.pipeline", "stages.prepare",
           "stages.apply", "report")
_pace = Pace()


class State(Enum):
    """Where a bake is."""

    START = "Starting"
    EXPORT = "Reading the scene"
    SOLVE = "Solving"
    WAIT = "Waiting: leave Edit Mode"
    WRITE = "Writing the colors"
    DONE = "Done"


class BakeSession:
    """A bake under way. ``step`` until ``state`` is DONE, or ``cancel``; both leave no files.

    ``report`` is there once it is done. Whatever ``step`` raises has been cleaned up after.
    """

    def __init__(self, scene_name: str, settings: Settings, pace: Pace = _pace) -> None:
        self.scene_name = scene_name
        self.settings = settings
        self._pace = pace
        pace.restart()
        self.state = State.START
        self.detail = ""  # the solver's own word for what it does
        self.fraction = 0.0
        self.report: dict | None = None
        self.failure: Exception | None = None  # of a step that a timer took, for the operator to report
        self._start = time.perf_counter()
        self._export_seconds = 0.0
        self._process = None  # a SolverProcess, from the first step on
        self._steps = None  # of reading or writing, while they are taken
        self._job = self._result = None
        self._peak_memory, self._reused = 0, ""
        self._maps: list = []

    @property
    def wants_operator(self) -> bool:
        """Whether the timer's part is over: what is left to write or to report is an operator's."""
        return self.failure is not None or self.state is State.WRITE

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self._start

    @property
    def seconds_left(self) -> float | None:
        """A guess from the fraction done; None while there is too little to judge by."""
        if self.fraction < 2 * SOLVE_FROM or self.elapsed < 1.0:
            return None
        return self.elapsed * (1 - self.fraction) / self.fraction

    def step(self, context) -> None:
        """Take the next step; the longest is the one evaluation of the scene for rendering."""
        try:
            if self.state is State.SOLVE:
                self._watch()
            elif self.state is State.WAIT:
                self._await_object_mode()
            elif self.state is not State.DONE:
                self._take_steps(context)
        except BaseException:
            self.cancel()
            raise

    def await_drawing(self) -> None:
        """The window is about to be drawn, before the first step."""
        self._pace.await_drawing()

    def wait(self, seconds: float) -> None:
        """Sleep until the solver's process ends, at most ``seconds``: for those who may block."""
        if self.state is State.SOLVE:
            self._process.wait(seconds)

    def cancel(self) -> None:
        """End the solver's process and remove its files; the scene is as it was."""
        if self._steps is not None:
            self._steps.close()
            self._steps = None
        self._result = None  # which lies in the process's files
        if self._process is not None:
            self._process.close()
            self._process = None

    def _take_steps(self, context) -> None:
        """Pieces of reading or of writing, as many as the pace allows; at least one."""
        if self._steps is None:
            reading = self.state is State.START
            self._steps = self._read(context) if reading else self._write(context)
            if not reading:
                self._pace.restart()
        self._pace.begin()
        state = self.state
        for self.fraction in self._steps:
            if self._pace.enough() or self.state is not state:  # the window shows the new one
                return
        self._steps = None
        if self.state is State.DONE:
            self.cancel()

    def _read(self, context):
        """From the start of the process to the job in its hands, in steps."""
        from .solver_process import SolverProcess

        scene, view_layer = context.scene, context.view_layer
        self._process = SolverProcess(kept_file())
        yield 0.0
        for name in IMPORTS:
            importlib.import_module(f"{PACKAGE}.{name}")
            yield 0.0
        from ..stages.prepare import prepare_steps

        self.state = State.EXPORT
        yield 0.0
        before = self.elapsed
        reading = prepare_steps(scene, view_layer, self.settings)
        self._job, self._maps = yield from scaled(0.0, SOLVE_FROM, reading)
        self._export_seconds = self.elapsed - before
        self._process.give(self._job)
        self.state, self.fraction = State.SOLVE, SOLVE_FROM

    def _watch(self) -> None:
        self.detail, fraction = self._process.progress()
        share = SOLVE_FROM + (SOLVE_TO - SOLVE_FROM) * min(max(fraction, 0.0), 1.0)
        self.fraction = max(self.fraction, share)
        if self._process.finished():
            self._result, self._peak_memory, self._reused = self._process.result()
            self._await_object_mode()

    def _await_object_mode(self) -> None:
        """On to WRITE, but not while an object to be written is edited."""
        self.detail = follow(self._job, self._result).in_edit_mode
        self.state = State.WAIT if self.detail else State.WRITE

    def _write(self, context):
        """From the result to the report, in steps."""
        from ..report import build_report
        from ..stages.apply import apply_steps, find_encoding

        followed, before = follow(self._job, self._result), self.elapsed
        give_maps(self._maps)
        encoding = find_encoding(followed.job, followed.result)
        writing = apply_steps(context, followed.job, followed.result, encoding=encoding)
        warnings = yield from scaled(SOLVE_TO, 1.0, writing)
        result = replace(followed.result, warnings=(*followed.result.warnings, *warnings))
        seconds = {
            "export": self._export_seconds,
            "write": self.elapsed - before + self._result.seconds.get("fit", 0.0),
            "total": self.elapsed,
        }
        report = build_report(followed.job, result, seconds, self._peak_memory, encoding)
        self.report = {**report, "reused": self._reused}
        self.state, self.fraction = State.DONE, 1.0


def kept_file() -> Path:
    """Where this session of Blender keeps solves for the next bake."""
    import bpy

    return Path(bpy.app.tempdir) / NAME


def undone() -> None:
    """An undo is about to replace the whole file: end a bake that is half written into it."""
    if _current is not None and _current.state is State.WRITE:
        end()


def forget() -> None:
    """End the current bake, and remove what is kept for the next."""
    end()
    forget_kept(kept_file())


_current: BakeSession | None = None


def current() -> BakeSession | None:
    """The bake under way, if there is one: the panels draw it, Cancel ends it."""
    return _current


def begin(session: BakeSession) -> None:
    """Make ``session`` the current one. Raises Refused while another one is."""
    global _current
    if _current is not None:
        raise Refused("a bake is running already; wait for it or cancel it")
    _current = session


def end() -> None:
    """Cancel the current bake, if any, and forget it."""
    global _current
    if _current is not None:
        _current.cancel()
        _current = None
