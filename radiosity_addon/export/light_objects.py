"""Light objects: every light object that the render sees, whom it lights, and what shades it.

A light hidden from diffuse rays lights nothing that is baked, as in Cycles; a portal gives no light
of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..solver.scene import Lamp
from .colors import NO_LIGHT, NotSimple, multiply, sound
from .images import working_space_is_rec709
from .lamp_detail import beam_warning
from .lamp_shape import LampScene, split, tree_varies, unreadable
from .lamps import read_lamp
from .remarks import tree_remarks
from .sockets import Reader, source, uses_nodes

# Version [of Blender]: from it on lamps that are spheres are shaped by direction.
BY_DIRECTION = (5, 0, 0)


@dataclass(frozen=True)
class Light:
    """A lamp, and the names of the Blender object and of its light data ("" for a sky's sun)."""

    lamp: Lamp
    object: str = ""
    data: str = ""
    shaded: bool = True  # whether anything blocks its light
    matrix: np.ndarray | None = None  # (4, 4) local to world; None of a sky's sun


def read_lights(depsgraph, warnings: list[str]) -> list[Light]:
    """The lamps of an evaluated scene, instanced ones too; those that give no light left out."""
    lights = []
    for entry in depsgraph.object_instances:
        item = entry.object
        if item.type != "LIGHT" or not entry.show_self or not item.visible_diffuse:
            continue
        if item.data.type == "AREA" and getattr(item.data.cycles, "is_portal", False):
            continue
        matrix = np.array(entry.matrix_world, np.float64)
        lamp = read_lamp(item, matrix, warnings)
        if lamp is not None:
            shaded = bool(getattr(item.data, "use_shadow", True))
            lights.append(Light(lamp, item.name, item.data.name, shaded, matrix))
    return lights


def with_node_colors(lights: list[Light], frame: int, warnings: list[str]) -> list[Light]:
    """The lamps times what their node trees make of them. Call inside ``traceless()``."""
    import bpy

    reader, result = Reader(working_space_is_rec709()), []
    shapes = Shapes(frame)
    for light in lights:
        data = bpy.data.lights.get(light.data)
        if data is None or not uses_nodes(data):
            result.append(light)
            continue
        for color, distribution in _tree_light(light, data, reader, shapes, warnings):
            result += _times(light, color, distribution)
    return result


def _times(light: Light, color: np.ndarray, distribution) -> list[Light]:
    """The light with its lamp's strength times a ``color`` (3,), and shaped; none where dark."""
    name = light.lamp.color_field
    values = {name: getattr(light.lamp, name) * color}
    if distribution is not None:
        values["distribution"] = distribution_product(distribution, light.lamp.distribution)
    return [replace(light, lamp=replace(light.lamp, **values))] * bool(np.any(values[name] > 0.0))


def distribution_product(picture: np.ndarray, other: np.ndarray | None) -> np.ndarray:
    """A ``picture`` (h, w) times the ``other``, as fine as the finer one; None: 1."""
    if other is None:
        return picture
    coarse, fine = sorted((picture, other), key=np.size)
    row, column = (
        ((np.arange(size) + 0.5) / size * coarse.shape[axis]).astype(int) for axis, size in enumerate(fine.shape)
    )
    return fine * coarse[np.ix_(row, column)]


def _tree_light(light: Light, data, reader: Reader, shapes: Shapes, warnings: list[str]) -> list:
    """(color (3,), distribution or None) pairs that the lamp's node tree multiplies it with."""
    name = light.object
    warnings += tree_remarks(f'lamp "{name}"', data.node_tree)
    output = data.node_tree.get_output_node("CYCLES")
    origin = source(output.inputs["Surface"]) if output is not None else None
    if origin is None:
        return []
    try:
        color = _emission(origin[0], reader)
    except NotSimple as reason:
        if light.lamp.takes_distribution:
            return shapes.of(light, data, warnings)
        warnings.append(
            f'lamp "{name}": its node tree is more than constants ({reason}). Only point and spot lamps can be baked '
            "with such a tree; of this lamp, its own color and energy are used"
        )
        return [(np.ones(3), None)]
    color, bad = sound(color)
    if bad:
        warnings.append(
            f'lamp "{name}": its node tree gives light that is {NO_LIGHT}; that is taken as 0'
        )
    return [(color, None)]


class Shapes:
    """What node trees make of lamps, rendered once for all lamps of a tree that are turned alike."""

    def __init__(self, frame: int):
        self.frame, self.lamp_scene, self.known = frame, None, {}

    def of(self, light: Light, data, warnings: list[str]) -> list:
        """(color (3,), distribution or None) pairs; none where it is dark in all directions."""
        import bpy

        self.lamp_scene = self.lamp_scene or LampScene(self.frame)
        owner = f'lamp "{light.object}"'
        for text in unreadable(self.lamp_scene, data.node_tree):
            warnings.append(
                f"{owner}: {text} cannot be read; Cycles uses the factor 100 in its place, and so does the bake. "
                "Find the file, or choose another"
            )
        for what in tree_varies(data.node_tree):
            warnings.append(
                f"{owner}: its light changes with distance otherwise than by the inverse square ({what}); the bake "
                "uses the inverse square"
            )
        if _is_sphere(data) and bpy.app.version < BY_DIRECTION:
            warnings.append(
                f"{owner}: with Soft Falloff off, Cycles in this version of Blender varies its light over the surface of "
                "the sphere, and the bake varies it by direction; turn Soft Falloff on, or set the radius to 0"
            )
        key = data.name, light.matrix[:3, :3].round(6).tobytes()
        if key not in self.known:
            factor, error = self.lamp_scene.fine_factor(data, light.matrix)
            self.known[key] = split(factor)
            warnings += beam_warning(owner, error)
        if not self.known[key]:
            warnings.append(f"{owner}: its node tree is black in all directions; it gives no light")
        return self.known[key]


def _is_sphere(data) -> bool:
    """Whether the light is a sphere with an extent, by its own settings."""
    return not getattr(data, "use_soft_falloff", True) and data.shadow_soft_size > 0.0


def _emission(node, reader: Reader) -> np.ndarray:
    """(3,) color × strength of an Emission node. Raises NotSimple for other nodes, and where these vary."""
    if node.bl_idname != "ShaderNodeEmission" or node.mute:
        raise NotSimple(f"node {node.name}")
    strength = reader.color(node.inputs["Strength"])
    origin = source(node.inputs["Color"])
    if origin is not None and origin[0].bl_idname == "ShaderNodeBlackbody":
        temperature = reader.number(origin[0].inputs["Temperature"])
        return blackbody(temperature) * _constant(strength)
    return _constant(multiply(reader.color(node.inputs["Color"]), strength))


def _constant(color) -> np.ndarray:
    if not color.is_constant:
        raise NotSimple("it varies with direction or place")
    return color.factor


def blackbody(temperature: float) -> np.ndarray:
    """(3,) color of this temperature [K] in the working space, as Blender's lamps have it. Raises
    NotSimple where Blender cannot tell."""
    import bpy

    probe = bpy.data.lights.new("Radiosity temporary", "POINT")
    try:
        if not hasattr(probe, "temperature_color"):
            raise NotSimple("a Blackbody node")
        probe.temperature = temperature
        return np.array(probe.temperature_color, np.float64)
    finally:
        bpy.data.lights.remove(probe)
