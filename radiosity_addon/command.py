"""The headless bake: open, prepare, run, apply, save, report. Imports bpy once words are read."""

from __future__ import annotations

import errno
import os
import sys
import time
import traceback
from contextlib import ExitStack, nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

from . import arguments, files, memory
from .interrupt import INTERRUPTED, Interrupts
from .overall_progress import OverallProgress
from .replicate_process import peak_memory, start_replicate_process
from .request_files import (
    BLEND_MAGIC,
    check_destinations,
    check_input,
    open_scene,
    output_of,  # fmt: skip
)
from .solver.expected import EXPECTED
from .solver.workers.parallel import BLAS_ENVIRONMENT
from .temporary_folders import TemporaryFolders
from .terminal import Terminal, debugging

DONE, FAILED = 0, 1  # codes [exit status]
PLAIN, ZSTANDARD, _ = BLEND_MAGIC
LAST_BLOCK, SEEK_TABLE_END = b"ENDB", b"\xb1\xea\x92\x8f"  # of a plain and a compressed .blend
TAIL = 64  # length [bytes] of the end of a file: enough for the head of the last block
SHARES = {"prepare": (0.0, 0.1), "run": (0.1, 0.95), "apply": (0.95, 1.0)}  # of the whole


def main(argv: list[str], opened: bool = False, alone: bool = False) -> int:
    """Run one bake and return the exit status: 0 done, 1 failed, 2 wrong usage, 130 interrupted.

    ``opened``: Blender has a file open, which is baked when ``argv`` names none. ``alone``: the
    process is there for this bake only; when interrupted it ends here, as Blender would take long.
    """
    try:
        request = arguments.parse(argv, opened)
    except SystemExit as stop:
        return int(stop.code or 0)
    os.environ.update(BLAS_ENVIRONMENT)
    with ExitStack() as stack:
        terminal = stack.enter_context(Terminal())
        publication = stack.enter_context(files.Publication())
        temporary = TemporaryFolders()
        last_act = partial(_last_act, terminal, publication, temporary)
        interrupts = stack.enter_context(Interrupts(last_act))
        try:
            for each in request.each():
                _check(each)
            progress = _Progress(terminal, interrupts)
            progress("Start", 0.0)
            second = start_replicate_process(request.settings.threads) or nullcontext()
            second = stack.enter_context(second)
            if alone:
                with interrupts.held():  # a folder that is half made would stay
                    temporary.make()
            with interrupts.quiet():  # an exception in the midst of its import crashes Blender
                bpy = _import_bpy(temporary if alone else None)
            return max(
                _bake_one(bpy, each, progress, publication, second) for each in request.each()
            )
        except KeyboardInterrupt:
            if alone:
                interrupts.leave()
            interrupts.caught()
            terminal.fail(_interrupted(publication))
            return INTERRUPTED
        except EXPECTED as error:
            return _failure(terminal, error)


def _bake_one(bpy, request, progress, publication, second) -> int:
    """One file from its opening to its result in place; returns the exit status."""
    terminal, interrupts = progress.terminal, progress.interrupts
    try:
        summary = _bake(bpy, request, progress, publication, second)
        interrupts.check()
        with interrupts.held():  # from here on there is nothing to be stopped
            publication.commit()
            with suppress(OSError):  # whoever reads the words has gone, or has a full disk: the files are there
                terminal.say(summary)
            return DONE
    except Exception as error:  # noqa: BLE001  ours are reported too, and shown when debugging
        publication.discard()
        return _failure(terminal, error, request.label)


def _failure(terminal: Terminal, error: Exception, label: str = "") -> int:
    """Say in one line what went wrong, with the file's ``label`` unless it is named; returns the exit
    status."""
    text = _cause(error)
    return _fail(terminal, text if not label or label in text else f"{label}: {text}")


