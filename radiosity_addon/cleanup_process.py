"""Cleanup process: a small process that outlives this one and removes its temporary files. No bpy.

A process that is killed outright cannot clean up, but its end of a pipe is closed by the system.
The cleanup process waits at the other end, and removes then what it was asked to watch, unless it has been
dismissed.
"""

from __future__ import annotations

import glob
import logging
import os
import subprocess
import sys
from pathlib import Path

log = logging.getLogger(__name__)

# Reads patterns separated by zero bytes until the pipe is closed; the last word decides.
PROGRAM = """
import glob, os, shutil, sys
*patterns, last = sys.stdin.buffer.read().split(b"\\0")
if last != b"done":
    for pattern in patterns:
        for path in glob.glob(os.fsdecode(pattern), include_hidden=True):
            if os.path.isdir(path):
                shutil.rmtree(path, ignore_errors=True)
            else:
                os.unlink(path)
"""


class CleanupProcess:
    """Call ``watch`` for the files of each pattern, then ``dismiss`` when none is left."""

    def __init__(self) -> None:
        self._process: subprocess.Popen | None = None

    def watch(self, folder: Path, pattern: str | None = None) -> None:
        """Have files in ``folder`` that match ``pattern`` removed if this process is killed; all
        of the folder where it is None.

        A bake is not given up where the process cannot be started: then the next bake cleans up.
        """
        matching = glob.escape(str(folder.absolute()))
        if pattern is not None:
            matching = os.path.join(matching, pattern)
        try:
            if self._process is None:
                self._process = _start()
            self._process.stdin.write(os.fsencode(matching) + b"\0")
            self._process.stdin.flush()
        except OSError as error:
            log.warning("no cleanup process (%s): a kill may leave temporary files in %s", error, folder)

    def dismiss(self) -> None:
        """End the process with nothing removed."""
        if self._process is not None:
            self._process.communicate(b"done")
            self._process = None


def _start() -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", PROGRAM],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C in the terminal is not meant for it
    )
