"""World: what lights the scene from infinitely far. Depends on bpy worlds given and NumPy."""

from __future__ import annotations

import numpy as np

from ..solver.scene import Sky
from .colors import NotSimple
from .sockets import Reader, source


def read_world(world, reader: Reader) -> Sky | None:
    """A constant sky, None for a black one. Raises NotSimple when Cycles has to evaluate it."""
    if world is None:
        return None
    color = np.array(world.color, np.float64)
    if world.node_tree is not None and getattr(world, "use_nodes", True):
        color = _surface(world.node_tree, reader)
    if not np.any(color > 0.0):
        return None
    return Sky(np.maximum(color, 0.0).astype(np.float32).reshape(1, 1, 3))


def _surface(tree, reader: Reader) -> np.ndarray:
    """(3,) radiance of a Background node with constant inputs."""
    output = tree.get_output_node("CYCLES")
    origin = source(output.inputs["Surface"]) if output is not None else None
    if origin is None:
        return np.zeros(3)
    node = origin[0]
    if node.bl_idname not in ("ShaderNodeBackground", "ShaderNodeEmission") or node.mute:
        raise NotSimple(f"world node {node.name}")
    strength = reader.color(node.inputs["Strength"])
    if strength.is_constant and strength.is_black:
        return np.zeros(3)
    color = reader.color(node.inputs["Color"])
    if not (color.is_constant and strength.is_constant):
        raise NotSimple("the world varies with direction")
    return color.factor * strength.factor
