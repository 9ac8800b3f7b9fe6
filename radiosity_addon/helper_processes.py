"""Helper processes: beside a replicate's own process, they work on chunks of its rays and points. No bpy.

The arrays that they work on are shared (``shared_arrays``). One that is lost is no loss:
its chunks are done by the process that it helps.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from . import memory
from .child_process import ChildProcess, serve
from .pickled import PACKAGE
from .solver.expected import ProcessLost

if TYPE_CHECKING:  # these import NumPy, which takes its time
    from .shared_arrays import PackedWork, SharedArrays
    from .solver.direct.beams import Split
    from .solver.workers.parallel import Chunk_contra, Result_co, Work

# Memory [bytes] of a helper, and of it for each triangle, measured: fewer help where it lacks.
ALWAYS, PER_TRIANGLE = 300e6, 350.0
MEMORY = Path("/dev/shm")  # files there lie in memory, on Linux
SPARED = 0.5  # share [of the memory that is free] that helpers may take


def start_helpers(count: int) -> HelperProcesses | None:
    """So many, or None where there are none to be, or none can be started."""
    if count < 1:
        return None
    try:
        return HelperProcesses(count)
    except (OSError, ImportError):
        return None


class HelperProcesses:
    """Processes that work on chunks: ``solver.workers.parallel.Helpers``."""

    def __init__(self, count: int) -> None:
        """Start them; returns at once. Raises OSError or ImportError when they cannot be started."""
        self._folders = make_folders()
        self._arrays: SharedArrays | None = None
        words = Path(__file__).stem, *map(str, self._folders)
        self._processes: list[ChildProcess] = []
        try:
            for _ in range(count):
                self._processes.append(ChildProcess(*words))
        except (OSError, ImportError):
            self.close()
            raise
        self._opened: list[ChildProcess] = []
        self._used: list[ChildProcess] = []  # those that are not lost
        self._given: dict[ChildProcess, int] = {}
        self._names: dict[int, str] = {}
        self._split: Split | None = None
        self._number = 0

    def open(self, split: Split, count: int) -> None:
        """Let at most ``count`` of them help in the scene of ``split`` from now on, as many as memory allows."""
        from .helper_requests import OpenContexts  # which imports NumPy
        from .shared_arrays import SharedArrays

        context = split.rest
        free = memory.available_memory()
        if free is not None:
            each = ALWAYS + PER_TRIANGLE * len(context.scene.triangles)
            count = min(count, int(SPARED * free / each))
        self._opened = self._used = self._processes[: max(count, 0)]
        self._given = {}
        self._split = split  # whose contexts' ids are names as long as they are there
        self._names = {id(each): name for name, each in vars(split).items() if each is not None}
        if self._arrays is None:
            self._arrays = SharedArrays(self._folders)
        for process in self._used:
            process.rays, process.embree_seconds = 0, 0.0
            process.ask(OpenContexts(context.scene, context.seed, PACKAGE))

    def leave(self) -> None:
        """Help with nothing until the next scene is opened."""
        self._opened = self._used = []
        self._split, self._names = None, {}

    @property
    def rays(self) -> int:
        """Traced by them so far, since they were opened."""
        return sum(process.rays for process in self._opened)

    @property
    def embree_seconds(self) -> float:
        """The same of the seconds spent inside Embree."""
        return sum(process.embree_seconds for process in self._opened)

    @property
    def peak_memory(self) -> int:
        """The sum of their largest resident sizes [bytes]."""
        return sum(process.peak_memory for process in self._processes)

    def hands(self, function: Work[Chunk_contra, Result_co]) -> list[Work[Chunk_contra, Result_co]]:
        """See ``Helpers``. None where there is no room for what is shared."""
        from .shared_arrays import pack_work

        if not self._used:
            return []
        try:
            packed = pack_work(function, self._arrays, self._names)
        except OSError:
            return []
        self._number += 1
        return [
            partial(self._done, process, self._number, packed, function) for process in self._used
        ]

    def _done(
        self, process: ChildProcess, number: int, packed: PackedWork, function: Work[Chunk_contra, Result_co],
        chunk: Chunk_contra,
    ) -> Result_co:
        """What the ``process`` makes of a chunk, or this one where it is lost."""
        from .helper_requests import WorkOn

        if process not in self._used:
            return function(chunk)
        fresh = self._given.get(process) != number
        self._given[process] = number
        process.ask(WorkOn(packed.content if fresh else None, chunk))
        try:
            return process.answers()[-1]
        except (ProcessLost, MemoryError):
            self._used = [each for each in self._used if each is not process]
            return function(chunk)

    def close(self) -> None:
        """End them, and remove what they share."""
        for process in self._processes:
            process.close()
        for folder in self._folders:
            shutil.rmtree(folder, ignore_errors=True)


def make_folders() -> tuple[Path, ...]:
    """Where arrays are shared: in memory where there is a file system for that, and a temporary folder.
    Raises OSError where none can be made."""
    parents = [MEMORY, None] if os.access(MEMORY, os.W_OK) else [None]
    return tuple(Path(tempfile.mkdtemp(prefix="radiosity-", dir=parent)) for parent in parents)


if __name__ == "__main__":
    serve(folders=sys.argv[2:])
