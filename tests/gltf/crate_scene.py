"""A small scene for engines: a floor, a crate with a picture as its color, a bare box, a lamp."""

from __future__ import annotations

import numpy as np

from tests.export.scene_building import add_object

SIZE = (320, 240)  # px
SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))


def build(bpy, path) -> None:
    """Save the scene. Crate's picture has 2 × 2 blocks of colors on the UV map ``Paint``."""
    scene = bpy.context.scene
    _box(bpy, "Floor", (0, 0, -0.1), (3, 3, 0.1), _paint(bpy, "Gray", None), cuts=12)
    crate = _box(bpy, "Crate", (0.8, 0, 0.5), (0.5, 0.5, 0.5), _paint(bpy, "Picture", _blocks(bpy)))
    layer = crate.data.uv_layers.new(name="Paint")
    square = np.tile([0, 0, 1, 0, 1, 1, 0, 1], len(crate.data.polygons)).astype(np.float32)
    layer.data.foreach_set("uv", square)
    _box(bpy, "Bare", (-0.8, 0, 0.5), (0.5, 0.5, 0.5), None)
    lamp = bpy.data.lights.new("Bulb", "POINT")
    lamp.energy, lamp.shadow_soft_size = 120, 0.3
    add_object(bpy, "Bulb", lamp, location=(0, -2.2, 2.6))
    camera = bpy.data.cameras.new("Camera")
    add_object(bpy, "Camera", camera, location=(0, -4.5, 2.6)).rotation_euler = (1.1, 0, 0)
    scene.camera = bpy.data.objects["Camera"]
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def rendered(bpy, show, folder) -> np.ndarray:
    """(height, width, 3) linear, bottom row first, by Cycles with ``show(item)`` as materials."""
    scene = bpy.context.scene
    for item in [i for i in scene.objects if i.type == "MESH"]:
        item.data.materials.clear()
        item.data.materials.append(show(item))
    scene.render.engine, scene.cycles.samples = "CYCLES", 16
    scene.cycles.use_denoising = False
    scene.render.filter_size = 0.5  # px: a pixel's own square, as in a browser
    scene.cycles.filter_width = 1.0
    scene.cycles.pixel_filter_type = "BOX"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "blender.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.empty(SIZE[0] * SIZE[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(SIZE[1], SIZE[0], -1)[..., :3].astype(float)


def glow(bpy, item, lightmap: bool, colored: bool):
    """A material that shows the bake times, where it holds no color, the color of ``item``."""
    material = bpy.data.materials.new("Glow")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, glow = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeEmission")
    links.new(glow.outputs[0], output.inputs["Surface"])
    bake = nodes.new("ShaderNodeTexImage" if lightmap else "ShaderNodeAttribute")
    if lightmap:
        bake.image = bpy.data.images[f"Radiosity_{item.name}"]
        links.new(_uv(nodes, "Radiosity"), bake.inputs["Vector"])
    else:
        bake.attribute_name = "Radiosity"
    color = bake.outputs["Color"]
    if not colored:
        mix = nodes.new("ShaderNodeVectorMath")
        mix.operation = "MULTIPLY"
        links.new(color, mix.inputs[0])
        mix.inputs[1].default_value = (0.8, 0.8, 0.8) if item.name == "Bare" else (0.5, 0.5, 0.5)
        if item.name == "Crate":
            paint = nodes.new("ShaderNodeTexImage")
            paint.image = bpy.data.images["Blocks"]
            links.new(_uv(nodes, "Paint"), paint.inputs["Vector"])
            links.new(paint.outputs["Color"], mix.inputs[1])
        color = mix.outputs[0]
    links.new(color, glow.inputs["Color"])
    return material


def _uv(nodes, name):
    node = nodes.new("ShaderNodeUVMap")
    node.uv_map = name
    return node.outputs["UV"]


def _box(bpy, name, center, half, material, cuts=1):
    """An axis-parallel box; ``cuts`` > 1: only its top, as a grid of that many faces a side."""
    mesh = bpy.data.meshes.new(name)
    if cuts > 1:
        line = np.linspace(-1, 1, cuts + 1)
        points = [(x, y, 1) for y in line for x in line]
        step = cuts + 1
        faces = [(r * step + c, r * step + c + 1, (r + 1) * step + c + 1, (r + 1) * step + c)
                 for r in range(cuts) for c in range(cuts)]  # fmt: skip
    else:
        points = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
        faces = SIDES
    mesh.from_pydata((np.array(points, float) * half).tolist(), [], faces)
    if material is not None:
        mesh.materials.append(material)
    return add_object(bpy, name, mesh, location=center)


def _paint(bpy, name, image):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (0.5, 0.5, 0.5, 1)
    shader.inputs["Specular IOR Level"].default_value = 0
    if image is not None:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        links = material.node_tree.links
        links.new(_uv(material.node_tree.nodes, "Paint"), node.inputs["Vector"])
        links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return material


def _blocks(bpy):
    image = bpy.data.images.new("Blocks", 32, 32)
    pixels = np.ones((32, 32, 4), np.float32)
    pixels[:16, :16, :3], pixels[:16, 16:, :3] = (0.9, 0.3, 0.2), (0.3, 0.8, 0.3)
    pixels[16:, :16, :3], pixels[16:, 16:, :3] = (0.3, 0.4, 0.9), (0.8, 0.8, 0.3)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image
