"""Materials, lamps, worlds and a plane for the benchmark scenes, in one line each."""

from __future__ import annotations


def matte(name: str, color):
    """A Lambertian material."""
    return _surface(name, "ShaderNodeBsdfDiffuse", Color=(*color, 1.0))


def emitter(name: str, color, strength: float):
    """A material that only emits: radiance ``strength`` times ``color``."""
    return _surface(name, "ShaderNodeEmission", Color=(*color, 1.0), Strength=strength)


def glowing(name: str, reflectance: float, exitance: float):
    """Gray, reflecting and emitting at once, as a furnace's walls do; ``exitance`` in W/m²."""
    from math import pi

    material = matte(name, (reflectance,) * 3)
    tree = material.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    diffuse = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    emission, both = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeAddShader")
    emission.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    emission.inputs["Strength"].default_value = exitance / pi
    tree.links.new(diffuse.outputs[0], both.inputs[0])
    tree.links.new(emission.outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], output.inputs["Surface"])
    return material


def _surface(name: str, shader: str, **inputs):
    import bpy

    material = bpy.data.materials.new(name)
    nodes = _nodes(material)
    node, output = nodes.new(shader), nodes.new("ShaderNodeOutputMaterial")
    for socket, value in inputs.items():
        node.inputs[socket].default_value = value
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def _nodes(owner):
    """The nodes of a material or world, emptied; versions differ in whether they exist already."""
    if not owner.node_tree:
        owner.use_nodes = True
    owner.node_tree.nodes.clear()
    return owner.node_tree.nodes


def sky(color, strength: float = 1.0) -> None:
    """A constant world."""
    import bpy

    world = bpy.data.worlds.new("Sky")
    nodes = _nodes(world)
    node, output = nodes.new("ShaderNodeBackground"), nodes.new("ShaderNodeOutputWorld")
    node.inputs["Color"].default_value = (*color, 1.0)
    node.inputs["Strength"].default_value = strength
    world.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    bpy.context.scene.world = world


def sun(strength: float, rotation, angle: float = 0.009) -> None:
    """A sun of irradiance ``strength``; Euler angles [rad], angular diameter [rad]."""
    import bpy

    lamp = bpy.data.lights.new("Sun", "SUN")
    lamp.energy, lamp.angle = strength, angle
    obj = bpy.data.objects.new("Sun", lamp)
    obj.rotation_euler = rotation
    bpy.context.scene.collection.objects.link(obj)


def point(name: str, location, power: float, radius: float, color=(1.0, 1.0, 1.0)) -> None:
    """A point lamp of ``power`` watts."""
    import bpy

    lamp = bpy.data.lights.new(name, "POINT")
    lamp.energy, lamp.shadow_soft_size, lamp.color = power, radius, color
    obj = bpy.data.objects.new(name, lamp)
    obj.location = location
    bpy.context.scene.collection.objects.link(obj)


def plane_under_white_sky(uv_map: str):
    """A plane of reflectance 0.8 with a UV map of that name, under a sky of radiance 0.5: it reflects 0.4."""
    import bpy

    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(matte("Matte", (0.8, 0.8, 0.8)))
    plane.data.uv_layers[0].name = uv_map
    sky((0.5, 0.5, 0.5))
    return plane
