"""Gloss: what materials mirror, from Cycles' bakes of their colors.

A bake of the glossy color has the albedo for light along the normal. Light comes from all around, and
surfaces mirror more of it the more it grazes them. How much more is taken from Blender's default coating.
"""

from __future__ import annotations

import numpy as np

from .principled import coating_albedo, diffuse_share
from .remarks import nodes_of

DEFAULT = 1.5, 0.5  # index of refraction and roughness [of 1]: those of Blender's default coating
MIRRORS = ("ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfMetallic")
LAYERS = ("Specular IOR Level", "Metallic", "Coat Weight")  # of a Principled BSDF


def has_gloss(tree) -> bool:
    """Whether any shader of the tree, or of a group in it, may mirror light."""
    return any(
        node.bl_idname in MIRRORS or (
            node.bl_idname == "ShaderNodeBsdfPrincipled"
            and any(node.inputs[layer].is_linked or node.inputs[layer].default_value > 0 for layer in LAYERS)
        )
        for node in nodes_of(tree)
    )  # fmt: skip


def hemispherical_albedo(mirrored: np.ndarray) -> np.ndarray:
    """The share of light from all around that is mirrored, where ``mirrored`` (...) in [0, 1] is that of light along
    the normal. Blender's default coating mirrors e along the normal and g from all around: of what it does not mirror
    along the normal, the share (g - e) / (1 - e). The same share is taken here of 1 - ``mirrored``; what mirrors less
    than the coating gets g / e times ``mirrored``."""
    along, around = 1 - diffuse_share(*DEFAULT), coating_albedo(*DEFAULT)[0]
    more = mirrored + (around - along) / (1 - along) * (1 - mirrored)
    return np.minimum(around / along * mirrored, more)


def sent_on(diffuse: np.ndarray, mirrored: np.ndarray, through: np.ndarray) -> np.ndarray:
    """The reflectance, (..., 3), of materials whose ``diffuse`` and ``mirrored`` colors are baked and which transmit
    ``through``, all (..., 3): the mirrored share of light from all around, plus the diffuse color dimmed by as much.
    It is at most 1 - ``through``, or the diffuse color where that is more."""
    mirrored = np.clip(mirrored, 0, 1)
    around = hemispherical_albedo(mirrored)
    below = np.divide(1 - around, 1 - mirrored, out=np.zeros_like(mirrored), where=mirrored < 1)
    return np.minimum(diffuse * below + around, np.maximum(1 - through, diffuse)).astype(np.float32)
