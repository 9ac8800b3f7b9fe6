"""Transparency: what a temporary material lets through, as a node tree of its own.

Cycles can bake colours but not transmittance; so the tree of a temporary material is extended by
nodes that compute it from the same inputs, fed to an Emission. Shaders inside node groups count as
opaque.
"""

from __future__ import annotations

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
    _feed(tree, value, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])


def _through(tree, socket, depth: int):
    """A socket or constant with the transmittance of the shader that feeds ``socket``."""
    origin = source(socket)
    if origin is None or depth > 32:
        return (0.0, 0.0, 0.0)
    node = origin[0]
    if node.bl_idname in THROUGH:
        return _value(node.inputs["Color"])
    if node.bl_idname == "ShaderNodeMixShader":
        a, b = (_through(tree, node.inputs[i], depth + 1) for i in (1, 2))
        difference = _math(tree, "SUBTRACT", b, a)
        return _math(tree, "MULTIPLY_ADD", difference, _value(node.inputs[0]), a)
    if node.bl_idname == "ShaderNodeAddShader":
        return _math(tree, "ADD", *(_through(tree, node.inputs[i], depth + 1) for i in (0, 1)))
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        return _principled(tree, node)
    return (0.0, 0.0, 0.0)


def _principled(tree, node):
    """1 - alpha + alpha · transmission · (1 - metallic) · base colour."""
    one = (1.0, 1.0, 1.0)
    alpha, base = _value(node.inputs["Alpha"]), _value(node.inputs["Base Color"])
    clear = _math(tree, "SUBTRACT", one, _value(node.inputs["Metallic"]))
    clear = _math(tree, "MULTIPLY", clear, _value(node.inputs["Transmission Weight"]))
    inside = _math(tree, "MULTIPLY", _math(tree, "MULTIPLY", clear, base), alpha)
    return _math(tree, "ADD", _math(tree, "SUBTRACT", one, alpha), inside)


def _value(socket):
    """What feeds a socket: an output socket, or its own constant as three numbers."""
    origin = source(socket) if socket.is_linked else None
    if origin is not None:
        return origin[1]
    value = socket.default_value
    return (value,) * 3 if isinstance(value, float) else tuple(value)[:3]


def _math(tree, operation: str, *values):
    """The output of a vector math node with these inputs."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for value, socket in zip(values, node.inputs):
        _feed(tree, value, socket)
    return node.outputs[0]


def _feed(tree, value, socket) -> None:
    if isinstance(value, tuple):
        socket.default_value = value if len(socket.default_value) == 3 else (*value, 1.0)
    else:
        tree.links.new(value, socket)
