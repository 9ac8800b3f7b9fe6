"""Arithmetic with the nodes of a tree: what arrives at a socket, and sums and products of it.

A value is an output socket, or a constant as three numbers.
"""

from __future__ import annotations

from .sockets import source


def value_of(socket):
    """What feeds a socket: an output socket, or its own constant as three numbers."""
    origin = source(socket) if socket.is_linked else None
    if origin is not None:
        return origin[1]
    value = socket.default_value
    return (value,) * 3 if isinstance(value, float) else tuple(value)[:3]


def vector_math(tree, operation: str, *values):
    """The output of a vector math node with these inputs."""
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for value, socket in zip(values, node.inputs):
        feed(tree, value, socket)
    return node.outputs[0]


def blend(tree, weight, a, b):
    """(1 - weight)·a + weight·b."""
    return vector_math(tree, "MULTIPLY_ADD", vector_math(tree, "SUBTRACT", b, a), weight, a)


def feed(tree, value, socket) -> None:
    """Bring a value to an input of three or four numbers."""
    if isinstance(value, tuple):
        socket.default_value = value if len(socket.default_value) == 3 else (*value, 1.0)
    else:
        tree.links.new(value, socket)
