"""Replicate process: beside this one, it does a bake's second replicate. No bpy.

NumPy lets other threads run only inside its loops, and these are short: two threads of one Python
are 1.1 to 1.4 times as fast as one, two processes 1.5 to 1.7 times (docs/cost.md).
With more than two cores each of the two has helpers besides (``helper_processes``).
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from . import memory
from .child_process import ChildProcess, serve
from .helper_processes import start_helpers
from .solver.workers.parallel import thread_count

if TYPE_CHECKING:  # these import NumPy, which takes its time
    from .solver.adaptive.requirements import SolverSettings
    from .solver.receivers import Receivers
    from .solver.scene import Scene


class ReplicateProcess(ChildProcess):
    """The second replicate of bakes, one after the other, in a process of its own: a
    ``solver.adaptive.second_replicate.RemoteReplicate``. ``helpers`` are those of the first replicate,
    in this process."""

    def __init__(self, threads: int = 2) -> None:
        """Start it, and for more than two ``threads`` helpers of both replicates; returns at once. Raises OSError
        or ImportError when it cannot be started."""
        super().__init__(Path(__file__).stem, str(threads // 2 - 1))
        self.helpers = start_helpers((threads + 1) // 2 - 1)

    def open(
        self, scene: Scene, receivers: Receivers, settings: SolverSettings, threads: int
    ) -> None:
        """Ask for a new replicate, with so many threads."""
        from .solver.adaptive.requests import OpenScene  # which imports NumPy

        self.ask(OpenScene(scene, receivers, settings, threads))

    def close(self) -> None:
        """End the process, and the helpers."""
        if self.helpers is not None:
            self.helpers.close()
        super().close()


def start_replicate_process(threads: int) -> ReplicateProcess | None:
    """One, or None where ``threads`` (0: all cores) leave nothing for it, or none can be started."""
    count = thread_count(threads)
    if count < 2:
        return None
    try:
        return ReplicateProcess(count)
    except (OSError, ImportError):
        return None


def peak_memory(second: ReplicateProcess | None) -> int:
    """The largest resident size of this process, and of those beside it if there are any [bytes]."""
    own = memory.peak_memory()
    if second is None:
        return own
    helpers = 0 if second.helpers is None else second.helpers.peak_memory
    return own + second.peak_memory + helpers


if __name__ == "__main__":
    serve(start_helpers(int(sys.argv[2])))
