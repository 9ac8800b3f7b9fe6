"""Child process: a Python process beside this one that is asked for things and answers. No bpy.

It is started before Blender is, as it takes as long to import SciPy. It reads requests from its standard
input, writes answers to its standard output, and ends when its input does. A scene that a request opens
is kept for later requests, until another one is opened.
"""

from __future__ import annotations

import os
import pickle
import queue
import shutil
import subprocess
import sys
import threading
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from . import memory
from .libraries import environment
from .pickled import PACKAGE, PROTOCOL, PickleReader
from .solver.expected import ProcessLost

if TYPE_CHECKING:  # these import NumPy, which takes its time
    from .solver.adaptive.processes import OpenHelpers, Opening
    from .solver.adaptive.requests import Request

PIPE_SIZE = 1 << 20  # size [bytes] of a pipe: light is megabytes
ANSWER, FAILURE = "answer", "failure"
SHORT = Path(__file__).resolve().parent.name  # what a child process calls this package


class ChildProcess:
    """A process that answers requests. ``close()`` ends it, and what it is doing."""

    def __init__(self, program: str, *words: str) -> None:
        """Start a ``program``, a module of this package that calls ``serve``, with ``words`` after the package's
        name; returns at once. Raises OSError or ImportError when it cannot be started."""
        options = {"start_new_session": True}  # Ctrl-C is for us; we end it
        if os.name == "nt":
            flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
            options = {"creationflags": flags}
        self._process = subprocess.Popen(
            [sys.executable, "-s", "-P", "-m", f"{SHORT}.{program}", PACKAGE, *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pipesize=PIPE_SIZE,
            env=environment(Path(__file__).resolve().parents[1]),
            **options,
        )
        self.rays, self.embree_seconds, self.peak_memory = 0, 0.0, 0
        self._asked = 0

    def __enter__(self) -> ChildProcess:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def ask(self, request: Request | Opening) -> None:
        """Send a request; its answer is among the next ``answers``."""
        self._asked += 1
        with suppress(OSError):  # it has ended: ``answers`` raises
            pickle.dump(request, self._process.stdin, PROTOCOL)
            self._process.stdin.flush()

    def answers(self) -> list:
        """Wait for the answers to all requests since the last call, in their order. Raises what one of them
        raised over there, and ProcessLost if the process has ended."""
        asked, self._asked = self._asked, 0
        found = [self._answer() for _ in range(asked)]
        for status, value in found:
            if status == FAILURE:
                raise value
        return [value for _, value in found]

    def _answer(self) -> tuple:
        try:
            status, value, *figures = PickleReader(self._process.stdout, SHORT).load()
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            raise self._ended() from error
        self.rays, self.embree_seconds, self.peak_memory = figures
        return status, value

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        with suppress(OSError):
            self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait()

    def _ended(self) -> Exception:
        """The ProcessLost to raise, with why the process may have ended and what to do."""
        status = self._process.wait()
        cause = (
            "memory may have run out: lower the resolution, or use one thread, for which there is "
            "only one process"
            if status < 0 else "RADIOSITY_DEBUG=1 shows why; please report it"
        )  # fmt: skip
        return ProcessLost(f"the solver's second process ended (status {status}); {cause}")


def serve(helpers: OpenHelpers | None = None, folders: Sequence[str] = ()) -> None:
    """Answer what is asked until the input ends, then remove ``folders``; a child process' own program, which
    may have ``helpers``."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever libraries print must not get among the answers
    asked: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(asked, folders), daemon=True).start()
    from .solver import sequence  # noqa: F401  all a bake needs, before it is asked for
    from .solver.adaptive.processes import Opening

    held, before = None, (0, 0.0)
    while True:
        request = asked.get()
        try:
            if isinstance(request, Opening):
                held = None  # frees the one before
                held, value = request.opened(helpers), None
                before = held.context.rays, held.context.embree_seconds  # as many as the first took
            else:
                value = request.answer(held)
            status = ANSWER
        except Exception as error:  # noqa: BLE001  raised again where it was asked
            status, value = FAILURE, _portable(error)
        now = (held.context.rays, held.context.embree_seconds) if held else before
        figures = (now[0] - before[0], now[1] - before[1], _peak_memory(helpers))
        pickle.dump((status, value, *figures), answers, PROTOCOL)
        answers.flush()
        del value, request


def _peak_memory(helpers: OpenHelpers | None) -> int:
    return memory.peak_memory() + (helpers.peak_memory if helpers is not None else 0)


def _portable(error: Exception) -> Exception:
    """The error, or one like it that can be pickled."""
    error.add_note("".join(traceback.format_exception(error)))
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001  whatever its own class does
        return RuntimeError(f"{type(error).__name__}: {error}")


def _listen(asked: queue.SimpleQueue, folders: Sequence[str]) -> None:
    """Pass on what is asked; at the end of the input remove ``folders`` and end this process, whatever it
    is doing."""
    source = os.fdopen(0, "rb", closefd=False)
    while True:
        try:
            asked.put(PickleReader(source, sys.argv[1]).load())
        except Exception:  # noqa: BLE001  whoever asks is gone, in the midst of a word perhaps
            for folder in folders:
                shutil.rmtree(folder, ignore_errors=True)
            os._exit(0)
