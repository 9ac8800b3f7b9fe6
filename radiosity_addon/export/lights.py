"""Lights: every light object that the render sees. Depends on bpy objects given to it and NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.scene import Lamp
from .colors import NotSimple
from .images import working_space_is_rec709
from .lamps import read_lamp
from .sockets import Reader, source


@dataclass(frozen=True)
class Light:
    """A lamp; ``linked`` names the collection of objects it lights, None when it lights all."""

    lamp: Lamp
    linked: str | None = None


def read_lights(depsgraph, warnings: list[str]) -> list[Light]:
    """The lamps of an evaluated scene, instanced ones too; those that give no light left out."""
    reader = Reader(working_space_is_rec709())
    lights = []
    for entry in depsgraph.object_instances:
        thing = entry.object
        if thing.type != "LIGHT" or not entry.show_self or not _lights_diffuse(thing):
            continue
        matrix = np.array(entry.matrix_world, np.float64)
        color = node_color(thing, reader, warnings)
        lamp = read_lamp(thing, matrix, color, warnings)
        if lamp is not None:
            lights.append(Light(lamp, _receiver_collection(thing)))
    return lights


def _lights_diffuse(thing) -> bool:
    """A light hidden from diffuse rays lights no diffuse surface in Cycles."""
    return bool(thing.visible_diffuse)


def _receiver_collection(thing) -> str | None:
    linking = getattr(thing, "light_linking", None)
    collection = linking.receiver_collection if linking is not None else None
    return collection.name if collection is not None else None


def node_color(thing, reader: Reader, warnings: list[str]) -> np.ndarray:
    """(3,) colour × strength of the light's Emission node; 1 without a node tree."""
    tree = thing.data.node_tree
    if tree is None or not getattr(thing.data, "use_nodes", True):
        return np.ones(3)
    output = tree.get_output_node("CYCLES")
    origin = source(output.inputs["Surface"]) if output is not None else None
    if origin is None:
        return np.zeros(3)
    node = origin[0]
    try:
        if node.bl_idname != "ShaderNodeEmission" or node.mute:
            raise NotSimple(f"node {node.name}")
        color, strength = (reader.color(node.inputs[name]) for name in ("Color", "Strength"))
        if not (color.is_constant and strength.is_constant):
            raise NotSimple("varies with direction or place")
    except NotSimple as reason:
        warnings.append(
            f'lamp "{thing.name}": its node tree is more than constants ({reason}); '
            "the lamp's own colour and energy are used"
        )
        return np.ones(3)
    return color.factor * strength.factor
