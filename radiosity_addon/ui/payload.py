"""Jobs and results on their way between Blender's process and the solver's. No bpy.

A payload starts with the name of the package that wrote it (see ``pickled``).
"""

from __future__ import annotations

import pickle
from pathlib import Path

from ..pickled import PACKAGE, PROTOCOL, PickleReader


def write_payload(path: Path, content) -> None:
    """Write ``content`` (dataclasses of this package, arrays) to ``path``."""
    with open(path, "wb") as handle:
        handle.write(PACKAGE.encode() + b"\n")
        pickle.dump(content, handle, PROTOCOL)


def read_payload(path: Path):
    """Read what ``write_payload`` wrote, in this process or another. Raises OSError, EOFError or
    pickle.UnpicklingError when the file is missing or cut short."""
    with open(path, "rb") as handle:
        return PickleReader(handle, handle.readline().decode().strip()).load()
