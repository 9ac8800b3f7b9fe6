"""Parity cases of materials: on the stage that is baked, and on what stands beside it.

"""

from __future__ import annotations

from functools import partial

import numpy as np

from .parity_stage import (
    Case,
    add_node,
    ceiling,
    glow,
    new_material,
    panel,
    picture,
    stage,
    stored,
    surface,
)  # fmt: skip
from .scene_parts import sky

SPECULAR = "what faces mirror goes on all around instead of one way; a warning names metals"
DIRECT = ("direct", "color")
GLOSSY = "what the slab mirrors goes on all around instead of one way; a warning names it"
GLASS = "light passes glass straight, tinted; Cycles refracts it and mirrors a part"
PANE = [(-1.5, -1.0, 1.2), (0.5, -1.0, 1.2), (0.5, 0.8, 1.2), (-1.5, 0.8, 1.2)]


def checks(size: int = 16) -> np.ndarray:
    """(size, size, 3): colors that change smoothly, in two halves that differ."""
    y, x = np.mgrid[0:size, 0:size] / (size - 1)
    pixels = np.stack([0.2 + 0.6 * x, 0.3 + 0.4 * y, 0.7 - 0.5 * x * y], axis=-1)
    pixels[:, size // 2 :] *= 0.5
    return pixels


def textured(tree, space="Non-Color", extension="REPEAT", scale=1.0, pixels=None, way=""):
    """The color output of an image on the UV map "Picture", repeated ``scale`` times; ``way``:
    how it is kept (see ``stored``), generated in memory for none."""
    place = add_node(tree, "UVMap")
    place.uv_map = "Picture"
    moved = add_node(tree, "Mapping", Vector=place.outputs[0], Scale=(scale,) * 3)
    node = add_node(tree, "TexImage", Vector=moved.outputs[0])
    node.image = picture(checks() if pixels is None else pixels, space, floats=way == "exr")
    if way:
        node.image = stored(node.image, way)
    node.extension = extension
    return node.outputs["Color"]


def matte_image(**options):
    """The stage covered by a picture."""
    material, tree = new_material("Pictured")
    surface(tree, add_node(tree, "BsdfDiffuse", Color=textured(tree, **options)))
    return stage(material, lit=True)


def principled(name="Principled", **inputs):
    material, tree = new_material(name)
    surface(tree, add_node(tree, "BsdfPrincipled", **inputs))
    return material


def on_stage(**inputs):
    """The stage of a Principled material."""
    return stage(principled(**inputs), lit=True)


def on_slab(**inputs):
    """The slab of a Principled material; the stage matte."""
    return stage(slab=principled(**inputs), lit=True)


def slab_of(kind: str, **inputs):
    """The slab of one shader node."""
    material, tree = new_material(kind)
    surface(tree, add_node(tree, kind, **inputs))
    return stage(slab=material, lit=True)


def vertex_colors():
    """The stage colored by an attribute."""
    material, tree = new_material("Attribute")
    node = add_node(tree, "VertexColor")
    node.layer_name = "Paint"
    surface(tree, add_node(tree, "BsdfDiffuse", Color=node.outputs["Color"]))
    thing = stage(material, lit=True)
    attribute = thing.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    values = np.random.default_rng(2).uniform(0.2, 0.8, (len(thing.data.loops), 4))
    attribute.data.foreach_set("color", values.astype(np.float32).reshape(-1))
    return thing


def noise_color(tree):
    """The color output of noise through a ramp, in object space."""
    place = add_node(tree, "TexCoord").outputs["Object"]
    grain = add_node(tree, "TexNoise", Vector=place, Scale=0.8)
    ramp = add_node(tree, "ValToRGB", Fac=grain.outputs[0])
    ramp.color_ramp.elements[0].color = (0.8, 0.3, 0.1, 1)
    ramp.color_ramp.elements[1].color = (0.1, 0.3, 0.8, 1)
    return ramp.outputs["Color"]


def node_tree(slab: bool):
    """Noise on the stage, or on the slab alone."""
    material, tree = new_material("Noise")
    surface(tree, add_node(tree, "BsdfDiffuse", Color=noise_color(tree)))
    return stage(slab=material, lit=True) if slab else stage(material, lit=True)


def bare_slab():
    """A slab without material: Cycles' default gray."""
    import bpy

    thing = stage(lit=True)
    bpy.data.objects["Slab"].data.materials.clear()
    return thing


def pane(material, lit: bool = True):
    """A pane of this material above the stage."""
    thing = stage(lit=lit)
    panel("Pane", PANE, material)
    return thing


def cutout():
    """A picture's black half is cut out of the pane, through Principled's alpha."""
    stripes = np.zeros((8, 8, 3))
    stripes[:, [0, 1, 4, 5]] = 1.0
    material, tree = new_material("Leaves")
    alpha = textured(tree, extension="EXTEND", pixels=stripes)
    shader = add_node(tree, "BsdfPrincipled", Base_Color=(0.2, 0.7, 0.2, 1), Alpha=alpha)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    surface(tree, shader)
    return pane(material)


def mixed():
    """Half transparent, half matte, by a Mix Shader."""
    material, tree = new_material("Gauze")
    clear = add_node(tree, "BsdfTransparent")
    cloth = add_node(tree, "BsdfDiffuse", Color=(0.8, 0.8, 0.3, 1))
    mix = add_node(tree, "MixShader", Fac=0.5)
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(cloth.outputs[0], mix.inputs[2])
    surface(tree, mix)
    return pane(material)


def tinted():
    material, tree = new_material("Tint")
    surface(tree, add_node(tree, "BsdfTransparent", Color=(0.3, 0.8, 0.4, 1)))
    return pane(material)


def glass(lit_by_sky: bool):
    material, tree = new_material("Glass")
    surface(tree, add_node(tree, "BsdfGlass", Color=(0.5, 0.9, 0.6, 1), IOR=1.45))
    thing = pane(material, lit=not lit_by_sky)
    if lit_by_sky:
        sky((0.7, 0.8, 1.0), 1.0)
    return thing


def glowing_panel(material=None, flipped: bool = False):
    """A glowing panel in the dark; ``flipped`` shows the stage its back."""
    thing = stage()
    panel_object = ceiling(material or glow())
    if flipped:
        panel_object.data.flip_normals()
    return thing


def glowing_picture(on_stage: bool = False):
    """Emission from a picture: of the panel, or of the stage itself."""
    material, tree = new_material("Screen")
    color = textured(tree)
    surface(tree, add_node(tree, "Emission", Color=color, Strength=2.0 if on_stage else 10.0))
    return stage(material, lit=True) if on_stage else glowing_panel(material)


def glowing_nodes():
    """Emission from noise."""
    material, tree = new_material("Aurora")
    surface(tree, add_node(tree, "Emission", Color=noise_color(tree), Strength=10.0))
    return glowing_panel(material)


def glowing_slab():
    """Principled emission of the slab, close above the floor."""
    color = (0.3, 0.6, 1.0, 1.0)
    return stage(slab=principled(Emission_Color=color, Emission_Strength=3.0,
                                 Specular_IOR_Level=0.0))  # fmt: skip


def backfacing():
    """A pane clear from below and matte from above, by the Backfacing output."""
    material, tree = new_material("One way")
    side = add_node(tree, "NewGeometry").outputs["Backfacing"]
    mix = add_node(tree, "MixShader", Fac=side)
    tree.links.new(add_node(tree, "BsdfDiffuse").outputs[0], mix.inputs[1])
    tree.links.new(add_node(tree, "BsdfTransparent").outputs[0], mix.inputs[2])
    surface(tree, mix)
    return pane(material)


def glowing_fronts():
    """A panel upright before the back wall, which its front lights blue and its back does not."""
    material, tree = new_material("Screen")
    side = add_node(tree, "NewGeometry").outputs["Backfacing"]
    color = add_node(tree, "MixRGB", Fac=side, Color1=(0.3, 0.6, 1, 1), Color2=(0, 0, 0, 1))
    surface(tree, add_node(tree, "Emission", Color=color.outputs[0], Strength=10.0))
    thing = stage(lit=True)
    panel("Panel", [(-0.5, 1.2, 1.2), (0.7, 1.2, 1.2), (0.7, 1.2, 2.2), (-0.5, 1.2, 2.2)][::-1],
          material)  # fmt: skip
    return thing


BLUE = (0.2, 0.4, 0.8, 1.0)
CASES = (
    Case("diffuse", partial(stage, lit=True)),
    Case("principled without specular", partial(on_stage, Base_Color=BLUE, Specular_IOR_Level=0.0)),
    Case("principled, default", partial(on_stage, Base_Color=BLUE), design=SPECULAR),
    Case("metallic 0.5 on the stage", partial(on_stage, Base_Color=BLUE, Metallic=0.5,
                                              Specular_IOR_Level=0.0), design=SPECULAR),
    Case("principled, default, direct", partial(on_stage, Base_Color=BLUE), DIRECT),
    Case("metallic 0.5 on the stage, direct", partial(on_stage, Base_Color=BLUE, Metallic=0.5,
                                                      Specular_IOR_Level=0.0), DIRECT),
    Case("metallic slab, rough", partial(on_slab, Metallic=1.0, Roughness=0.8), design=GLOSSY),
    Case("glossy slab", partial(slab_of, "BsdfAnisotropic", Roughness=0.3), design=GLOSSY),
    Case("no material on the slab", bare_slab),
    Case("translucent slab", partial(slab_of, "BsdfTranslucent", Color=BLUE),
         design="light does not pass through translucent surfaces"),
    Case("image, linear, repeat 3", partial(matte_image, scale=3.0)),
    Case("image, sRGB", partial(matte_image, space="sRGB")),
    Case("image file, sRGB", partial(matte_image, space="sRGB", way="png")),
    Case("image file, data", partial(matte_image, way="png")),
    Case("image file, EXR", partial(matte_image, space="Linear Rec.709", way="exr")),
    Case("packed image, sRGB", partial(matte_image, space="sRGB", way="packed")),
    Case("packed image, data", partial(matte_image, way="packed")),
    Case("image, clip", partial(matte_image, extension="CLIP", scale=1.5)),
    Case("image, extend", partial(matte_image, extension="EXTEND", scale=1.5)),
    Case("vertex colors", vertex_colors),
    Case("node tree on the stage", partial(node_tree, False)),
    Case("node tree on the slab", partial(node_tree, True)),
    Case("alpha cutout", cutout),
    Case("mix of transparent and diffuse", mixed),
    Case("tinted transparent", tinted),
    Case("glass under a lamp", partial(glass, False), design=GLASS),
    Case("glass under a sky", partial(glass, True), design=GLASS),
    Case("backfacing", backfacing),
    Case("emission panel", glowing_panel),
    Case("emission panel from behind", partial(glowing_panel, flipped=True)),
    Case("emission of fronts only", glowing_fronts),
    Case("emission texture of a panel", glowing_picture),
    Case("emission texture of the stage", partial(glowing_picture, True)),
    Case("emission node tree", glowing_nodes),
    Case("principled emission, close by", glowing_slab, effort=16),
)  # fmt: skip
