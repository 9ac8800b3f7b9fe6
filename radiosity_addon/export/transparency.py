"""Transparency: what a temporary material lets through, as a node tree of its own.

Cycles can bake colors but not transmittance; so the tree of a temporary material is extended by
nodes that compute it from the same inputs, fed to an Emission. Shaders inside node groups count as
opaque.
"""

from __future__ import annotations

from .node_math import blend, feed, value_of, vector_math
from .sockets import source

THROUGH = ("ShaderNodeBsdfTransparent", "ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction")


def lets_light_through(tree) -> bool:
    """Whether any shader of the tree may be transparent."""
    for node in tree.nodes:
        if node.bl_idname in THROUGH:
            return True
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            alpha, transmission = node.inputs["Alpha"], node.inputs["Transmission Weight"]
            if alpha.is_linked or alpha.default_value < 1.0:
                return True
            if transmission.is_linked or transmission.default_value > 0.0:
                return True
    return False


def emit_transmittance(tree) -> None:
    """Make the tree of a temporary material emit its transmittance and nothing else."""
    output = tree.get_output_node("CYCLES")
    value = _through(tree, output.inputs["Surface"], 0)
    emission = tree.nodes.new("ShaderNodeEmission")
    feed(tree, value, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


def _through(tree, socket, depth: int):
    """A socket or constant with the transmittance of the shader that feeds ``socket``."""
    origin = source(socket)
    if origin is None or depth > 32:
        return (0.0, 0.0, 0.0)
    node = origin[0]
    if node.bl_idname in THROUGH:
        return value_of(node.inputs["Color"])
    if node.bl_idname == "ShaderNodeMixShader":
        a, b = (_through(tree, node.inputs[i], depth + 1) for i in (1, 2))
        return blend(tree, value_of(node.inputs[0]), a, b)
    if node.bl_idname == "ShaderNodeAddShader":
        a, b = (_through(tree, node.inputs[i], depth + 1) for i in (0, 1))
        return vector_math(tree, "ADD", a, b)
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        return _principled(tree, node)
    return (0.0, 0.0, 0.0)


def _principled(tree, node):
    """1 - alpha + alpha · transmission · (1 - metallic) · base color."""
    one = (1.0, 1.0, 1.0)
    alpha, base = value_of(node.inputs["Alpha"]), value_of(node.inputs["Base Color"])
    clear = vector_math(tree, "SUBTRACT", one, value_of(node.inputs["Metallic"]))
    clear = vector_math(tree, "MULTIPLY", clear, value_of(node.inputs["Transmission Weight"]))
    inside = vector_math(tree, "MULTIPLY", vector_math(tree, "MULTIPLY", clear, base), alpha)
    return vector_math(tree, "ADD", vector_math(tree, "SUBTRACT", one, alpha), inside)