def _cause(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return _starved(error)
    if isinstance(error, EXPECTED):
        return str(error) or type(error).__name__
    return (f"unexpected {type(error).__name__}: {error}; "
            "RADIOSITY_DEBUG=1 shows where; please report it")  # fmt: skip


def _fail(terminal: Terminal, message: str) -> int:
    terminal.fail(message)
    if debugging():
        traceback.print_exc()
    return FAILED


def _starved(error: MemoryError) -> str:
    """What to say where memory has run out. ``memory.require`` says what to do; NumPy only says how much it
    did not get."""
    text = str(error)
    return text if ";" in text else (
        f"memory has run out ({text or 'no more is given'}); lower --resolution, name fewer "
        "--objects, ask for more --error, or raise the limit (ulimit -v) if there is one"
    )


def _last_act(terminal: Terminal, publication: files.Publication, temporary: TemporaryFolders) -> None:
    """Before the process is ended the hard way: remove files, and say that it was interrupted."""
    publication.discard()
    temporary.remove()
    terminal.fail(_interrupted(publication))


def _interrupted(publication: files.Publication) -> str:
    done = publication.committed
    return f"interrupted; only {', '.join(done)} was written" if done else (
        "interrupted; nothing was written"
    )


def _check(request: arguments.BakeRequest) -> None:
    """Raise what EXPECTED lists for a request that cannot be carried out, before any work is done."""
    request.settings.check()
    check_input(request)
    check_destinations(request)


def _bake(bpy, request, progress, publication, second) -> str:
    """The whole bake but the last step, putting the files in place; returns the summary.

    Raises what EXPECTED lists, or KeyboardInterrupt.
    """
    from . import bake_job as work
    from .report import build_report, summarize, write_report
    from .ui.scene_settings import kept_in_scene

    started = time.perf_counter()
    open_scene(bpy, request)
    output = output_of(bpy, request)
    files.check_writable(output, "--output")
    if request.single_user:
        _make_single_user(bpy, request.settings)
    job = work.prepare(bpy.context, request.settings, progress.part("prepare"))
    prepared = time.perf_counter()
    result = work.run(job, OverallProgress(progress.part("run")), beside=second)
    ended = time.perf_counter()
    job, result = work.without_bare(job, result)
    encoding = work.find_encoding(job, result)
    added = work.apply(bpy.context, job, result, progress.part("apply"), publication, encoding)
    result = replace(result, warnings=(*request.warnings, *result.warnings, *added))
    if request.export:
        with files.naming(request.export, "--export"):
            added = _export(job, publication.stage(request.export))
        result = replace(result, warnings=(*result.warnings, *added))
    def report() -> dict:
        now = time.perf_counter()
        seconds = {
            "export": prepared - started,
            "write": now - ended + result.seconds["fit"],
            "total": now - started,
        }
        return build_report(job, result, seconds, peak_memory(second), encoding)

    with kept_in_scene(bpy.context.scene, request.settings, report()):
        _save(bpy, publication.stage(output))
    final = report()
    if request.report:
        with files.naming(request.report, "--report"):
            write_report(final, publication.stage(request.report))
    return summarize(final, str(output))


def _make_single_user(bpy, settings) -> None:
    from .bake.single_user import make_single_user, sharing
    from .stages.prepare import matching

    layer = bpy.context.view_layer
    layer.update()
    names = matching(layer, settings.objects)
    make_single_user(sharing(i for i in layer.objects if not names or i.name in names))


class _Progress:
    """Feeds the terminal and raises KeyboardInterrupt when a signal got lost on its way."""

    def __init__(self, terminal: Terminal, interrupts: Interrupts) -> None:
        self.terminal, self.interrupts = terminal, interrupts

    def __call__(self, phase: str, fraction: float) -> None:
        self.interrupts.check()
        self.terminal.progress(phase, fraction)

    def part(self, name: str):
        """A callback whose 0 to 1 is this part's share of the whole."""
        low, high = SHARES[name]
        return lambda phase, fraction: self(phase, low + (high - low) * fraction)


def _import_bpy(temporary: TemporaryFolders | None):
    """Import Blender and the libraries, now, so that no phase of the bake is charged for it."""
    if "bpy" not in sys.modules:
        memory.require_start()
    try:
        with temporary.around_import() if temporary else nullcontext():
            import bpy
    except ImportError as error:
        raise ImportError(
            f"Blender's module bpy cannot be imported ({error}); install it with Python 3.11 or "
            "3.13 (pip install .), or run inside Blender"
        ) from error
    for name in ("scipy", "embreex"):
        _check_module(name)
    from .solver import sequence  # noqa: F401

    return bpy


def _check_module(name: str) -> None:
    """Raise ImportError with what to do where a module is missing."""
    import importlib

    try:
        importlib.import_module(name)
    except ImportError as error:
        raise ImportError(
            f"the Python module {name} cannot be imported ({error}); install the extension, which "
            "brings it, or pip install it for this Python"
        ) from error


def _export(job, path: Path) -> tuple[str, ...]:
    """Write the scene with the bake as glTF; returns warnings. Raises Refused."""
    from .gltf.export_bake import baked_by, export_bake

    return export_bake(baked_by(job), path)


def _save(bpy, path: Path) -> None:
    """Save the open file as a copy. Raises OSError with Blender's reason, or where it has none."""
    try:
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), copy=True, check_existing=False)
        complete = _is_complete(path)
    except RuntimeError as error:
        reason = str(error).strip()
        if os.strerror(errno.ENOENT) in reason and path.parent.is_dir():  # Blender removed its own, as the disk was full
            reason = "Blender could not write it"
        raise OSError(_unsaved(reason)) from error
    if not complete:
        raise OSError(_unsaved("its end is missing"))


def _is_complete(path: Path) -> bool:
    """Whether a .blend has its end: Blender does not say when a compressed one gets cut short."""
    with open(path, "rb") as handle:
        start = handle.read(len(PLAIN))
        handle.seek(max(0, path.stat().st_size - TAIL))
        end = handle.read()
    if start.startswith(ZSTANDARD):
        return end.endswith(SEEK_TABLE_END)
    return start == PLAIN and LAST_BLOCK in end


def _unsaved(reason: str) -> str:
    return (f"the result cannot be saved: {reason}; free some space on its disk, or choose "
            "another --output")
