"""One bake from the first export to the last write, cut into steps that a timer takes.

The scene is read and written here, in Blender's main thread; the light is solved in a process of
its own. Between two steps nothing of Blender's is held but names and session ids.
"""

from __future__ import annotations

import time
from dataclasses import replace
from enum import Enum

from ..settings import Settings
from .follow import follow, identify
from .held_maps import give_maps, take_maps
from .solver_process import SolverProcess

# The shares of the whole that the solver's part has in the progress bar.
SOLVE_FROM, SOLVE_TO = 0.05, 0.97


class Stage(Enum):
    """Where a bake is."""

    LOAD = "Loading SciPy"
    EXPORT = "Reading the scene"
    START = "Starting the solver"
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
        self._job = self._result = None
        self._peak_memory = 0
        self._identities: dict[str, int] = {}
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
        """Take the next step; each is short but the export and the final write."""
        try:
            if self.stage is Stage.LOAD:
                self._load()
            elif self.stage is Stage.EXPORT:
                self._export(context)
            elif self.stage is Stage.START:
                self._start_solver()
            elif self.stage is Stage.SOLVE:
                self._watch()
            elif self.stage in (Stage.WAIT, Stage.WRITE):
                self._write(context)
        except BaseException:
            self.cancel()
            raise

    def wait(self, seconds: float) -> None:
        """Sleep until the solver's process ends, at most ``seconds``: for those who may block."""
        if self._process is not None:
            self._process.wait(seconds)

    def cancel(self) -> None:
        """End the solver's process and remove its files; the scene is as it was."""
        if self._process is not None:
            self._process.close()
            self._process = None

    def _load(self) -> None:
        """Import what reads the scene: a step of its own, as the first time takes a while."""
        from ..stages import prepare  # noqa: F401

        self.stage = Stage.EXPORT

    def _export(self, context) -> None:
        from ..stages.prepare import discard, prepare

        before = self.elapsed
        self._job = prepare(context, self.settings)
        self._identities = identify(target.name for target in self._job.targets)
        self._maps = take_maps(self._job.made_uv_maps)
        discard(context, self._job)
        self._export_seconds = self.elapsed - before
        self.stage, self.fraction = Stage.START, SOLVE_FROM

    def _start_solver(self) -> None:
        self._process = SolverProcess(self._job)
        self.stage = Stage.SOLVE

    def _watch(self) -> None:
        self.detail, fraction = self._process.progress()
        share = SOLVE_FROM + (SOLVE_TO - SOLVE_FROM) * min(max(fraction, 0.0), 1.0)
        self.fraction = max(self.fraction, share)
        if self._process.finished():
            self._result, self._peak_memory = self._process.result()
            self.cancel()
            self.stage, self.detail = Stage.WRITE, ""

    def _write(self, context) -> None:
        from ..files import Publication
        from ..report import build_report
        from ..stages.apply import apply

        followed = follow(self._job, self._result, self._identities)
        if followed.in_edit_mode:
            self.stage, self.detail = Stage.WAIT, followed.in_edit_mode
            return
        before = self.elapsed
        give_maps(self._maps)
        with Publication() as publication:
            told = apply(context, followed.job, followed.result, publication=publication)
            publication.commit()
        result = replace(followed.result, warnings=(*followed.result.warnings, *told))
        seconds = {
            "export": self._export_seconds,
            "write": self.elapsed - before + self._result.seconds.get("fit", 0.0),
            "total": self.elapsed,
        }
        self.report = build_report(followed.job, result, seconds, self._peak_memory)
        self.stage, self.fraction = Stage.DONE, 1.0


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
