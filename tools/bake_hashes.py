"""Hashes of small bakes of all kinds: a change that is to leave every bit as it is shows here that
it does.

    python tools/bake_hashes.py before.json [--threads N]
    (change the code)
    python tools/bake_hashes.py after.json --compare before.json

Bits differ among machines and versions of NumPy: compare what one machine wrote. Needs bpy.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from radiosity_addon import bake_job
from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.solve_cache import SolveCache
from radiosity_addon.solver.progress import silent
from radiosity_addon.stages.tiling import Tiling

VERTEX = Settings(quality="draft", seed=3)
BLOCK = replace(VERTEX, objects=("Block",))
IMAGE = replace(VERTEX, target="image", resolution=16, margin=2)
ROOM = replace(IMAGE, uv_map="UV", objects=("Room",))
TILES = Tiling(undivided=100, tile=100, survey=60, overlap=3)  # a room's image is in several
CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
INWARD = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6), (0, 4, 5, 1)]
OUTWARD = [quad[::-1] for quad in INWARD]


@dataclass(frozen=True)
class Bake:
    """One bake: what ``build`` puts into an empty file, baked with ``settings``."""

    build: Callable[[], object]
    settings: Settings
    tiling: Tiling | None = None  # None: the usual
    again: Callable[[], object] | None = None  # changes the file; baked again with kept solves


# --- What the scenes are made of ------------------------------------------------------------------


def _object(name: str, data):
    import bpy

    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def _box(name, material, low=(0, 0, 0), high=(3, 2, 2), quads=INWARD):
    """A box between two corners, with a UV map of its sides beside each other."""
    import bpy

    points = np.array(low) + np.array(CORNERS) * (np.array(high) - low)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], quads)
    layer = mesh.uv_layers.new(name="UV")
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    corners = [(square + (k % 3, k // 3)) / (3, 2) for k in range(len(quads))]
    layer.uv.foreach_set("vector", np.concatenate(corners).ravel())
    mesh.materials.append(material)
    return _object(name, mesh)


def _nodes(name: str):
    """A material without nodes but its output; the tree and that node."""
    import bpy

    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def _matte(color=(0.7, 0.6, 0.5), shader="ShaderNodeBsdfDiffuse", **inputs):
    material, tree, output = _nodes(shader)
    node = tree.nodes.new(shader)
    node.inputs["Color"].default_value = (*color, 1)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _mixed(second: str, factor=0.5, node: str | None = None, socket: str = ""):
    """A diffuse material mixed with the shader ``second``, by ``factor`` or a node's output."""
    material, tree, output = _nodes(second)
    mix, one = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    mix.inputs[0].default_value = factor
    if node:
        tree.links.new(tree.nodes.new(node).outputs[socket], mix.inputs[0])
    tree.links.new(one.outputs[0], mix.inputs[1])
    tree.links.new(tree.nodes.new(second).outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def _picture(height=8, width=16, peak=20.0):
    """An image in memory: a pattern with a few bright pixels."""
    import bpy

    image = bpy.data.images.new("Picture", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.full((height, width, 4), 1.0, np.float32)
    pixels[..., :3] = np.linspace(0.1, 0.9, height * width * 3).reshape(height, width, 3)
    pixels[height // 2 + 1, 3:6, :3] = peak
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


def _pictured(shader: str):
    """A material whose color is a picture."""
    material, tree, output = _nodes("Pictured")
    node, picture = tree.nodes.new(shader), tree.nodes.new("ShaderNodeTexImage")
    picture.image = _picture()
    tree.links.new(picture.outputs["Color"], node.inputs["Color"])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _lamp(kind="POINT", place=(1, 1, 1.5), energy=60.0, **options):
    import bpy

    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in options.items():
        setattr(data, name, value)
    thing = _object(kind, data)
    thing.location = place
    return thing


def _sun():
    thing = _lamp("SUN", energy=3.0, angle=0.02)
    thing.rotation_euler = (0.5, 0.3, 0)
    return thing


def _world(picture=False):
    import bpy

    world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.4, 0.6, 1, 1)
    if picture:
        node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = _picture(32, 64)
        world.node_tree.links.new(node.outputs["Color"], background.inputs["Color"])


# --- The scenes -----------------------------------------------------------------------------------


def room():
    """A closed room with a block, and a lamp."""
    _box("Room", _matte())
    _box("Block", _matte((0.2, 0.5, 0.3)), (1.8, 0.5, 0), (2.3, 1.1, 0.8), OUTWARD)
    return _lamp(shadow_soft_size=0.1)


def yard(picture=False):
    """A room without a ceiling, under a sky."""
    _box("Room", _matte(), quads=INWARD[:1] + INWARD[2:])
    _world(picture)


def sunny():
    """The same under a sun."""
    yard()
    _sun()


def glow():
    """A room whose block shows a bright picture."""
    _box("Room", _matte())
    _box("Block", _pictured("ShaderNodeEmission"), (1.8, 0.5, 0.2), (2.3, 1.1, 1), OUTWARD)


def painted():
    """A room whose surfaces are pictures."""
    _box("Room", _pictured("ShaderNodeBsdfDiffuse"))
    _lamp("AREA", (1.5, 1, 1.9), shape="DISK", size=0.5)


def pane():
    """A room divided by a pane that lets half of the light through."""
    _box("Room", _matte())
    _box("Pane", _mixed("ShaderNodeBsdfTransparent"), (1.5, 0, 0), (1.52, 2, 2), OUTWARD[2:4])
    _lamp()


def two_sides():
    """A yard with a screen that glows behind only."""
    yard()
    material = _mixed("ShaderNodeEmission", node="ShaderNodeNewGeometry", socket="Backfacing")
    _box("Screen", material, (1, 0.5, 0.2), (1.5, 1.5, 1.2), OUTWARD[3:4])


def instances():
    """A room with a block, two more objects of its mesh, and a collection's instance."""
    import bpy

    room()
    block = bpy.data.objects["Block"]
    for x in (-0.8, -1.6):
        _object("Copy", block.data).location = (x, 0.3, 0)
    group = bpy.data.collections.new("Group")
    group.objects.link(block)
    empty = _object("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", group
    empty.location = (-1, 0.2, 1)


def smooth():
    """A room with a rounded block that is shaded smooth, its faces made by a modifier."""
    import bpy

    room()
    block = bpy.data.objects["Block"]
    block.data.shade_smooth()
    block.modifiers.new("Levels", "SUBSURF").render_levels = 1


def lamps():
    """A room with many lamps, of all kinds."""
    room()
    for k in range(24):
        place = 0.2 + 0.4 * (k % 6), 0.3 + 0.4 * (k // 6), 1.7
        size, soft = 0.02 * (k % 2), k % 3 == 0
        _lamp("POINT", place, 2.0, shadow_soft_size=size, use_soft_falloff=soft)
    _lamp("SPOT", (0.5, 0.5, 1.9), 100.0, spot_size=1.0, spot_blend=0.2)
    _lamp("AREA", (2.5, 1, 1.9), 20.0, shape="RECTANGLE", size=0.2, size_y=0.5, spread=2.0)


def crossing():
    """A block that stands in the floor and in a wall of a room."""
    _box("Room", _matte())
    _box("Block", _matte((0.8, 0.2, 0.2)), (1.6, -0.3, -0.4), (2.2, 0.9, 0.7), OUTWARD)
    _lamp()


def nearly_white():
    """A room that absorbs little, where light is reflected many times."""
    _box("Room", _matte((0.97, 0.95, 0.9)))
    _lamp()


def window():
    """A dark room that gets all light through a small window, from a sky with bright spots."""
    _box("Room", _matte((0.3, 0.3, 0.3)), quads=INWARD[:1] + INWARD[2:])
    _box("Roof", _matte((0.3, 0.3, 0.3)), (0.3, 0, 2), (3.1, 2.1, 2.1), OUTWARD)
    _world(picture=True)


def beams():
    """A room with a narrow spot, and a lamp that shines by direction."""
    import bpy

    room()
    _lamp("SPOT", (0.5, 0.5, 1.9), 300.0, spot_size=0.03, spot_blend=0.1, shadow_soft_size=0.0)
    lamp = _lamp("POINT", (2.6, 1.5, 1.2), 40.0, shadow_soft_size=0.05).data
    if not lamp.node_tree:
        lamp.use_nodes = True
    tree, node = lamp.node_tree, lamp.node_tree.nodes.new("ShaderNodeTexIES")
    node.mode, node.ies = "INTERNAL", bpy.data.texts.new("Luminaire")
    node.ies.write("IESNA:LM-63-1995\nTILT=NONE\n1 1000 1.0 3 1 1 2 0 0 0\n1.0 1.0 100\n"
                   "0 45 90\n0\n800 300 10\n")  # fmt: skip
    tree.links.new(node.outputs[0], tree.nodes["Emission"].inputs["Strength"])


def flush():
    """A block that stands flush in a corner of a room, and one that lies in its faces."""
    room()
    _box("Corner", _matte((0.2, 0.2, 0.7)), (0, 0, 0), (0.7, 0.5, 0.4), OUTWARD)
    _box("Tile", _matte((0.7, 0.2, 0.2)), (0.2, 1.2, 0), (0.9, 1.7, 0.3), OUTWARD[:3])


def brighten():
    """Another energy of the room's lamp."""
    import bpy

    bpy.data.lights["POINT"].energy *= 2


BAKES: dict[str, Bake] = {
    "vertex again": Bake(room, BLOCK, again=brighten),
    "vertex smooth points": Bake(smooth, replace(BLOCK, domain="point")),
    "vertex crossing": Bake(crossing, BLOCK),
    "vertex nearly white": Bake(nearly_white, VERTEX),
    "image lamps": Bake(lamps, ROOM),
    "image again": Bake(room, replace(ROOM, error=0.05), again=brighten),
    "image tiles": Bake(room, ROOM, TILES),
    "image atlas": Bake(room, replace(IMAGE, atlas="Atlas")),
    "image window": Bake(window, replace(ROOM, error=0.03)),
    "image beams": Bake(beams, ROOM),
    "image flush": Bake(flush, replace(IMAGE, objects=("Room", "Corner", "Tile"))),
    "vertex fine": Bake(room, replace(VERTEX, objects=("Room",), quality="medium")),
    "image sun": Bake(sunny, IMAGE),
    "image sky": Bake(lambda: yard(picture=True), IMAGE),
    "image glow": Bake(glow, ROOM),
    "image painted": Bake(painted, replace(IMAGE, uv_map="UV")),
    "image pane": Bake(pane, ROOM),
    "image two sides": Bake(two_sides, IMAGE),
    "image instances": Bake(instances, replace(IMAGE, objects=("Room", "Block"))),
    "image direct": Bake(room, replace(ROOM, passes=("direct",))),
    "image indirect and color": Bake(room, replace(ROOM, passes=("indirect", "color"))),
}


# --- Baking and comparing -------------------------------------------------------------------------


def digest(result: bake_job.Result) -> str:
    """A hash of all that is the same in each run: colors, figures but seconds, warnings."""
    found, told = hashlib.sha256(), result.statistics
    for colors in result.colors:
        colors = np.ascontiguousarray(colors)
        found.update(f"{colors.dtype} {colors.shape}".encode())
        found.update(colors.tobytes())
    figures = (
        told.elements, told.rays, told.iterations, told.residual, told.estimated_error,
        told.error_95, told.energy, result.receivers, result.warnings,
    )  # fmt: skip
    found.update(repr(figures).encode())
    return found.hexdigest()[:24]


def hashes(name: str, threads: int) -> list[str]:
    """Of a bake of this name, and of the second where it is baked again."""
    import bpy

    bake = BAKES[name]
    settings = replace(bake.settings, threads=threads)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bake.build()
    kept = SolveCache() if bake.again else None
    found = []
    for change in (None, bake.again)[: 2 if bake.again else 1]:
        if change:
            change()
        job = bake_job.prepare(bpy.context, settings)
        found.append(digest(bake_job.run(job, silent, kept, None, bake.tiling)))
        bake_job.discard(bpy.context, job)
    return found


def differing(one: dict[str, list[str]], other: dict[str, list[str]]) -> Iterator[str]:
    """Names of bakes that both have and whose hashes are not the same, or that one lacks."""
    return (name for name in {**one, **other} if one.get(name) != other.get(name))


def main(argv: list[str] | None = None) -> int:
    """Write the hashes; the exit status is 1 where some are others than before."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("file", type=Path, help="JSON to write")
    parser.add_argument("--compare", type=Path, help="JSON to compare with")
    parser.add_argument("--threads", type=int, default=1)
    asked = parser.parse_args(argv)
    found = {name: hashes(name, asked.threads) for name in BAKES}
    asked.file.write_text(json.dumps(found, indent=1))
    if asked.compare is None:
        return 0
    others = list(differing(json.loads(asked.compare.read_text()), found))
    print(f"not the same: {', '.join(others)}" if others else f"all {len(found)} are the same")
    return bool(others)


if __name__ == "__main__":
    sys.exit(main())
