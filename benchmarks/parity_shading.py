"""Parity cases of shading normals: smooth, custom and weighted ones; normal and bump maps.

"""

from __future__ import annotations

from functools import partial

import numpy as np

from .parity_stage import Case, add_node, empty_tree, new_material, panel, picture, stage, surface
from .scene_parts import matte

GREEN = (0.1, 0.6, 0.2)
DIRECT = ("direct", "color")
ELEMENTS = "what a surface reflects onto others follows its true normals; direct light agrees"


def ball(material=None, place=(0.9, -0.9, 0.9), scale=(1.0, 1.0, 1.0), smooth=True, sky=0.0):
    """A coarse ball of 16 times 8 faces above the stage's floor."""
    import bpy

    stage(lit=True)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8, radius=0.5, location=place)
    thing = bpy.context.object
    thing.scale = scale
    thing.data.materials.append(material or matte("Ball", GREEN))
    if smooth:
        thing.data.shade_smooth()
    thing.data.uv_layers[0].name = "Radiosity"  # Smart UV Project lays balls out at random
    if sky:
        bpy.context.scene.world = bpy.data.worlds.new("Sky")
        tree = empty_tree(bpy.context.scene.world)
        shade = add_node(tree, "Background", Color=(0.4, 0.6, 1, 1), Strength=sky)
        tree.links.new(shade.outputs[0], add_node(tree, "OutputWorld").inputs["Surface"])
    return thing


def mesh_of(vertices, faces, name="Thing"):
    """A matte object of vertices and faces with a UV map that the bake makes."""
    import bpy

    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], [], faces)
    mesh.materials.append(matte(name, GREEN))
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def hexagon():
    """A smooth column of six sides: normals 30° off the faces at its edges."""
    stage(lit=True)
    angle = np.pi / 3 * np.arange(6)
    ring = np.stack([0.9 + 0.4 * np.cos(angle), -0.9 + 0.4 * np.sin(angle)], 1)
    vertices = [(*p, z) for z in (0.3, 1.8) for p in ring]
    faces = [(k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k) for k in range(6)]
    thing = mesh_of(vertices, faces, "Column")
    thing.data.shade_smooth()
    return thing


def weighted():
    """A beveled box, shaded smooth, with weighted normals."""
    import bpy

    stage(lit=True)
    bpy.ops.mesh.primitive_cube_add(size=0.8, location=(0.9, -0.9, 0.9))
    thing = bpy.context.object
    thing.data.materials.append(matte("Box", GREEN))
    bevel = thing.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.1, 2
    bpy.ops.object.modifier_apply(modifier="Bevel")
    thing.data.shade_smooth()
    thing.modifiers.new("Weighted", "WEIGHTED_NORMAL").keep_sharp = True
    for layer in list(thing.data.uv_layers):
        thing.data.uv_layers.remove(layer)
    return thing


def custom():
    """The stage itself with custom normals: those of a ball around its middle, as on foliage."""
    thing = stage(lit=True)
    mesh = thing.data
    corners = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops])
    inward = np.array([0.0, 0, 2]) - corners
    inward += 3 * np.array([loop.normal for loop in mesh.loops])
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    mesh.normals_split_custom_set(inward.tolist())
    return thing


def bent_quads():
    """Flat shaded quads that are not plane, beside others that are smooth."""
    stage(lit=True)
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(5), np.arange(5), indexing="ij"))
    height = 0.12 * np.sin(1.7 * x) * np.cos(2.3 * y)
    vertices = np.stack([0.4 * x - 0.3, 0.4 * y - 1.9, 1.0 + height], 1)
    faces = [(5 * i + j, 5 * i + 5 + j, 5 * i + 6 + j, 5 * i + 1 + j)
             for i in range(4) for j in range(4)]  # fmt: skip
    thing = mesh_of(vertices, faces, "Waves")
    smooth = np.arange(16) % 3 == 0
    thing.data.polygons.foreach_set("use_smooth", smooth)
    thing.data.update()
    return thing


