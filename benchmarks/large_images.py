"""Large images and many of them, as commands: python -m benchmarks.large_images [--sizes 1024 2048 4096]

The Cornell box at each resolution, and with ``--objects N`` so many boxes in a room with an image of
``--resolution`` each. Prints seconds in all and for a million texels, and the most memory that both
processes took together.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.machine import machine

ROOT = Path(__file__).resolve().parents[1]
LINE = "{:>24} {:>10} {:>9} {:>14} {:>10} {:>10}"
HEAD = ("images", "receivers", "seconds", "s / 10⁶ texels", "peak [MB]", "estimated")


def boxes(count: int) -> None:
    """So many boxes on the floor of a room under a lamp, alone in an empty file."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    across = int(count**0.5 + 0.999)
    bpy.ops.mesh.primitive_cube_add(size=1)
    first = bpy.context.object
    for number in range(1, count):
        item = bpy.data.objects.new(f"Box {number}", first.data.copy())
        item.location = 2 * (number % across), 2 * (number // across), 0
        bpy.context.collection.objects.link(item)
    middle, height = across - 1, across
    bpy.ops.mesh.primitive_cube_add(size=1, location=(middle, middle, height / 2 - 0.51))
    room = bpy.context.object
    room.name, room.scale = "Room", (2 * across, 2 * across, height)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size = 30 * across**2, across / 2
    lamp.location = middle, middle, height - 1
    bpy.context.collection.objects.link(lamp)
    for item in bpy.data.objects:
        item.select_set(item.type == "MESH")


def bake(words: list[str]) -> dict:
    """The report of a bake in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        line = [sys.executable, "-m", "radiosity_addon", *words, "--target", "image"]
        line += ["--output", str(Path(folder) / "baked.blend"), "--report", str(report)]
        subprocess.run(line, cwd=ROOT, check=True, capture_output=True)
        return json.loads(report.read_text())


def row(name: str, texels: int, report: dict) -> str:
    """A line of the table."""
    seconds = report["seconds"]["total"]
    return LINE.format(
        name, f"{report['receivers']:,}", f"{seconds:.1f}", f"{seconds / (texels / 1e6):.2f}",
        f"{report['peak_memory'] / 1e6:.0f}", f"{100 * report['estimated_error']:.1f} %",
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=[1024, 2048, 4096])
    parser.add_argument("--objects", type=int, default=0)
    parser.add_argument("--resolution", type=int, default=1024)
    parser.add_argument("--error", type=float, default=0.03)
    asked = parser.parse_args()
    print(machine())
    print(LINE.format(*HEAD))
    error = ["--error", str(asked.error)]
    for size in asked.sizes:
        report = bake(["--demo", "cornell", "--resolution", str(size), *error])
        print(row(f"1 of {size}²", size**2, report), flush=True)
    if asked.objects:
        import bpy

        boxes(asked.objects)
        names = [f"Box {number}" for number in range(1, asked.objects)] + ["Cube"]
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "boxes.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path)
            words = [path, "--resolution", str(asked.resolution), *error, "--objects", *names]
            texels = asked.objects * asked.resolution**2
            print(row(f"{asked.objects} of {asked.resolution}²", texels, bake(words)))


if __name__ == "__main__":
    main()
