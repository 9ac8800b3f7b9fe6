"""A whole bake of a large mesh to vertex colors, as a command: python -m benchmarks.large

Three heads in a box with one lamp: 1.5 million triangles, or a quarter for each level less
(``--levels``, 5, at least 2). Prints what the bake's report says of cost and error.
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
FIGURES = ("triangles", "elements", "receivers", "rays", "estimated_error", "peak_memory")


def heads(levels: int) -> None:
    """The scene alone in an empty file. The head in the middle has four times as many faces
    as each of the others."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    for place in (-1, 0, 1):
        bpy.ops.mesh.primitive_monkey_add(location=(2.0 * place, 0, 0))
        modifier = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels = modifier.render_levels = levels if place == 0 else levels - 1
    bpy.ops.mesh.primitive_cube_add(size=6)
    bpy.context.object.name = "Box"
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.data.energy, lamp.data.shadow_soft_size, lamp.location = 500, 0.1, (1.5, -2, 2)
    bpy.context.collection.objects.link(lamp)
    for item in list(bpy.data.objects):
        if item.type == "MESH" and item.modifiers:
            bpy.context.view_layer.objects.active = item
            bpy.ops.object.modifier_apply(modifier="Subdivision")


def measure(levels: int, error: float) -> dict:
    """The report of baking it in a process of its own."""
    import bpy

    heads(levels)
    with tempfile.TemporaryDirectory() as folder:
        scene, report = Path(folder) / "heads.blend", Path(folder) / "report.json"
        bpy.ops.wm.save_as_mainfile(filepath=str(scene))
        line = [sys.executable, "-m", "radiosity_addon", str(scene), "--error", str(error)]
        subprocess.run([*line, "--report", str(report)], cwd=ROOT, check=True, capture_output=True)
        return json.loads(report.read_text())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--levels", type=int, default=5)
    parser.add_argument("--error", type=float, default=0.03)
    asked = parser.parse_args()
    report = measure(asked.levels, asked.error)
    print(machine())
    print(*(f"{name}: {report[name]:,}" for name in FIGURES), sep="\n")
    print(*(f"{stage}: {seconds:.1f} s" for stage, seconds in report["seconds"].items()), sep="\n")


if __name__ == "__main__":
    main()