def bumps(size: int = 32) -> np.ndarray:
    """(size, size, 3): a normal map of waves, up to 27° steep, and its blue channel."""
    y, x = np.mgrid[0:size, 0:size] * (2 * np.pi / size)
    normal = np.stack([0.5 * np.cos(2 * x), 0.5 * np.cos(3 * y), np.ones_like(x)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return 0.5 + 0.5 * normal


def mapped(uv: str, strength=1.0):
    """A matte material with a normal map on the UV map."""
    material, tree = new_material("Normal map")
    place = add_node(tree, "UVMap")
    place.uv_map = uv
    node = add_node(tree, "TexImage", Vector=place.outputs[0])
    node.image = picture(bumps())
    turned = add_node(tree, "NormalMap", Color=node.outputs["Color"], Strength=strength)
    turned.uv_map = uv
    surface(tree, add_node(tree, "BsdfDiffuse", Color=(0.6, 0.6, 0.6, 1),
                           Normal=turned.outputs[0]))  # fmt: skip
    return material


def rough(way: str):
    """A matte material with waves: by a Bump node, or by the output's Displacement."""
    material, tree = new_material("Rough")
    place = add_node(tree, "TexCoord")
    wave = add_node(tree, "TexWave", Vector=place.outputs["Object"], Scale=1.0)
    shader = add_node(tree, "BsdfDiffuse", Color=(0.6, 0.6, 0.6, 1))
    surface(tree, shader)
    height = wave.outputs["Fac" if "Fac" in wave.outputs else "Factor"]
    if way == "bump":
        node = add_node(tree, "Bump", Height=height, Strength=0.8, Distance=0.1)
        tree.links.new(node.outputs[0], shader.inputs["Normal"])
    else:
        node = add_node(tree, "Displacement", Height=height, Scale=0.08)
        output = tree.get_output_node("CYCLES")
        tree.links.new(node.outputs[0], output.inputs["Displacement"])
        material.displacement_method = "BUMP"
    return material


def mapped_ball():
    """A normal map over smooth shading."""
    return ball(mapped("Radiosity"))


def plate(make, *args):
    """A plate of a material before the back wall, with the UV map "Picture"."""
    stage(lit=True)
    corners = [(-1.5, 1.2, 0.8), (0.9, 1.2, 0.8), (0.9, 1.2, 2.8), (-1.5, 1.2, 2.8)]
    return panel("Plate", corners, make(*args))


def stage_of(make, *args):
    """The stage of a material; the whole square of its UV map "Picture" on each face."""
    return stage(make(*args), lit=True)


CASES = (
    Case("smooth ball", ball),
    Case("smooth ball, direct", ball, DIRECT),
    Case("smooth ball under a sky", partial(ball, sky=2.0)),
    Case("smooth ball, mirrored and stretched", partial(ball, scale=(-1.4, 0.7, 1.0))),
    Case("flat ball", partial(ball, smooth=False)),
    Case("smooth column of six sides", hexagon, effort=16),
    Case("smooth column of six sides, direct", hexagon, DIRECT, effort=16),
    Case("weighted normals", weighted),
    Case("custom normals", custom, design=ELEMENTS),
    Case("custom normals, direct", custom, DIRECT),
    Case("flat and smooth quads that are not plane", bent_quads),
    Case("normal map", partial(plate, mapped, "Picture")),
    Case("normal map on all of the stage", partial(stage_of, mapped, "Picture"), design=ELEMENTS),
    Case("normal map on all of the stage, direct", partial(stage_of, mapped, "Picture"), DIRECT),
    Case("normal map on a smooth ball", mapped_ball),
    Case("normal map on a smooth ball, direct", mapped_ball, DIRECT),
    Case("bump node", partial(plate, rough, "bump")),
    Case("bump node on all of the stage, direct", partial(stage_of, rough, "bump"), DIRECT),
    Case("displacement as bump", partial(plate, rough, "displacement")),
)
