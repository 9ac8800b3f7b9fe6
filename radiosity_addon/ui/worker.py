"""The program of the solver's process: read a job, run it, write the result. No bpy.

Started by its path with the folder of one bake, and the file that keeps solves between bakes, as
its arguments. It imports what it needs while Blender still reads the scene, which takes seconds at
the first bake, when Python compiles it; a byte on standard input says that the job is there. When
standard input ends, Blender has ended, and this process ends, too. It writes its progress to a file of fixed
length, each target's colors into a file of its own, and renames the result last.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

# Files in the folder; COLORS is followed by the target's number.
JOB, RESULT, PROGRESS, FAILURE, COLORS = "job", "result", "progress", "failure", "colors-"
PROGRESS_LENGTH = 128  # length [bytes] of a message of progress
PROGRESS_PAUSE = 0.05  # time [s] between two writes
LOADING = "loading SciPy"  # the first phase that it reports
FAILED = 1  # code [exit status]


def main(folder: Path, keep: Path | None = None) -> int:
    """Wait for the job in ``folder`` and run it; return the exit status."""
    given = threading.Event()
    threading.Thread(target=_listen, args=(folder, given), daemon=True).start()
    _step_back()
    with ProgressFile(folder / PROGRESS) as progress:
        progress(LOADING, 0.0)
        return _work(folder, keep, given, progress)


def _work(folder: Path, keep: Path | None, given: threading.Event, progress: ProgressFile) -> int:
    """Import, wait until the job is ``given``, run it with what the file ``keep`` keeps."""
    package = _load_package(Path(__file__).resolve().parents[1])
    replicate_process = importlib.import_module(f"{package}.replicate_process")
    second = replicate_process.start_replicate_process(0)
    for name in ("bake_job", "solver.sequence"):
        importlib.import_module(f"{package}.{name}")
    return work(package, folder, keep, given, progress, second)


def work(package: str, folder: Path, keep: Path | None, given: threading.Event, progress, second) -> int:
    """Run the job in ``folder`` as soon as it is ``given``, beside the process ``second`` (or None), by what was
    imported as ``package``; return the exit status."""
    numpy = importlib.import_module("numpy")
    payload, keep_file, overall_progress, bake_job, expected, replicate_process = (
        importlib.import_module(f"{package}.{name}")
        for name in ("ui.payload", "ui.keep_file", "overall_progress", "bake_job", "solver.expected",
                     "replicate_process")
    )
    given.wait()
    try:
        kept = keep_file.read_kept(keep)
        job = payload.read_payload(folder / JOB)
        result = bake_job.run(job, overall_progress.OverallProgress(progress), kept, second)
        for index, colors in enumerate(result.colors):
            numpy.save(folder / f"{COLORS}{index}.npy", colors)
        figures = (replace(result, colors=()), len(result.colors))
        content = (*figures, replicate_process.peak_memory(second), kept.reused)
        payload.write_payload(folder / f"{RESULT}.part", content)
        os.replace(folder / f"{RESULT}.part", folder / RESULT)
        keep_file.write_kept(keep, kept)
    except expected.EXPECTED as error:  # anything else leaves a traceback on standard error
        text = str(error) or type(error).__name__
        (folder / FAILURE).write_text(text, encoding="utf-8")
        return FAILED
    return 0


class ProgressFile:
    """A progress callback that keeps one record of fixed length up to date."""

    def __init__(self, path: Path) -> None:
        self._handle = open(path, "wb", buffering=0)
        self._next = 0.0

    def __enter__(self) -> ProgressFile:
        return self

    def __exit__(self, *_) -> None:
        self._handle.close()

    def __call__(self, phase: str, fraction: float) -> None:
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + PROGRESS_PAUSE
        text = f"{fraction:.4f} {phase}".encode()[: PROGRESS_LENGTH - 1]
        self._handle.seek(0)
        self._handle.write(text.ljust(PROGRESS_LENGTH - 1) + b"\n")


def read_progress(path: Path) -> tuple[str, float]:
    """The phase and fraction last written, or ("", 0.0) before the first."""
    try:
        record = path.read_bytes()
    except FileNotFoundError:
        return "", 0.0
    if len(record) < PROGRESS_LENGTH:
        return "", 0.0
    fraction, _, phase = record.decode(errors="replace").strip().partition(" ")
    return phase, float(fraction)


def _load_package(folder: Path) -> str:
    """Import the package in ``folder`` under its short name, and return that."""
    name = folder.name
    spec = importlib.util.spec_from_file_location(
        name, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])
    return name


def _step_back() -> None:
    """Leave the cores to Blender's interface when it wants them."""
    if hasattr(os, "nice"):
        os.nice(10)


def _listen(folder: Path, given: threading.Event) -> None:
    """Tell when the job is there; at the end of standard input remove the folder and end this
    process."""
    while os.read(0, 1):
        given.set()
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(FAILED)


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
