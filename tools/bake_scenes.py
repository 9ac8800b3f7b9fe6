"""Bake scenes: small bakes of all kinds, by name. Needs bpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from radiosity_addon.settings import Settings
from radiosity_addon.stages.tiling import Tiling

from .bake_scene_parts import (
    INWARD,
    OUTWARD,
    add_box,
    add_lamp,
    add_object,
    add_sun,
    add_world,
    matte,
    mixed,
    pictured,
)

VERTEX = Settings(quality="draft", seed=3)
BLOCK = replace(VERTEX, objects=("Block",))
IMAGE = replace(VERTEX, target="image", resolution=16, margin=2)
ROOM = replace(IMAGE, uv_map="UV", objects=("Room",))
TILES = Tiling(undivided=100, tile=100, survey=60, overlap=3)  # a room's image is in several


@dataclass(frozen=True)
class Bake:
    """One bake: what ``build`` puts into an empty file, baked with ``settings``."""

    build: Callable[[], object]
    settings: Settings
    tiling: Tiling | None = None  # None: the usual
    again: Callable[[], object] | None = None  # changes the file; baked again with kept solves


def room():
    """A closed room with a block, and a lamp."""
    add_box("Room", matte())
    add_box("Block", matte((0.2, 0.5, 0.3)), (1.8, 0.5, 0), (2.3, 1.1, 0.8), OUTWARD)
    return add_lamp(shadow_soft_size=0.1)


def yard(picture=False):
    """A room without a ceiling, under a sky."""
    add_box("Room", matte(), quads=INWARD[:1] + INWARD[2:])
    add_world(picture)


def sunny():
    """The same under a sun."""
    yard()
    add_sun()


def glow():
    """A room whose block shows a bright picture."""
    add_box("Room", matte())
    add_box("Block", pictured("ShaderNodeEmission"), (1.8, 0.5, 0.2), (2.3, 1.1, 1), OUTWARD)


def painted():
    """A room whose surfaces are pictures."""
    add_box("Room", pictured("ShaderNodeBsdfDiffuse"))
    add_lamp("AREA", (1.5, 1, 1.9), shape="DISK", size=0.5)


def pane():
    """A room divided by a pane that lets half of the light through."""
    add_box("Room", matte())
    add_box("Pane", mixed("ShaderNodeBsdfTransparent"), (1.5, 0, 0), (1.52, 2, 2), OUTWARD[2:4])
    add_lamp()


def two_sides():
    """A yard with a screen that glows behind only."""
    yard()
    material = mixed("ShaderNodeEmission", node="ShaderNodeNewGeometry", socket="Backfacing")
    add_box("Screen", material, (1, 0.5, 0.2), (1.5, 1.5, 1.2), OUTWARD[3:4])


def instances():
    """A room with a block, two more objects of its mesh, and a collection's instance."""
    import bpy

    room()
    block = bpy.data.objects["Block"]
    for x in (-0.8, -1.6):
        add_object("Copy", block.data).location = (x, 0.3, 0)
    group = bpy.data.collections.new("Group")
    group.objects.link(block)
    empty = add_object("Instance", None)
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
        location = 0.2 + 0.4 * (k % 6), 0.3 + 0.4 * (k // 6), 1.7
        size, soft = 0.02 * (k % 2), k % 3 == 0
        add_lamp("POINT", location, 2.0, shadow_soft_size=size, use_soft_falloff=soft)
    add_lamp("SPOT", (0.5, 0.5, 1.9), 100.0, spot_size=1.0, spot_blend=0.2)
    add_lamp("AREA", (2.5, 1, 1.9), 20.0, shape="RECTANGLE", size=0.2, size_y=0.5, spread=2.0)


def crossing():
    """A block that stands in the floor and in a wall of a room."""
    add_box("Room", matte())
    add_box("Block", matte((0.8, 0.2, 0.2)), (1.6, -0.3, -0.4), (2.2, 0.9, 0.7), OUTWARD)
    add_lamp()


def nearly_white():
    """A room that absorbs little, where light is reflected many times."""
    add_box("Room", matte((0.97, 0.95, 0.9)))
    add_lamp()


def window():
    """A dark room that gets all light through a small window, from a sky with bright spots."""
    add_box("Room", matte((0.3, 0.3, 0.3)), quads=INWARD[:1] + INWARD[2:])
    add_box("Roof", matte((0.3, 0.3, 0.3)), (0.3, 0, 2), (3.1, 2.1, 2.1), OUTWARD)
    add_world(picture=True)


def beams():
    """A room with a narrow spot, and a lamp that shines by direction."""
    import bpy

    room()
    add_lamp("SPOT", (0.5, 0.5, 1.9), 300.0, spot_size=0.03, spot_blend=0.1, shadow_soft_size=0.0)
    lamp = add_lamp("POINT", (2.6, 1.5, 1.2), 40.0, shadow_soft_size=0.05).data
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
    add_box("Corner", matte((0.2, 0.2, 0.7)), (0, 0, 0), (0.7, 0.5, 0.4), OUTWARD)
    add_box("Tile", matte((0.7, 0.2, 0.2)), (0.2, 1.2, 0), (0.9, 1.7, 0.3), OUTWARD[:3])


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
