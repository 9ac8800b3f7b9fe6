"""Jobs and results on their way between Blender's process and the solver's. No bpy.

Blender imports an installed extension under a long name (``bl_ext.<repository>.<id>``), the
solver's process under a short one. So a payload starts with the name of the package that wrote
it, and the reader looks its classes up in its own copy of the same package.
"""

from __future__ import annotations

import pickle
from pathlib import Path

PACKAGE = __package__.rpartition(".")[0]  # of which ui is a part
PROTOCOL = 5  # version [of pickle]


def write_payload(path: Path, content) -> None:
    """Write ``content`` (dataclasses of this package, arrays) to ``path``."""
    with open(path, "wb") as handle:
        handle.write(PACKAGE.encode() + b"\n")
        pickle.dump(content, handle, PROTOCOL)


def read_payload(path: Path):
    """Read what ``write_payload`` wrote, in this process or another. Raises OSError, EOFError or
    pickle.UnpicklingError when the file is missing or cut short."""
    with open(path, "rb") as handle:
        return _Reader(handle, handle.readline().decode().strip()).load()


class _Reader(pickle.Unpickler):
    """Finds the writer's classes in this process's package."""

    def __init__(self, handle, writer: str) -> None:
        super().__init__(handle)
        self._writer = writer

    def find_class(self, module: str, name: str):
        if module == self._writer or module.startswith(self._writer + "."):
            module = PACKAGE + module[len(self._writer) :]
        return super().find_class(module, name)
