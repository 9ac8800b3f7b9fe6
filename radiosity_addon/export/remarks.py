"""Remarks: what is odd about the user's materials, each in one sentence that names them.

Depends on bpy materials given to it. The bake goes on with what Cycles would show.
"""

from __future__ import annotations

from .images import is_missing
from .sockets import source, uses_nodes

MAX_DEPTH = 16  # of groups in groups
NAMED = 3  # of many objects
TRANSLUCENT = "ShaderNodeBsdfTranslucent"
IMAGE_NODES = ("ShaderNodeTexImage", "ShaderNodeTexEnvironment")


def material_remarks(material) -> list[str]:
    """Missing images, links that Blender ignores, and outputs that nothing feeds."""
    if not uses_nodes(material):
        return []
    name, tree = material.name, material.node_tree
    remarks = [
        f'{what} of material "{name}" is missing; Cycles\' pink is used. Find or pack it'
        for what in missing_images(tree)
    ]
    if any(not link.is_valid for node_tree in _trees(tree) for link in node_tree.links):
        remarks.append(
            f'material "{name}": links that form a cycle or fit no socket are ignored, as in Cycles'
        )
    if any(node.bl_idname == TRANSLUCENT and _is_linked(node) for node in nodes_of(tree)):
        remarks.append(f'material "{name}" is translucent; in the bake no light passes through it')
    output = tree.get_output_node("CYCLES")
    if output is None or not any(source(output.inputs[way]) for way in ("Surface", "Volume")):
        remarks.append(f'material "{name}" has no shader linked to its output; it is black')
    return remarks


def bare_remarks(parts) -> list[str]:
    """One sentence on objects with faces that no material covers."""
    names = list(dict.fromkeys(
        part.name for part in parts if any(m is None for m in _used_materials(part))
    ))  # fmt: skip
    if not names:
        return []
    shown = ", ".join(f'"{name}"' for name in names[:NAMED])
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return [f"faces without material are grey, as in Cycles; objects: {shown}{more}"]


def _used_materials(part) -> set:
    return {part.materials[min(slot, len(part.materials) - 1)] for slot in set(part.mesh.slot)}


def missing_images(tree) -> list[str]:
    """Each image that a linked node of the tree shows and Blender cannot read."""
    found = {}
    for node_tree in _trees(tree):
        for node in node_tree.nodes:
            if node.bl_idname not in IMAGE_NODES or node.mute:
                continue
            if not _is_linked(node):
                continue
            if node.image is None:
                found["an image node's image"] = None
            elif node.image.source in ("FILE", "GENERATED") and is_missing(node.image):
                found[f'image "{node.image.name}"'] = None
    return list(found)


def _is_linked(node) -> bool:
    return any(output.is_linked for output in node.outputs)


def nodes_of(tree):
    """All nodes of a tree and of the groups in it."""
    for node_tree in _trees(tree):
        yield from node_tree.nodes


def _trees(tree, depth: int = 0):
    """The tree and those of the groups in it."""
    yield tree
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and depth < MAX_DEPTH:
            yield from _trees(node.node_tree, depth + 1)
