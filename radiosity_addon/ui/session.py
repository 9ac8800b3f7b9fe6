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
from .follow import follow
from .keep_file import NAME, forget_kept
from .solver_process import SolverProcess

# The shares of the whole that the solver's part has in the progress bar.
SOLVE_FROM, SOLVE_TO = 0.05, 0.97
BUDGET = 0.03  # seconds of reading in one step: a piece that takes longer has one of its own
# What reading imports, in pieces: all of SciPy's sparse matrices at once take half a second.
LIBRARIES = ("numpy.testing", "numpy.f2py", "scipy", "scipy.linalg", "scipy.sparse",
             "scipy.sparse.linalg", "scipy.sparse.csgraph")  # fmt: skip


class Stage(Enum):
    """Where a bake is."""

    LOAD = "Loading SciPy"
    EXPORT = "Reading the scene"
    SOLVE = "Solving"
    WAIT = "Waiting: leave Edit Mode"
    WRITE = "Writing the colors"
    DONE = "Done"


class BakeSession:
    """A bake under way. ``step`` until ``stage`` is DONE, or ``cancel``; both leave no files.

    ``report`` is there once it is done. Whatever ``step`` raises has been cleaned up after.
    """

    def __init__(self, scene_name: str, settings: Settings) -> None:
        self.scene_name = scene_name
        self.settings = settings
        self.stage = Stage.LOAD
        self.detail = ""  # the solver's own word for what it does
        self.fraction = 0.0
        self.report: dict | None = None
        self._start = time.perf_counter()
        self._export_seconds = 0.0
        self._process: SolverProcess | None = None
        self._reading = None  # the steps before the solve
        self._job = self._result = None
        self._peak_memory, self._reused = 0, ""
        self._maps: list = []

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
        """Take the next step; the longest are one evaluation of the scene and the final write."""
        try:
            if self.stage in (Stage.LOAD, Stage.EXPORT):
                self._read_on(context)
            elif self.stage is Stage.SOLVE:
                self._watch()
            elif self.stage in (Stage.WAIT, Stage.WRITE):
                self._write(context)
        except BaseException:
            self.cancel()
            raise

    def wait(self, seconds: float) -> None:
        """Sleep until the solver's process ends, at most ``seconds``: for those who may block."""
        if self.stage is Stage.SOLVE:
            self._process.wait(seconds)

    def cancel(self) -> None:
        """End the solver's process and remove its files; the scene is as it was."""
        if self._reading is not None:
            self._reading.close()
            self._reading = None
        if self._process is not None:
            self._process.close()
            self._process = None

    def _read_on(self, context) -> None:
        """Pieces of reading that take about ``BUDGET`` together."""
        if self._reading is None:
            self._reading = self._read(context.scene, context.view_layer)
        end = time.perf_counter() + BUDGET
        for fraction in self._reading:
            self.fraction = SOLVE_FROM * fraction
            if time.perf_counter() >= end:
                return
        self._reading = None

    def _read(self, scene, view_layer):
        """From the start of the process to the job in its hands, in steps."""
        self._process = SolverProcess(kept_file())
        yield 0.0
        for name in LIBRARIES:
            importlib.import_module(name)
            yield 0.0
        from ..stages.prepare import prepare_steps

        self.stage = Stage.EXPORT
        yield 0.0
        before = self.elapsed
        self._job, self._maps = yield from prepare_steps(scene, view_layer, self.settings)
        self._export_seconds = self.elapsed - before
        self._process.give(self._job)
        self.stage, self.fraction = Stage.SOLVE, SOLVE_FROM

    def _watch(self) -> None:
        self.detail, fraction = self._process.progress()
        share = SOLVE_FROM + (SOLVE_TO - SOLVE_FROM) * min(max(fraction, 0.0), 1.0)
        self.fraction = max(self.fraction, share)
        if self._process.finished():
            self._result, self._peak_memory, self._reused = self._process.result()
            self.cancel()
            self.stage, self.detail = Stage.WRITE, ""

    def _write(self, context) -> None:
        from ..report import build_report
        from ..stages.apply import apply

        followed = follow(self._job, self._result)
        if followed.in_edit_mode:
            self.stage, self.detail = Stage.WAIT, followed.in_edit_mode
            return
        before = self.elapsed
        give_maps(self._maps)
        told = apply(context, followed.job, followed.result)
        result = replace(followed.result, warnings=(*followed.result.warnings, *told))
        seconds = {
            "export": self._export_seconds,
            "write": self.elapsed - before + self._result.seconds.get("fit", 0.0),
            "total": self.elapsed,
        }
        report = build_report(followed.job, result, seconds, self._peak_memory)
        self.report = {**report, "reused": self._reused}
        self.stage, self.fraction = Stage.DONE, 1.0


def kept_file() -> Path:
    """Where this session of Blender keeps solves for the next bake."""
    import bpy

    return Path(bpy.app.tempdir) / NAME


def forget() -> None:
    """End the current bake, and remove what is kept for the next."""
    end()
    forget_kept(kept_file())


_current: BakeSession | None = None


def current() -> BakeSession | None:
    """The bake under way, if there is one: the panels draw it, Cancel ends it."""
    return _current


def begin(session: BakeSession) -> None:
    """Make ``session`` the current one. Raises RuntimeError while another one is."""
    global _current
    if _current is not None:
        raise RuntimeError("a bake is running already; wait for it or cancel it")
    _current = session


def end() -> None:
    """Cancel the current bake, if any, and forget it."""
    global _current
    if _current is not None:
        _current.cancel()
        _current = None
