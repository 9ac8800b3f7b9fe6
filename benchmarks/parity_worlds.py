"""Parity cases of worlds."""

from __future__ import annotations

from functools import partial

import numpy as np

from .parity_stage import Case, add_node, empty_tree, lamp, picture, stage
from .scene_parts import sky


def constant():
    """The stage under an evenly blue sky."""
    thing = stage()
    sky((0.5, 0.7, 1.0), 1.0)
    return thing


def new_world():
    """The scene's new world: (its empty tree, the function that ends it with a color socket)."""
    import bpy

    bpy.context.scene.world = world = bpy.data.worlds.new("World")
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 1024  # is faster
    tree = empty_tree(world)

    def finish(color, strength=1.0):
        shader = add_node(tree, "Background", Color=color, Strength=strength)
        tree.links.new(shader.outputs[0], add_node(tree, "OutputWorld").inputs["Surface"])

    return tree, finish


def panorama(sun: bool) -> np.ndarray:
    """(128, 256, 3): a sky brighter above than below, with a sun of 3 × 3 pixels 45° high."""
    height = np.linspace(-1, 1, 128)[:, None, None]
    pixels = np.where(height > 0, 0.4 + 0.4 * height, 0.15) * np.array([0.7, 0.85, 1.0])
    pixels = np.repeat(pixels, 256, axis=1)
    pixels[:, :40] *= 1.5
    if sun:
        pixels[95:98, 60:63] = (900.0, 800.0, 600.0)
    return pixels


def environment(sun: bool, turn=(0.0, 0.0, 0.0)):
    """The stage lit by an image, turned by a Mapping node."""
    thing = stage()
    tree, finish = new_world()
    place = add_node(tree, "TexCoord").outputs["Generated"]
    turned = add_node(tree, "Mapping", Vector=place, Rotation=turn)
    image = add_node(tree, "TexEnvironment", Vector=turned.outputs["Vector"])
    image.image = picture(panorama(sun), floats=True)
    finish(image.outputs["Color"])
    return thing


def sky_texture(disk: bool, elevation: float = 0.7):
    """The stage under Blender's default sky texture, its sun where the open corner sees it."""
    thing = stage()
    tree, finish = new_world()
    node = add_node(tree, "TexSky")
    node.sun_disc = disk
    node.sun_elevation, node.sun_rotation = elevation, 2.3
    finish(node.outputs["Color"], 0.1)
    return thing


def noise():
    """A world of noise in two colors, by nodes that no reader knows."""
    thing = stage()
    tree, finish = new_world()
    place = add_node(tree, "TexCoord").outputs["Generated"]
    grain = add_node(tree, "TexNoise", Vector=place, Scale=2.0)
    ramp = add_node(tree, "ValToRGB", Fac=grain.outputs[0])
    ramp.color_ramp.elements[0].color = (0.9, 0.4, 0.1, 1)
    ramp.color_ramp.elements[1].color = (0.1, 0.4, 1.0, 1)
    finish(ramp.outputs["Color"])
    return thing


def light_path():
    """A world that diffuse rays see blue and the camera red."""
    thing = stage()
    tree, finish = new_world()
    path = add_node(tree, "LightPath")
    mix = add_node(tree, "MixRGB", Fac=path.outputs["Is Camera Ray"])
    mix.inputs["Color1"].default_value = (0.2, 0.4, 1.0, 1)
    mix.inputs["Color2"].default_value = (1.0, 0.0, 0.0, 1)
    finish(mix.outputs["Color"])
    return thing


def hidden():
    """A bright world that diffuse rays do not see, and a lamp."""
    import bpy

    thing = constant()
    bpy.context.scene.world.cycles_visibility.diffuse = False
    lamp("POINT", (0.7, -0.8, 2.6), energy=150.0, shadow_soft_size=0.1)
    return thing


CASES = (
    Case("constant", constant),
    Case("image", partial(environment, False)),
    Case("image with a small sun", partial(environment, True)),
    Case("image with a small sun, turned", partial(environment, True, (0.2, -0.3, 1.0))),
    Case("sky texture", partial(sky_texture, False)),
    Case("sky texture with its sun", partial(sky_texture, True)),
    Case("sky texture, low sun", partial(sky_texture, True, 0.15)),
    Case("noise", noise),
    Case("light path", light_path),
    Case("world hidden from diffuse rays", hidden),
)
