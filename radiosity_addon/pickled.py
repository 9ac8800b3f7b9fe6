"""Pickled objects of this package, on their way between processes. No bpy.

Blender imports an installed extension under a long name (``bl_ext.<repository>.<id>``), the
processes beside it under a short one. Who reads looks classes up in its own copy of the package.
"""

from __future__ import annotations

import pickle

PACKAGE = __package__
PROTOCOL = 5  # version [of pickle]: the first whose large arrays need not be copied


class PickleReader(pickle.Unpickler):
    """Finds the classes of the package that its ``writer`` calls by that name in this process's."""

    def __init__(self, handle, writer: str) -> None:
        super().__init__(handle)
        self._writer = writer

    def find_class(self, module: str, name: str):
        return super().find_class(own_module(module, self._writer), name)


def own_module(module: str, writer: str) -> str:
    """What this process calls a module of the package that its ``writer`` calls by that name."""
    if module == writer or module.startswith(writer + "."):
        return PACKAGE + module[len(writer) :]
    return module
