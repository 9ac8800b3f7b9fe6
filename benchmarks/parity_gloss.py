"""Parity cases of gloss: what metals, gloss and coatings mirror goes on as if they were matte.

A room of six sides, of which three are baked, or a box on the stage that mirrors onto it.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from .parity_stage import GRAY, Case, add_node, lamp, new_material, stage, surface
from .quads import mesh_object, room
from .scene_parts import matte

ANGLE = "what is mirrored goes on all around, as much of it at all angles as in the mean"
HIGH = (2.0, 2.0, 4.0)


def principled(name: str, base=0.8, **inputs):
    """A gray Principled BSDF with these inputs."""
    material, tree = new_material(name)
    surface(tree, add_node(tree, "BsdfPrincipled", Base_Color=(base, base, base, 1), **inputs))
    return material


def closed(material, slab=None):
    """The stage with the ceiling and the other walls of one material, lit by a lamp in the corner."""
    thing = stage(material, slab=slab or material)
    quads = room((-HIGH[0], -HIGH[1], 0.0), HIGH, skip=("-z", "+y", "-x"))
    mesh_object("Rest", [(quad, 0) for _, quad in quads], [material])
    lamp("POINT", (0.9, -0.9, 2.7), energy=200.0, shadow_soft_size=0.1)
    return thing


def principled_room(**inputs):
    """A closed room of one Principled BSDF."""
    return closed(principled("Room", **inputs))


def glossy_mix():
    """A closed room of a quarter gloss: Mix Shader of a diffuse and a glossy surface."""
    material, tree = new_material("Room")
    mirror = add_node(tree, "BsdfAnisotropic", Color=(0.8, 0.8, 0.8, 1), Roughness=0.4)
    cloth = add_node(tree, "BsdfDiffuse", Color=(0.6, 0.6, 0.6, 1))
    mix = add_node(tree, "MixShader", Fac=0.25)
    tree.links.new(cloth.outputs[0], mix.inputs[1])
    tree.links.new(mirror.outputs[0], mix.inputs[2])
    surface(tree, mix)
    return closed(material)


def textured_roughness():
    """A closed room of a Principled BSDF whose roughness is noise, which Cycles evaluates."""
    material, tree = new_material("Room")
    grain = add_node(tree, "TexNoise", Scale=2.0)
    surface(tree, add_node(tree, "BsdfPrincipled", Base_Color=(0.8, 0.8, 0.8, 1),
                           Roughness=grain.outputs[0]))  # fmt: skip
    return closed(material)


def metal_ball(**inputs):
    """A metallic ball in a closed matte room."""
    import bpy

    thing = closed(matte("Room", GRAY))
    bpy.data.objects.remove(bpy.data.objects["Slab"])
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, location=(-0.6, 0.6, 1.4), segments=48, ring_count=24)
    ball = bpy.context.object
    ball.data.materials.append(principled("Ball", **inputs))
    ball.data.polygons.foreach_set("use_smooth", np.ones(len(ball.data.polygons), bool))
    return thing


def white_furnace():
    """A closed white room of the default coating, all of whose faces glow a little."""
    material = principled("Room", 0.9, Emission_Color=(1, 1, 1, 1), Emission_Strength=0.1)
    return closed(material)


CASES = (
    Case("principled room, default", principled_room, design=ANGLE, effort=4),
    Case("principled room, dark", partial(principled_room, base=0.2), design=ANGLE, effort=4),
    Case("principled room, smooth", partial(principled_room, Roughness=0.05), design=ANGLE, effort=8),
    Case("coat", partial(principled_room, Coat_Weight=1.0, Coat_Roughness=0.3), design=ANGLE, effort=4),
    Case("sheen", partial(principled_room, Sheen_Weight=0.5), design=ANGLE, effort=4),
    Case("roughness of noise", textured_roughness, design=ANGLE, effort=4),
    Case("glossy mix", glossy_mix, design=ANGLE, effort=4),
    Case("half metal", partial(principled_room, Metallic=0.5), design=ANGLE, effort=4),
    Case("metallic ball", partial(metal_ball, Metallic=1.0, Roughness=0.4), design=ANGLE, effort=4),
    Case("metallic ball, mirror", partial(metal_ball, Metallic=1.0, Roughness=0.0), design=ANGLE, effort=8),
    Case("bright room that glows", white_furnace, design=ANGLE, effort=4),
)
