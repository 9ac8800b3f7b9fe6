"""Snapshots: everything a user could notice in the open file, to be compared before and after."""

from __future__ import annotations

import warnings

import numpy as np

from tests.export.scene_building import add_material, add_object, add_plane, surface

BUSY = ("is_updated", "is_updated_data", "is_evaluated", "session_uid", "original", "rna_type",
        "is_updated_geometry", "is_updated_transform", "is_updated_shading", "depsgraph",
        "storage_type",  # how Blender packs an attribute, not what it holds
        "vertex_colors",  # color_attributes by their old name
        "uv_layer_clone", "uv_layer_stencil")  # fmt: skip  # known by their indices, too


def add_everything(bpy):
    """A file with materials that Cycles evaluates (of two sides, in a group, with a picture from
    disk), a sky, modifiers, a text, a lamp and render settings of the user's own."""
    material, nodes, link = add_material(bpy, "Noise")
    shader, noise = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeTexNoise")
    link(noise.outputs["Color"], shader.inputs["Color"])
    mix, group = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeGroup")
    group.node_tree = sides_group(bpy)
    link(group.outputs[0], mix.inputs[0])
    link(shader.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    surface(material, mix)
    plane = add_plane(bpy, "Floor", material=material, uv="Radiosity")
    plane.modifiers.new("Levels", "SUBSURF").render_levels = 1
    add_object(bpy, "Text", bpy.data.curves.new("Text", "FONT")).data.body = "x"
    add_object(bpy, "Lamp", bpy.data.lights.new("Lamp", "POINT"))
    world = bpy.data.worlds.new("Sky")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs["Color"])
    scene = bpy.context.scene
    scene.render.engine, scene.render.resolution_x = "CYCLES", 77
    scene.render.filepath, scene.cycles.samples = "//mine", 7
    scene.render.bake.margin, scene.render.use_compositing = 3, True
    scene.frame_set(5)
    return plane


def sides_group(bpy):
    """A node group that gives 1 on backs."""
    group = bpy.data.node_groups.new("Sides", "ShaderNodeTree")
    group.interface.new_socket("Back", in_out="OUTPUT", socket_type="NodeSocketFloat")
    side = group.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    group.links.new(side, group.nodes.new("NodeGroupOutput").inputs[0])
    return group


def values(block, seen=None):
    """The plain values of a data-block and of all that it owns, as one nested structure; of what
    it points to and of what came before in it only the name."""
    seen = set() if seen is None else seen
    seen.add((block.as_pointer(), block.bl_rna.identifier))
    result = {}
    for prop in block.bl_rna.properties:
        if prop.identifier in BUSY:
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            value = getattr(block, prop.identifier)
        if prop.type == "POINTER":
            result[prop.identifier] = owned(value, seen)
        elif prop.type == "COLLECTION":
            items = list(value)
            result[prop.identifier] = [len(items), [owned(item, seen) for item in items[:200]]]
        else:
            plain = isinstance(value, (bool, int, float, str, set))
            result[prop.identifier] = value if plain else np.ravel(value).tolist()
    return result


def owned(value, seen):
    """A property's struct: its values where it is part of the block, else its name."""
    import bpy

    if value is None:
        return None
    apart = isinstance(value, bpy.types.ID) and not getattr(value, "is_embedded_data", False)
    if apart or (value.as_pointer(), value.bl_rna.identifier) in seen:
        return getattr(value, "name", "")
    return values(value, seen)


def flat(value, path=""):
    """A nested structure as {path: plain value}, whose differences can be read."""
    if isinstance(value, dict):
        pairs = value.items()
    elif isinstance(value, (list, tuple)):
        pairs = enumerate(value)
    else:
        return {path: value}
    return {k: v for key, child in pairs for k, v in flat(child, f"{path}/{key}").items()}


def snapshot(bpy):
    """Everything a user could notice: data-blocks, their values, selection, mode, handlers."""
    blocks = {}
    skip = ("all_ids", "screens", "workspaces", "window_managers", "brushes")
    for prop in bpy.data.bl_rna.properties:
        if prop.type == "COLLECTION" and prop.identifier not in skip:
            for block in getattr(bpy.data, prop.identifier):
                blocks[prop.identifier, block.name_full, block.users] = values(block)
    layer = bpy.context.view_layer
    state = [(o.name, o.select_get(), o.hide_get(), o.mode) for o in layer.objects]
    active = layer.objects.active
    handlers = [len(getattr(bpy.app.handlers, n)) for n in dir(bpy.app.handlers) if "render" in n]
    return flat((blocks, state, active and active.name, bpy.context.scene.name, handlers))


def settled(bpy):
    """A snapshot of values that were read before: Blender 4.5 fills some in on that occasion."""
    snapshot(bpy)
    return snapshot(bpy)


def differences(before, after):
    """{path: (before, after)} of what is not the same."""
    paths = before.keys() | after.keys()
    return {p: (before.get(p), after.get(p)) for p in paths if before.get(p) != after.get(p)}
