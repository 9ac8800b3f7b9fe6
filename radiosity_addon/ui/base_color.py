"""The base color of a material's own node tree, as something that nodes can multiply with."""

from __future__ import annotations

from ..export.node_math import blend, value_of, vector_math
from ..export.sockets import source

BLACK = (0.0, 0.0, 0.0)  # color [linear] of what has none
DEPTH = 32  # depth [shaders mixed in shaders], at most
BASE = {"ShaderNodeBsdfPrincipled": "Base Color", "ShaderNodeBsdfDiffuse": "Color",
        "ShaderNodeSubsurfaceScattering": "Color", "ShaderNodeBsdfTranslucent": "Color",
        "ShaderNodeBsdfSheen": "Color"}  # fmt: skip
OPAQUE_TO_US = ("ShaderNodeGroup", "ShaderNodeBsdfToon", "ShaderNodeBsdfHairPrincipled")


class NoBaseColor(Exception):
    """The tree has a shader whose base color is not to be had."""


def base_color(tree):
    """An output socket of the tree, or three numbers; the tree may gain nodes.

    Shaders mix as in the picture; those without diffuse light count as black. Raises NoBaseColor
    for shaders in node groups.
    """
    output = tree.get_output_node("CYCLES")
    return BLACK if output is None else _of_shader(tree, output.inputs["Surface"], 0)


def _of_shader(tree, socket, depth: int):
    """The base color of the shader that feeds a socket: see ``base_color``."""
    origin = source(socket)
    if origin is None or depth > DEPTH:
        return BLACK
    node = origin[0]
    if node.bl_idname in OPAQUE_TO_US:
        raise NoBaseColor(node.name)
    if node.bl_idname in BASE:
        return value_of(node.inputs[BASE[node.bl_idname]])
    if node.bl_idname not in ("ShaderNodeMixShader", "ShaderNodeAddShader"):
        return BLACK
    mixes = node.bl_idname == "ShaderNodeMixShader"
    a, b = (_of_shader(tree, node.inputs[i], depth + 1) for i in ((1, 2) if mixes else (0, 1)))
    return blend(tree, value_of(node.inputs[0]), a, b) if mixes else vector_math(tree, "ADD", a, b)
