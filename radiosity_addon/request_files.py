"""The files that a request names: the scene to read, and where its results go."""

from __future__ import annotations

import re
from pathlib import Path

from . import arguments, files

BLEND_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # plain, Zstandard, gzip
ELSEWHERE = "name another place by --output FILE.blend"


def check_input(request: arguments.BakeRequest) -> None:
    """Raise OSError unless the scene named is a .blend that can be read."""
    if not request.scene:
        return
    path = Path(request.scene)
    if not path.exists():
        raise OSError(f"{path} does not exist; check the name")
    if path.is_dir():
        raise OSError(f"{path} is a folder; name a .blend file in it")
    with open(path, "rb") as handle:
        start = handle.read(7)
    if not start.startswith(BLEND_MAGIC):
        raise OSError(f"{path} is no Blender file; name a .blend saved by Blender")


def check_destinations(request: arguments.BakeRequest) -> None:
    """Raise OSError if a file that was asked for cannot be written: before any work is done."""
    if request.output:
        files.check_writable(request.output, "--output")
    elif request.scene:
        files.check_writable(_baked(Path(request.scene)), "the result", ELSEWHERE)
    if request.report:
        files.check_writable(request.report, "--report")
    if request.export:
        files.check_writable(request.export, "--export")
    if request.settings.image_dir:
        files.check_folder(request.settings.image_dir, "--image-dir")


def open_scene(bpy, request: arguments.BakeRequest) -> None:
    """Bring the scene in: read the file, build the demo, or take what is open."""
    if request.demo:
        from .export.demo import build_demo

        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        build_demo(request.demo)
    elif request.scene:
        path = str(Path(request.scene).resolve())
        try:
            bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
        except RuntimeError as error:
            raise OSError(
                f"{request.scene} cannot be read by Blender {bpy.app.version_string}: "
                f"{_reason(str(error), path)}; the file is damaged or from a newer Blender"
            ) from error


def _reason(text: str, path: str) -> str:
    """What Blender says of a file that it cannot read, without the file's name: ``Missing DNA block``."""
    first, *others = re.split(f"['\"]*{re.escape(path)}['\"]*", text.strip())
    last = others[-1].strip(" :") if others else ""
    return (last or first.removesuffix(" in file ")).removeprefix("Error: ")


def output_of(bpy, request: arguments.BakeRequest) -> Path:
    """Where the result goes: as asked, or beside the input with ``_baked`` added to its name."""
    if request.output:
        return Path(request.output)
    if request.demo:
        return Path(f"{request.demo}_baked.blend")
    if request.scene:
        return _baked(Path(request.scene))
    if not bpy.data.filepath:
        raise OSError("the open file was never saved, so it has no name; give --output FILE.blend")
    return _baked(Path(bpy.data.filepath))


def _baked(scene: Path) -> Path:
    return scene.with_name(f"{scene.stem}_baked.blend")
