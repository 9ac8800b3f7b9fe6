"""Sockets: the color that arrives at an input of a node."""

from __future__ import annotations

import warnings

import numpy as np

from .colors import Color, Mapping, NotSimple, constant, values
from .images import MISSING, is_missing, read_pixels

FRONT, BACK = 0.0, 1.0  # values [of a socket] that Cycles' Backfacing output gives
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec.709, as Cycles' color to float


def source(socket):
    """(node, output socket) that feeds ``socket`` past reroutes, or None. Cycles are cut off."""
    for _ in range(64):
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return None
        node, output = links[0].from_node, links[0].from_socket
        if node.bl_idname != "NodeReroute":
            return node, output
        socket = node.inputs[0]
    return None


def uses_nodes(block) -> bool:
    """Whether a material, light or world is described by its node tree."""
    if block.node_tree is None:
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # always true in later Blenders
        return bool(getattr(block, "use_nodes", True))


class Reader:
    """Reads sockets of one material; keeps the pixels of images that several materials use."""

    def __init__(self, rec709: bool, gloss: bool = False):
        self.rec709 = rec709
        self.gloss = gloss  # whether what shaders mirror is read
        self.side = FRONT
        self.saw_side = False  # whether anything read asked which side is seen
        self._pixels: dict = {}

    def number(self, socket) -> float:
        """A constant number. Raises NotSimple when the socket varies."""
        color = self.color(socket)
        if not color.is_constant:
            raise NotSimple(f"{socket.name} varies")
        return float(color.factor[0])

    def color(self, socket) -> Color:
        """What arrives at the socket; numbers become gray. Raises NotSimple for nodes that Cycles has to
        evaluate."""
        origin = source(socket) if socket.is_linked else None
        if origin is None:
            value = socket.default_value
            return constant(value if np.isscalar(value) else tuple(value)[:3])
        node, output = origin
        if node.mute or node.bl_idname not in COLORS:
            raise NotSimple(f"node {node.name}")
        color = COLORS[node.bl_idname](self, node, output)
        to_number = socket.type == "VALUE" and output.type in ("RGBA", "VECTOR")
        return _gray(color) if to_number else color

    def _rgb(self, node, output) -> Color:
        return constant(tuple(node.outputs[0].default_value)[:3])

    def _value(self, node, output) -> Color:
        return constant(node.outputs[0].default_value)

    def _vertex_color(self, node, output) -> Color:
        channel = 3 if output.name == "Alpha" else None
        return Color(np.ones(3), attribute=node.layer_name, channel=channel)

    def _attribute(self, node, output) -> Color:
        if node.attribute_type != "GEOMETRY" or output.name not in ("Color", "Alpha"):
            raise NotSimple(f"attribute of type {node.attribute_type}, output {output.name}")
        return Color(
            np.ones(3),
            attribute=node.attribute_name,
            channel=3 if output.name == "Alpha" else None,
        )

    def _geometry(self, node, output) -> Color:
        if output.identifier != "Backfacing":
            raise NotSimple(f"geometry output {output.name}")
        self.saw_side = True
        return constant(self.side)

    def _image(self, node, output) -> Color:
        """What an image node shows at its ``output``. Raises NotSimple where more than a UV map
        decides it."""
        if node.projection != "FLAT" or node.interpolation not in ("Linear", "Closest", "Cubic"):
            raise NotSimple(f"projection {node.projection}")
        image = node.image
        if image is None or is_missing(image):
            return constant(MISSING if output.name == "Color" else 1.0)
        mapping = Mapping(
            image.name_full, uv_name(node.inputs["Vector"]), node.extension,
            "Closest" if node.interpolation == "Closest" else "Linear",
        )  # fmt: skip
        color, alpha, encoded = self._read(image, bool(node.outputs["Alpha"].is_linked))
        if output.name == "Color":
            return Color(np.ones(3), pixels=color, mapping=mapping, encoded=encoded)
        return Color(np.ones(3), pixels=np.repeat(alpha[..., None], 3, axis=-1), mapping=mapping)

    def _read(self, image, alpha_used: bool):
        key = (image.name_full, alpha_used)
        if key not in self._pixels:
            self._pixels[key] = read_pixels(image, alpha_used, self.rec709)
        return self._pixels[key]


def uv_name(socket) -> str:
    """The UV map that feeds an image; "" the default one. Raises NotSimple for other mappings."""
    origin = source(socket) if socket.is_linked else None
    if origin is None:
        return ""
    node, output = origin
    if node.bl_idname == "ShaderNodeUVMap" and not node.from_instancer:
        return node.uv_map
    if node.bl_idname == "ShaderNodeTexCoord" and output.name == "UV" and not node.from_instancer:
        return ""
    if node.bl_idname == "ShaderNodeAttribute" and output.name == "Vector":
        return node.attribute_name
    raise NotSimple(f"texture coordinates from {node.name}")


def _gray(color: Color) -> Color:
    """Color to number by luminance."""
    if color.is_constant:
        return constant(float(color.factor @ LUMINANCE))
    if color.attribute is not None:
        if color.channel == 3:
            return color
        raise NotSimple("number from a color attribute")
    gray = values(color) @ LUMINANCE
    return Color(np.ones(3), pixels=np.repeat(gray[..., None], 3, axis=-1), mapping=color.mapping)


COLORS = {
    "ShaderNodeRGB": Reader._rgb,
    "ShaderNodeValue": Reader._value,
    "ShaderNodeVertexColor": Reader._vertex_color,
    "ShaderNodeAttribute": Reader._attribute,
    "ShaderNodeTexImage": Reader._image,
    "ShaderNodeNewGeometry": Reader._geometry,
}
