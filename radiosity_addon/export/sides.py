"""Sides: node trees that show another surface from behind, by the Backfacing output.

A bake looks at fronts only; so the tree of a temporary material is turned around by giving it what
that output has on backs.
"""

from __future__ import annotations

from .sockets import BACK

MAX_DEPTH = 16  # depth [groups in groups], at most


def sees_sides(tree, depth: int = 0) -> bool:
    """Whether the tree, or a group in it, asks which side is seen."""
    return any(
        _backfacing(node)
        or (_is_group(node) and depth < MAX_DEPTH and sees_sides(node.node_tree, depth + 1))
        for node in tree.nodes
    )


def show_back(tree, depth: int = 0) -> None:
    """Make the tree of a temporary material show its back; groups in it are copied first."""
    for node in list(tree.nodes):
        if _is_group(node) and depth < MAX_DEPTH and sees_sides(node.node_tree):
            node.node_tree = node.node_tree.copy()
            show_back(node.node_tree, depth + 1)
        for link in _backfacing(node):
            value = tree.nodes.new("ShaderNodeValue")
            value.outputs[0].default_value = BACK
            tree.links.new(value.outputs[0], link.to_socket)


def _backfacing(node) -> list:
    """The links that leave a Geometry node's Backfacing output."""
    if node.bl_idname != "ShaderNodeNewGeometry":
        return []
    return list(node.outputs["Backfacing"].links)


def _is_group(node) -> bool:
    return node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None
