"""The stage of every parity case, and what cases put on it.

A floor and two walls of 4 m are baked; a red slab hovers above the floor, casts a shadow and
bounces its color. Cases add one lamp, world, material or kind of geometry to that.
"""

from __future__ import annotations

import atexit
import functools
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np

from .quads import block, mesh_object
from .scene_parts import emitter, matte

PASSES = ("emit", "direct", "indirect", "color")
GRAY, RED, GREEN = (0.6, 0.6, 0.6), (0.7, 0.15, 0.1), (0.1, 0.6, 0.2)
FLOOR = [(-2.0, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]
BACK = [(-2.0, 2, 0), (2, 2, 0), (2, 2, 4), (-2, 2, 4)]
LEFT = [(-2.0, -2, 0), (-2, 2, 0), (-2, 2, 4), (-2, -2, 4)]
SLAB = (-0.9, -0.7, 0.6), (0.6, 0.5, 0.8)
UNIT_SQUARE = [0, 0, 1, 0, 1, 1, 0, 1]


@dataclass(frozen=True)
class Case:
    """``build()`` fills the empty file and returns the object to bake. ``design``: why we differ
    from Cycles on purpose, "" where we must agree. ``stand_in``: what Cycles bakes instead, where
    it cannot bake the case itself. ``effort``: times as many samples as other cases have, where
    Cycles is noisy."""

    name: str
    build: Callable
    passes: tuple[str, ...] = PASSES
    design: str = ""
    stand_in: Callable | None = None
    effort: int = 1


def stage(material=None, slab=None, lit: bool = False):
    """Floor and walls of ``material`` with the UV map "Picture" (each face the whole square), and
    the slab; ``lit`` adds a lamp to see them by. Returns the object to bake."""
    material = material or matte("Stage", GRAY)
    faces = [(np.array(quad), 0) for quad in (FLOOR, BACK, LEFT)]
    thing = mesh_object("Stage", faces, [material])
    layer = thing.data.uv_layers.new(name="Picture")
    layer.uv.foreach_set("vector", UNIT_SQUARE * 3)
    red = slab or matte("Slab", RED)
    mesh_object("Slab", [(quad, 0) for quad in block(*SLAB)], [red])
    if lit:
        area_lamp()
    return thing


def area_lamp(**values):
    """An area lamp above the open corner, looking down into it."""
    return lamp("AREA", (0.8, -1.0, 3.2), (0.35, 0.2, 0.0), energy=150.0, **{"size": 1.0} | values)


def lamp(kind: str, location, rotation=(0.0, 0.0, 0.0), **values):
    """A light object with these settings; returns it."""
    import bpy

    data = bpy.data.lights.new("Lamp", kind)
    for name, value in values.items():
        setattr(data, name, value)
    thing = bpy.data.objects.new("Lamp", data)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(thing)
    return thing


def panel(name: str, corners, material):
    """One square of a material, its UV map the whole square; returns the object."""
    thing = mesh_object(name, [(np.array(corners, float), 0)], [material] if material else [])
    thing.data.uv_layers.new(name="Picture").uv.foreach_set("vector", UNIT_SQUARE)
    return thing


def ceiling(material, name: str = "Panel"):
    """A panel of 1.6 m looking down from a height of 3 m."""
    return panel(name, [(-1.2, -1.2, 3), (-1.2, 0.4, 3), (0.4, 0.4, 3), (0.4, -1.2, 3)], material)


def empty_tree(owner):
    """The node tree of a material, world or lamp, emptied of nodes."""
    if not owner.node_tree:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree


def add_node(tree, kind: str, **inputs):
    """A node ``ShaderNode<kind>``; inputs are values, or output sockets to link; underscores
    stand for spaces."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        socket = node.inputs[name.replace("_", " ")]
        if hasattr(value, "is_output"):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def new_material(name: str):
    """A material with an empty tree: (material, tree)."""
    import bpy

    material = bpy.data.materials.new(name)
    return material, empty_tree(material)


def surface(tree, shader) -> None:
    """Connect a shader node to a new material output."""
    tree.links.new(shader.outputs[0], add_node(tree, "OutputMaterial").inputs["Surface"])


def picture(pixels, space: str = "Non-Color", floats: bool = False):
    """An image in memory from (height, width, 3) values, row 0 at the bottom."""
    import bpy

    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Picture", width, height, alpha=True, float_buffer=floats)
    image.colorspace_settings.name = space
    filled = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)
    image.pixels.foreach_set(np.ascontiguousarray(filled, np.float32).reshape(-1))
    image.update()
    return image


@functools.cache
def scratch() -> Path:
    """A folder for files that cases need, gone when Python ends."""
    folder = tempfile.TemporaryDirectory(prefix="radiosity_parity_")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def stored(image, way: str):
    """The image kept another way: "png" or "exr" as a file on disk, or that file "packed"."""
    import bpy

    end = "exr" if image.is_float else "png"
    path = str(scratch() / f"picture-{image.colorspace_settings.name}.{end}")
    space = image.colorspace_settings.name
    image.filepath_raw, image.file_format = path, {"png": "PNG", "exr": "OPEN_EXR"}[end]
    image.save()
    bpy.data.images.remove(image)
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = space
    if way == "packed":
        image.pack()
    return image


def glow(strength: float = 8.0, color=(1.0, 0.9, 0.7)):
    """An emitting material."""
    return emitter("Glow", color, strength)


def cube(name="Cube", edge: float = 0.6, color=GREEN):
    """A cube about its origin."""
    half = edge / 2
    faces = [(quad + 0.0, 0) for quad in block((-half, -half, -half), (half, half, half))]
    low = [(-half, -half, -half), (-half, half, -half), (half, half, -half), (half, -half, -half)]
    faces.append((np.array(low), 0))  # ``block`` has no bottom below z = 0
    return mesh_object(name, faces, [matte(name, color)])
