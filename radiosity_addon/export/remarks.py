"""Remarks: what is odd about materials, lamps and worlds, a sentence each that names them.

The bake goes on with what Cycles would show.
"""

from __future__ import annotations

import numpy as np

from ..bake.bake_notes import read_made
from ..bake.image import MARK
from ..figures import quoted
from .colors import INFINITE
from .images import is_missing
from .sockets import source, uses_nodes

MAX_DEPTH = 16  # depth [groups in groups], at most
TRANSLUCENT = "ShaderNodeBsdfTranslucent"
# By type of node, the property that names the attribute that it shows.
NAME_OF_ATTRIBUTE = {"ShaderNodeVertexColor": "layer_name", "ShaderNodeAttribute": "attribute_name"}
IMAGE_NODES = ("ShaderNodeTexImage", "ShaderNodeTexEnvironment")


def material_remarks(material) -> list[str]:
    """What of its tree is missing, ignored, black, or not modeled."""
    if not uses_nodes(material):
        return []
    tree = material.node_tree
    remarks = tree_remarks(f'material "{material.name}"', tree)
    if any(node.bl_idname == TRANSLUCENT and _is_linked(node) for node in nodes_of(tree)):
        remarks.append(
            f'material "{material.name}" is translucent; in the bake no light passes through it'
        )
    return remarks


def world_remarks(world) -> list[str]:
    """What of its tree is missing, ignored or black; or that it has none."""
    if not uses_nodes(world):
        return [f'world "{world.name}" has no nodes; its plain color is used']
    return tree_remarks(f'world "{world.name}"', world.node_tree)


def tree_remarks(owner: str, tree) -> list[str]:
    """Missing images, numbers that are none, links that Blender ignores, and an output that nothing
    feeds."""
    remarks = [
        f"{what} of {owner} is missing; Cycles' pink is used. Find or pack it"
        for what in missing_images(tree)
    ]
    remarks += [
        f"{owner}: {what} is not a number, or above {INFINITE:g}; light above that counts as 0. Give it a smaller number"
        for what in no_numbers(tree)
    ]
    if any(not link.is_valid for node_tree in _trees(tree) for link in node_tree.links):
        remarks.append(
            f"{owner}: links that form a cycle or fit no socket are ignored, as in Cycles"
        )
    output = tree.get_output_node("CYCLES")
    sockets = [] if output is None else [output.inputs.get(name) for name in ("Surface", "Volume")]
    if not any(socket and source(socket) for socket in sockets):
        remarks.append(f"{owner} has no shader linked to its output; it is black")
    return remarks


def library_remarks() -> list[str]:
    """What is linked from files that are not there, or no longer hold it: Blender has nothing of it."""
    import bpy

    lost = {}
    for collection in (bpy.data.objects, bpy.data.collections, bpy.data.meshes, bpy.data.materials):
        for item in collection:
            if item.is_missing and item.library is not None:
                lost.setdefault(item.library.filepath, []).append(item.name)
    return [
        f"linked data is missing and takes no part in the bake: {quoted(list(dict.fromkeys(names)))}, from {path}, a file "
        "that is not there or no longer contains it. Find it by File > External Data > Find Missing Files, or reload it"
        for path, names in lost.items()
    ]


def fed_back_remarks(materials) -> list[str]:
    """A sentence on each material that shows what a bake made, other than those that bakes look through."""
    import bpy

    made = {name for mesh in bpy.data.meshes for name, entry in read_made(mesh).items() if "passes" in entry}
    shown = [(m.name, dict.fromkeys(_baked_things(m.node_tree, made))) for m in materials if uses_nodes(m)]
    return [
        f'material "{name}" shows {", ".join(things)}, which a bake made: it is taken for the surface\'s own color or light, '
        "so that light counts twice. Take it out of the material for the bake, or show it by Build and Put On, which bakes "
        "look through"
        for name, things in shown if things
    ]  # fmt: skip


def _baked_things(tree, attributes: set[str]):
    """Images of bakes, and those of the ``attributes``, that linked nodes of the tree show."""
    for node in nodes_of(tree):
        if node.mute or not _is_linked(node):
            continue
        image, name = getattr(node, "image", None), NAME_OF_ATTRIBUTE.get(node.bl_idname)
        if image is not None and MARK in image:
            yield f'image "{image.name}"'
        elif name is not None and getattr(node, name) in attributes:
            yield f'color attribute "{getattr(node, name)}"'


def bare_remarks(parts) -> list[str]:
    """One sentence on objects with faces that no material covers."""
    names = list(dict.fromkeys(
        part.name for part in parts if any(m is None for m in _used_materials(part))
    ))  # fmt: skip
    return [f"faces without material are gray, as in Cycles; objects: {quoted(names)}"] * bool(names)


def bent_remarks(materials) -> list[str]:
    """One sentence on materials whose maps turn light, for what does not show them."""
    names = [material.name for material in materials]
    return [
        "vertex colors do not show normal and bump maps; bake images to show them; "
        f"materials: {quoted(names)}"
    ] * bool(names)


def moved_remarks(materials) -> list[str]:
    """One sentence on materials that move the surface."""
    names = [m.name for m in materials if _has_displacement(m) and m.displacement_method != "BUMP"]
    return [
        "displacement maps do not move surfaces in the bake; apply them as modifiers; materials: "
        f"{quoted(names)}"
    ] * bool(names)


def bends_light(material) -> bool:
    """Whether its node tree turns normals: a shader's Normal is linked, or a bump map to the
    output."""
    return _is_bumped(material) or turns_shaders(material)


def turns_shaders(material) -> bool:
    """Whether a shader's own Normal is linked: light that grazes the surface then fades."""
    return uses_nodes(material) and any(
        _is_linked(node) and not node.mute and _is_shader(node)
        and any(socket.name == "Normal" and source(socket) for socket in node.inputs)
        for node in nodes_of(material.node_tree)
    )  # fmt: skip


def _is_bumped(material) -> bool:
    return _has_displacement(material) and material.displacement_method != "DISPLACEMENT"


def _is_shader(node) -> bool:
    return any(output.type == "SHADER" for output in node.outputs)


def _has_displacement(material) -> bool:
    if not uses_nodes(material):
        return False
    output = material.node_tree.get_output_node("CYCLES")
    return output is not None and source(output.inputs["Displacement"]) is not None


def blurred_remark(name: str, materials, lost: float) -> str:
    """Of an object whose materials Cycles has to evaluate, in pictures that lack so much of their detail, relative."""
    return (
        f'object "{name}": Cycles evaluates its materials, {quoted(list(materials))}, in a picture that is too coarse for '
        f"the image: its colors are about {100 * lost:.2g} % off. Use image textures, bake without the color pass, or bake a "
        "larger image: up to about 1024² the picture gets finer with it"
    )


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


def no_numbers(tree) -> list[str]:
    """Inputs, and values of nodes without inputs, that are not numbers, or so large that they count as infinite."""
    found = {}
    for node in nodes_of(tree):
        for socket in (*node.inputs, *(node.outputs if not node.inputs else ())):
            if socket.type not in ("VALUE", "RGBA", "VECTOR") or (not socket.is_output and socket.is_linked):
                continue
            values = np.abs(np.atleast_1d(getattr(socket, "default_value", 0.0)))
            if not (values < INFINITE).all():
                found[f"{socket.name} of node {node.name}"] = None
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
