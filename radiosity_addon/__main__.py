"""Headless bake: ``python -m radiosity_addon``, ``blender --python radiosity_addon/__main__.py``.

Blender runs this file by its path, with no package around it and its own options in ``sys.argv``;
then the package is loaded from this file's folder and the words after ``--`` are ours.
"""

from __future__ import annotations

import signal
import sys


def run() -> None:
    """Run the command line of this process and leave with its exit status."""
    try:
        status = _main()(_arguments(sys.argv), opened=_in_blender(), alone=True)
    except KeyboardInterrupt:  # before ``main`` listens
        print("radiosity: interrupted; nothing was written", file=sys.stderr)
        status = 130
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # only Blender's farewell is left
    sys.exit(status)


def _arguments(argv: list[str]) -> list[str]:
    """Our part of the command line: what follows ``--`` where the rest is Blender's."""
    if not _in_blender():
        return argv[1:]
    return argv[argv.index("--") + 1 :] if "--" in argv else []


def _in_blender() -> bool:
    """Whether bpy was there before us, with a file open."""
    return "bpy" in sys.modules


def _main():
    if __package__:
        from .command import main
    else:
        main = _load_package().command.main
    return main


def _load_package():
    """Import the package from this file's folder, without touching ``sys.path``."""
    import importlib
    import importlib.util
    from pathlib import Path

    folder = Path(__file__).resolve().parent
    name = folder.name
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            name, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    importlib.import_module(f"{name}.command")
    return sys.modules[name]


if __name__ == "__main__":
    run()
