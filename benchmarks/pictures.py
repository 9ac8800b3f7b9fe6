"""The pictures in docs/gallery.md: rooms baked by the command line, seen from inside. Needs bpy.

    python -m benchmarks.pictures docs/images            # all of them, with what each bake cost
    python -m benchmarks.pictures docs/images living_room_vertex

Each file gets a sun and a sky, is baked at medium quality as a user would, and rendered without any
light but the baked colors: every face emits them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .look import picture
from .scene_parts import emitter, sky, sun
from .scenes import scene_file

PROJECT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Picture:
    """``scene``: a file of the study, and the name of its view. Sun's Euler angles [rad]."""

    scene: str
    target: str
    sun: tuple[float, float, float]
    exposure: float  # stops
    options: tuple[str, ...] = ()


PICTURES = {
    "living_room_vertex": Picture("living_room", "vertex", (0.9, 0.1, 0.5), 1.5),
    "living_room_image": Picture(
        "living_room", "image", (0.9, 0.1, 0.5), 1.5, ("--resolution", "1024")
    ),
    "room_vertex": Picture("room", "vertex", (0.8, 0.2, 0.4), 0.5),
    "room_image": Picture("room", "image", (0.8, 0.2, 0.4), 0.5, ("--resolution", "512")),
}


def lit_file(chosen: Picture, path: Path) -> None:
    """The scene's file with a sun and a sky, saved as ``path``."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(scene_file(f"{chosen.scene}.blend")))
    sun(5.0, chosen.sun, 0.01)
    sky((0.6, 0.75, 1.0), 1.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)


def bake(chosen: Picture, source: Path, output: Path) -> dict:
    """Bake ``source`` into ``output`` by the command line; its report, and ``processor``: the
    seconds of all cores together, which do not depend on what else they do."""
    report, before = output.with_suffix(".json"), os.times()
    subprocess.run(
        [
            sys.executable, "-m", "radiosity_addon", str(source), "--output", str(output),
            "--target", chosen.target, "--quality", "medium", "--report", str(report),
            *chosen.options,
        ],
        cwd=PROJECT,
        check=True,
    )  # fmt: skip
    after = os.times()
    spent = after.children_user + after.children_system
    spent -= before.children_user + before.children_system
    return {**json.loads(report.read_text()), "processor": spent}


def show_baked(target: str) -> None:
    """Every mesh of the open file emits what was baked onto it, and nothing else shines."""
    import bpy

    for obj in [o for o in bpy.data.objects if o.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    for obj in [o for o in bpy.data.objects if o.type == "MESH"]:
        material = emitter("Baked", (1.0, 1.0, 1.0), 1.0)
        tree = material.node_tree
        shader = next(node for node in tree.nodes if node.type == "EMISSION")
        tree.links.new(_baked_color(tree, obj, target), shader.inputs["Color"])
        for slot in obj.material_slots:
            slot.material = material


def _baked_color(tree, obj, target: str):
    """The output socket of nodes that read the colors baked onto ``obj``."""
    import bpy

    if target == "vertex":
        node = tree.nodes.new("ShaderNodeVertexColor")
        node.layer_name = "Radiosity"
    else:
        node, uv = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
        node.image, uv.uv_map = bpy.data.images[f"Radiosity_{obj.name}"], "Radiosity"
        tree.links.new(uv.outputs[0], node.inputs["Vector"])
    return node.outputs["Color"]


def make(name: str, folder: Path) -> dict:
    """Bake and render one picture into ``folder``; the bake's report."""
    import bpy

    chosen = PICTURES[name]
    with tempfile.TemporaryDirectory() as room:
        source, output = Path(room) / "lit.blend", Path(room) / "baked.blend"
        lit_file(chosen, source)
        report = bake(chosen, source, output)
        bpy.ops.wm.open_mainfile(filepath=str(output))
        show_baked(chosen.target)
        picture(chosen.scene, folder / f"{name}.jpg", exposure=chosen.exposure)
    return report


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pictures", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PICTURES))
    chosen = parser.parse_args(arguments)
    for name in chosen.names or PICTURES:
        if name not in PICTURES:
            parser.error(f"there is no picture {name}; choose from {', '.join(PICTURES)}")
        report = make(name, chosen.folder)
        print(
            f"{name}: {report['seconds']['total']:.1f} s, of processors {report['processor']:.1f}, "
            f"{report['receivers']} receivers, {report['peak_memory'] / 1e6:.0f} MB, "
            f"estimated error {report['estimated_error']:.4f}, warnings: {report['warnings']}"
        )


if __name__ == "__main__":
    main()
