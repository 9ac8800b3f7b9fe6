"""The file that keeps solves between the bakes of one Blender session. No bpy.

It lies in Blender's own temporary folder, never beside the user's file, and holds what
``solver.adaptive.solve_cache.SolveCache`` holds. Only the solver's process reads and writes it.
"""

from __future__ import annotations

import os
import pickle
from pathlib import Path

from .payload import read_payload, write_payload

NAME = "radiosity-kept"
MOST = 1 << 30  # size [bytes] of a file that is kept, at most
# What a file cut short, of another version, or of another origin raises when it is read.
UNREADABLE = (OSError, EOFError, pickle.UnpicklingError, AttributeError, ImportError, IndexError,
              KeyError, TypeError, ValueError)  # fmt: skip


def read_kept(path: Path | None):
    """What an earlier bake kept; nothing where there is no file that can be read."""
    from ..solver.adaptive.solve_cache import SolveCache

    try:
        kept = read_payload(path) if path is not None else None
    except UNREADABLE:
        kept = None
    return kept if isinstance(kept, SolveCache) else SolveCache()


def write_kept(path: Path | None, kept, most: int = MOST) -> None:
    """Keep the finest solves that take at most ``most`` bytes. A full disk keeps nothing, and
    where nothing was solved the file is left as it is."""
    if path is None or not kept.changed:
        return
    part = path.with_name(path.name + ".part")
    try:
        write_payload(part, kept.shrunk(most))
        os.replace(part, path)
    except OSError:
        for each in (part, path):
            each.unlink(missing_ok=True)


def forget_kept(path: Path) -> None:
    """Remove the file, and what a worker that was ended left of it."""
    for each in (path, path.with_name(path.name + ".part")):
        each.unlink(missing_ok=True)
