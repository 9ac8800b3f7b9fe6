"""What the export's tests build and measure with: planes, node trees and Cycles' own bake."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.fields import srgb_to_linear

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def add_object(bpy, name, data, collection=None, location=(0, 0, 0)):
    """A new object in the scene."""
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    (collection or bpy.context.scene.collection).objects.link(thing)
    return thing


def linked(bpy, path, name):
    """The object ``name`` as a link to the file at ``path``."""
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        wanted.objects = [name]
    return wanted.objects[0]


def add_plane(bpy, name="Plane", size=2.0, material=None, uv="UV"):
    """A horizontal square facing up at the origin, UVs from corner to corner."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(c * size / 2 for c in p) for p in SQUARE], [], [(0, 1, 2, 3)])
    if uv:
        layer = mesh.uv_layers.new(name=uv)
        layer.uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    if material is not None:
        mesh.materials.append(material)
    return add_object(bpy, name, mesh)


def add_material(bpy, name="Material"):
    """A material without nodes but an output; (material, nodes, link)."""
    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    tree.nodes.new("ShaderNodeOutputMaterial")
    return material, tree.nodes, tree.links.new


def surface(material, node):
    """Connect a shader node to the material's output."""
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


def diffuse(bpy, color=(0.5, 0.5, 0.5), name="Diffuse"):
    """A Diffuse BSDF of this color."""
    material, nodes, _ = add_material(bpy, name)
    node = surface(material, nodes.new("ShaderNodeBsdfDiffuse"))
    node.inputs["Color"].default_value = (*color, 1.0)
    return material


def principled(bpy, **inputs):
    """A Principled BSDF with these inputs; underscores stand for spaces."""
    material, nodes, _ = add_material(bpy, "Principled")
    node = surface(material, nodes.new("ShaderNodeBsdfPrincipled"))
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return material


def add_image(bpy, pixels, space="Non-Color", alpha_mode="STRAIGHT", floats=False, name="Picture"):
    """An image in memory with pixels (height, width, 4)."""
    height, width = np.shape(pixels)[:2]
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=floats)
    image.colorspace_settings.name, image.alpha_mode = space, alpha_mode
    image.pixels.foreach_set(np.asarray(pixels, np.float32).reshape(-1))
    image.update()
    return image


def image_material(
    bpy, image, uv=None, alpha=False, shader="ShaderNodeEmission", extension="REPEAT"
):
    material, nodes, link = add_material(bpy)
    node = surface(material, nodes.new(shader))
    texture = nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension = image, extension
    link(texture.outputs["Color"], node.inputs["Color"])
    if alpha:
        link(texture.outputs["Alpha"], node.inputs["Strength"])
    if uv:
        name = nodes.new("ShaderNodeUVMap")
        name.uv_map = uv
        link(name.outputs[0], texture.inputs["Vector"])
    return material


def material_of(exported, triangle=0):
    """The material of a triangle of the exported scene."""
    return exported.scene.materials[exported.scene.material[triangle]]


def cycles_bake(bpy, thing, kind="DIFFUSE", passes=("DIRECT",), size=1, samples=16):
    """(size, size, 3) of Cycles' bake of an object with one UV map and materials."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    image = bpy.data.images.new("Baked", size, size, float_buffer=True, is_data=True)
    for slot in thing.material_slots:
        nodes = slot.material.node_tree.nodes
        node = nodes.new("ShaderNodeTexImage")
        node.image = image
        nodes.active = node
    bpy.context.view_layer.update()
    for other in bpy.context.view_layer.objects:
        other.select_set(other is thing)
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.bake(type=kind, pass_filter=set(passes), margin=0, use_clear=True)
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    for slot in thing.material_slots:
        nodes = slot.material.node_tree.nodes
        nodes.remove(next(n for n in nodes if getattr(n, "image", None) == image))
    return pixels.reshape(size, size, 4)[..., :3]


def value_at(field, triangle, u, v):
    """(3,) of a solver's field at barycentric (u, v), with bilinear lookup clamped at the edge."""
    if hasattr(field, "value"):
        return field.value
    weights = np.array([1 - u - v, u, v])
    if hasattr(field, "values"):
        return weights @ field.values[triangle]
    height, width = field.pixels.shape[:2]
    x, y = (weights @ field.uv[triangle].astype(float)) * (width, height) - 0.5
    column, row = int(np.floor(x)), int(np.floor(y))
    result = np.zeros(3)
    for i, wy in ((row, 1 - (y - row)), (row + 1, y - row)):
        for j, wx in ((column, 1 - (x - column)), (column + 1, x - column)):
            pixel = field.pixels[np.clip(i, 0, height - 1), np.clip(j, 0, width - 1)]
            result += wx * wy * pixel
    return (srgb_to_linear(result) if field.encoded else result) * field.factor + field.offset
