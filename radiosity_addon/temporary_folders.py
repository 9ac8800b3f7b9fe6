"""Temporary folders: Blender's own, which goes however this process ends. No bpy.

Blender makes a temporary folder when it starts and removes it when it quits, but not when it is killed: so
a cleanup process watches the folder. Where Blender is a module that is still to be imported, a folder of ours
is made and watched first, and Blender makes its own in there.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from contextlib import contextmanager, nullcontext
from pathlib import Path

from .cleanup_process import CleanupProcess

VARIABLE = "TEMP" if os.name == "nt" else "TMPDIR"  # where Blender looks first


class TemporaryFolders:
    """The temporary folders of this process's Blender. It lasts as long as the process."""

    def __init__(self) -> None:
        self._folders: list[Path] = []
        self._cleanup = CleanupProcess()

    def make(self) -> None:
        """Make the folder that a Blender still to be imported will use: not to be cut in two.

        Raises OSError where no temporary folder can be made.
        """
        if "bpy" not in sys.modules:
            self._own(tempfile.mkdtemp(prefix="radiosity-"))
            atexit.register(self.remove)

    @contextmanager
    def around_import(self):
        """Import bpy inside."""
        with _variable(VARIABLE, self._folders[0]) if self._folders else nullcontext():
            yield
        self._own(sys.modules["bpy"].app.tempdir)

    def remove(self) -> None:
        """Remove the folders, for a process that is about to end."""
        for folder in self._folders:
            shutil.rmtree(folder, ignore_errors=True)

    def _own(self, folder: str) -> None:
        if folder:
            self._folders.append(Path(folder))
            self._cleanup.watch(Path(folder))


@contextmanager
def _variable(name: str, value: Path):
    """The environment variable is ``value`` inside."""
    before = os.environ.get(name)
    os.environ[name] = str(value)
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
