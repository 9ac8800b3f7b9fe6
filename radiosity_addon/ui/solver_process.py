"""The solver's process: started, watched and ended from Blender without waiting for it. No bpy.

Extensions may not start threads beside Blender's main thread, so the long middle stage of a bake
runs in a process of its own: Blender's own Python on ``worker.py``. All it needs and gives lies in
a temporary folder that goes away with it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..libraries import environment
from ..solver.expected import Refused
from . import worker
from .payload import read_payload, write_payload

PATIENCE = 0.5  # time [s] between asking the process to end and ending it
ERRORS = "errors"  # the file that takes standard output and error
FULL = 2**20  # room [bytes] on a disk, below which it is taken for full
LAST_LINES = 3  # number [lines] of the process's last words that are shown


class SolverFailed(Refused):
    """The solver's process ended without a result; the message says why and what to do."""


class SolverProcess:
    """One job in a process of its own, which starts before the job is there: to import SciPy takes
    as long as to read a scene.

    ``finished()`` and ``progress()`` return at once; ``result()`` after the end. ``close()`` ends
    the process if it runs and removes its files; it may be called twice. ``keep`` is the file that
    keeps solves between bakes, or None.
    """

    def __init__(self, keep: Path | None = None, python: str = sys.executable) -> None:
        """Raises OSError or SolverFailed when it cannot be started."""
        self._process = None
        self._folder = Path(tempfile.mkdtemp(prefix="radiosity-"))
        try:
            self._process = self._start(python, [str(keep)] if keep is not None else [])
        except BaseException:
            self.close()
            raise

    def give(self, job) -> None:
        """Hand the job over. Raises OSError when it cannot be written."""
        write_payload(self._folder / worker.JOB, job)
        with suppress(BrokenPipeError):  # it has ended: ``result`` says why
            self._process.stdin.write(b"\n")
            self._process.stdin.flush()

    def _start(self, python: str, keep: list[str]) -> subprocess.Popen:
        options = {}
        if os.name == "nt":
            quiet = subprocess.CREATE_NO_WINDOW | subprocess.BELOW_NORMAL_PRIORITY_CLASS
            options["creationflags"] = quiet
        with open(self._folder / ERRORS, "wb") as errors:
            return subprocess.Popen(
                [python, "-s", worker.__file__, str(self._folder), *keep],
                stdin=subprocess.PIPE,
                stdout=errors,
                stderr=errors,
                env=_environment(),
                **options,
            )

    def progress(self) -> tuple[str, float]:
        """The phase's name and the fraction done, as the process wrote them last."""
        return worker.read_progress(self._folder / worker.PROGRESS)

    def finished(self) -> bool:
        """Whether the process has ended, in whatever way."""
        return self._process.poll() is not None

    def wait(self, seconds: float) -> bool:
        """Wait for the end, at most ``seconds``; whether it came."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    def result(self):
        """The job's Result, the process's peak memory [bytes], and what of an earlier bake was used
        again ("", "solution" or "transport"). The Result's colors are read from the process's
        files when they are used: before ``close``. Raises SolverFailed."""
        status = self._process.poll()
        if status is None:
            raise SolverFailed("the solver is still running; wait for it to finish")
        if status == 0:
            result, count, *rest = read_payload(self._folder / worker.RESULT)
            paths = [self._folder / f"{worker.COLORS}{index}.npy" for index in range(count)]
            colors = tuple(np.load(path, mmap_mode="r") for path in paths)
            return replace(result, colors=colors), *rest
        failure = self._folder / worker.FAILURE
        said = failure.read_text(encoding="utf-8") if failure.exists() else ""
        raise SolverFailed(said or self._crash(status))  # nothing where the disk had no room for words either

    def _crash(self, status: int) -> str:
        text = (self._folder / ERRORS).read_text(errors="replace")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        how = f"signal {-status}" if status < 0 else f"status {status}"
        last = " | ".join(lines[-LAST_LINES:]) or self._why_silent()
        ours = "; this is a fault of Radiosity, please report it" if status == worker.FAILED and lines else ""
        return f"the solver's process stopped ({how}): {last}{ours}"

    def _why_silent(self) -> str:
        """What is left to look at where the process said nothing."""
        folder = self._folder.parent
        if shutil.disk_usage(folder).free < FULL:
            return f"the disk of {folder} is full, where temporary files go: free some space there"
        return "it said nothing; memory may have run out"

    def close(self) -> None:
        """End the process and remove its files. Takes at most ``PATIENCE`` and a little."""
        if self._process is not None:
            if self._process.poll() is None:
                self._process.terminate()
                if not self.wait(PATIENCE):
                    self._process.kill()
                    self.wait(PATIENCE)
            with suppress(BrokenPipeError):
                self._process.stdin.close()
        shutil.rmtree(self._folder, ignore_errors=True)


def _environment() -> dict[str, str]:
    try:
        return environment()
    except ImportError as error:
        raise SolverFailed(str(error)) from error
