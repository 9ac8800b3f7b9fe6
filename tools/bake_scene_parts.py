"""Scene parts: what the scenes of ``bake_scenes`` are made of, put into the open file. Needs bpy."""

from __future__ import annotations

import numpy as np

CORNERS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
INWARD = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6), (0, 4, 5, 1)]
OUTWARD = [quad[::-1] for quad in INWARD]


def add_object(name: str, data):
    import bpy

    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def add_box(name, material, low=(0, 0, 0), high=(3, 2, 2), quads=INWARD):
    """A box between two corners, with a UV map of its sides beside each other."""
    import bpy

    points = np.array(low) + np.array(CORNERS) * (np.array(high) - low)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], quads)
    layer = mesh.uv_layers.new(name="UV")
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    corners = [(square + (k % 3, k // 3)) / (3, 2) for k in range(len(quads))]
    layer.uv.foreach_set("vector", np.concatenate(corners).ravel())
    mesh.materials.append(material)
    return add_object(name, mesh)


def new_material(name: str):
    """A material without nodes but its output; the tree and that node."""
    import bpy

    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    return material, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def matte(color=(0.7, 0.6, 0.5), shader="ShaderNodeBsdfDiffuse", **inputs):
    material, tree, output = new_material(shader)
    node = tree.nodes.new(shader)
    node.inputs["Color"].default_value = (*color, 1)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def mixed(second: str, factor=0.5, node: str | None = None, socket: str = ""):
    """A diffuse material mixed with the shader ``second``, by ``factor`` or a node's output."""
    material, tree, output = new_material(second)
    mix, one = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    mix.inputs[0].default_value = factor
    if node:
        tree.links.new(tree.nodes.new(node).outputs[socket], mix.inputs[0])
    tree.links.new(one.outputs[0], mix.inputs[1])
    tree.links.new(tree.nodes.new(second).outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def new_picture(height=8, width=16, peak=20.0):
    """An image in memory: a pattern with a few bright pixels."""
    import bpy

    image = bpy.data.images.new("Picture", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.full((height, width, 4), 1.0, np.float32)
    pixels[..., :3] = np.linspace(0.1, 0.9, height * width * 3).reshape(height, width, 3)
    pixels[height // 2 + 1, 3:6, :3] = peak
    image.pixels.foreach_set(pixels.ravel())
    image.update()
    return image


def pictured(shader: str):
    """A material whose color is a picture."""
    material, tree, output = new_material("Pictured")
    node, picture = tree.nodes.new(shader), tree.nodes.new("ShaderNodeTexImage")
    picture.image = new_picture()
    tree.links.new(picture.outputs["Color"], node.inputs["Color"])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def add_lamp(lamp_type="POINT", location=(1, 1, 1.5), energy=60.0, **options):
    import bpy

    data = bpy.data.lights.new(lamp_type, lamp_type)
    data.energy = energy
    for name, value in options.items():
        setattr(data, name, value)
    thing = add_object(lamp_type, data)
    thing.location = location
    return thing


def add_sun():
    thing = add_lamp("SUN", energy=3.0, angle=0.02)
    thing.rotation_euler = (0.5, 0.3, 0)
    return thing


def add_world(picture=False):
    import bpy

    world = bpy.data.worlds.new("World")
    if not world.node_tree:
        world.use_nodes = True
    bpy.context.scene.world = world
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.4, 0.6, 1, 1)
    if picture:
        node = world.node_tree.nodes.new("ShaderNodeTexEnvironment")
        node.image = new_picture(32, 64)
        world.node_tree.links.new(node.outputs["Color"], background.inputs["Color"])
