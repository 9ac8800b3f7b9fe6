"""Libraries: the environment in which another Python finds what this one finds. No bpy."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

from .solver.workers.parallel import BLAS_ENVIRONMENT

NAMES = ("numpy", "scipy", "embreex")


def environment(*folders: Path) -> dict[str, str]:
    """The variables for a process of Blender's own Python, which finds the libraries that this one
    finds, and what lies in ``folders``.

    Python's own variables are left out, as Blender ignores them too. Raises ImportError when a
    library is missing.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    paths = [*map(str, folders), *library_folders()]
    own = {"PYTHONPATH": os.pathsep.join(paths), "PYTHONUTF8": "1"}
    return {**kept, **own, **BLAS_ENVIRONMENT}


def library_folders() -> list[str]:
    """The folders that hold the libraries, each once. Imports none of them. Raises ImportError where one
    is missing."""
    folders = []
    for name in NAMES:
        spec = importlib.util.find_spec(name)
        if spec is None or spec.origin is None:
            raise ImportError(
                f"{name} is missing from Blender's Python {sys.version.split()[0]}; install the "
                "extension's package for this platform again"
            )
        folders.append(str(Path(spec.origin).resolve().parents[1]))
    return list(dict.fromkeys(folders))
