"""Replicate process: beside this one, it does a bake's second replicate. No bpy.

NumPy lets other threads go on only inside its loops, and these are short: two threads of one Python
get no more done than one and a half, two processes twice as much (docs/cost.md has the figures).
The process is started before Blender is, as it takes as long to import SciPy. It reads what it is
asked from its standard input and answers on its standard output; when its input ends, so does it.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
import traceback
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from . import memory
from .libraries import environment
from .pickled import PACKAGE, PROTOCOL, PickleReader
from .solver.workers.parallel import thread_count

if TYPE_CHECKING:  # these import NumPy, which takes its time
    from .solver.adaptive.requests import OpenScene, Request
    from .solver.adaptive.requirements import SolverSettings
    from .solver.receivers import Receivers
    from .solver.scene import Scene

PIPE_SIZE = 1 << 20  # size [bytes] of a pipe: light is megabytes
ANSWER, FAILURE = "answer", "failure"
SHORT = Path(__file__).resolve().parent.name  # what the second process calls this package


class ReplicateProcess:
    """The second replicate of bakes, one after the other, in a process of its own: a
    ``solver.adaptive.second_replicate.RemoteReplicate``. ``close()`` ends it, and what it is
    doing."""

    def __init__(self) -> None:
        """Start it; returns at once. Raises OSError or ImportError when it cannot be started."""
        options = {"start_new_session": True}  # Ctrl-C is for us; we end it
        if os.name == "nt":
            flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
            options = {"creationflags": flags}
        self._process = subprocess.Popen(
            [sys.executable, "-s", "-P", "-m", f"{SHORT}.{Path(__file__).stem}", PACKAGE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pipesize=PIPE_SIZE,
            env=environment(Path(__file__).resolve().parents[1]),
            **options,
        )
        self.rays, self.embree_seconds, self.peak_memory = 0, 0.0, 0
        self._asked = 0

    def __enter__(self) -> ReplicateProcess:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def open(
        self, scene: Scene, receivers: Receivers, settings: SolverSettings, threads: int
    ) -> None:
        """Ask for a new replicate, with so many threads."""
        from .solver.adaptive.requests import OpenScene  # which imports NumPy

        self._send(OpenScene(scene, receivers, settings, threads))

    def ask(self, request: Request) -> None:
        """Start what is asked for."""
        self._send(request)

    def _send(self, request: Request | OpenScene) -> None:
        self._asked += 1
        with suppress(OSError):  # it has ended: the answers tell
            pickle.dump(request, self._process.stdin, PROTOCOL)
            self._process.stdin.flush()

    def answers(self) -> list:
        """What came of all that was asked for since the last answers, when it is there; raises
        what one of them raised, ReplicateLost if the process has ended."""
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
        from .solver.adaptive.second_replicate import ReplicateLost  # which imports NumPy

        status = self._process.wait()
        cause = (
            "memory may have run out: lower the resolution, or use one thread, for which there is "
            "only one process"
            if status < 0 else "RADIOSITY_DEBUG=1 shows why; please report it"
        )  # fmt: skip
        return ReplicateLost(f"the solver's second process ended (status {status}); {cause}")


def start_replicate_process(threads: int) -> ReplicateProcess | None:
    """A Twin, or None where ``threads`` leave nothing for one, or none can be started."""
    if thread_count(threads) < 2:
        return None
    try:
        return ReplicateProcess()
    except (OSError, ImportError):
        return None


def peak_memory(second: ReplicateProcess | None) -> int:
    """The largest resident size of this process, and of the ``second`` one if there is one [bytes]."""
    return memory.peak_memory() + (second.peak_memory if second is not None else 0)


def serve() -> None:
    """Answer what is asked until the input ends; the second process' own program."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever libraries print must not get among the answers
    asked: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()
    from .solver import sequence  # noqa: F401  all a bake needs, before it is asked for
    from .solver.adaptive.requests import OpenScene

    replicate, before = None, (0, 0.0)
    while True:
        request = asked.get()
        try:
            if isinstance(request, OpenScene):
                replicate = None  # frees the one before
                replicate, value = request.replicate(), None
                before = replicate.context.rays, replicate.context.embree_seconds  # as many as the first took
            else:
                value = request.answer(replicate)
            status = ANSWER
        except Exception as error:  # noqa: BLE001  raised again where it was asked
            status, value = FAILURE, _portable(error)
        now = (replicate.context.rays, replicate.context.embree_seconds) if replicate else before
        figures = (now[0] - before[0], now[1] - before[1], memory.peak_memory())
        pickle.dump((status, value, *figures), answers, PROTOCOL)
        answers.flush()
        del value, request


def _portable(error: Exception) -> Exception:
    """The error as it can be told to another process."""
    error.add_note("".join(traceback.format_exception(error)))
    try:
        return pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001  whatever its own class does
        return RuntimeError(f"{type(error).__name__}: {error}")


def _listen(asked: queue.SimpleQueue) -> None:
    """Pass on what is asked; at the end of the input end this process, whatever it is doing."""
    source = os.fdopen(0, "rb", closefd=False)
    while True:
        try:
            asked.put(PickleReader(source, sys.argv[1]).load())
        except Exception:  # noqa: BLE001  whoever asks is gone, in the midst of a word perhaps
            os._exit(0)


if __name__ == "__main__":
    serve()
