"""Shaders: what a node tree reflects, emits and transmits.

Reads the trees people build most: Principled, Diffuse, Emission, Transparent, Glass, Refraction,
Glossy, Metallic, and Mix and Add of them. Everything else raises NotSimple and is evaluated by
Cycles (see ``evaluated``).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from .colors import (
    ONE,
    ZERO,
    Color,
    NotSimple,
    add,
    affine,
    complement,
    constant,
    mapped,
    mix,
    multiply,
    values,
)
from .microfacets import albedo_of, even, metal
from .principled import coating_albedo, diffuse_share
from .sockets import BACK, FRONT, Reader, source, uses_nodes

SMOOTH = 0.2  # roughness [of 1]: what smoother coatings mirror keeps its direction


@dataclass(frozen=True)
class SurfaceShader:
    """What a shader does with light. ``diffuse`` is what a bake shows; ``reflectance`` what is sent on, gloss
    included. ``glossy`` in [0, 1] is the share that gloss mirrors, and ``sharp`` the part of it that is
    a metal's or a smooth layer's, so that where it goes depends on where it comes from."""

    diffuse: Color = ZERO
    emission: Color = ZERO
    transmittance: Color = ZERO
    reflectance: Color | None = None  # None: the diffuse part
    glossy: float = 0.0
    sharp: float = 0.0

    @property
    def sent_on(self) -> Color:
        """The reflectance."""
        return self.diffuse if self.reflectance is None else self.reflectance


def read_surface(material, reader: Reader) -> SurfaceShader:
    """The surface of a bpy material. Raises NotSimple when Cycles has to evaluate it."""
    if not uses_nodes(material):
        return SurfaceShader(constant(material.diffuse_color[:3]))
    output = material.node_tree.get_output_node("CYCLES")
    if output is None:
        return SurfaceShader()
    origin = source(output.inputs["Surface"])
    if origin is None:
        volume = source(output.inputs["Volume"]) is not None
        return SurfaceShader(transmittance=ONE) if volume else SurfaceShader()
    return _shader(origin[0], reader, 0)


def read_sides(material, reader: Reader) -> tuple[SurfaceShader, SurfaceShader | None]:
    """The surface of a bpy material and, where its tree asks which side is seen, that of its
    back. Raises NotSimple when Cycles has to evaluate it."""
    reader.side, reader.saw_side = FRONT, False
    front = read_surface(material, reader)
    if not reader.saw_side:
        return front, None
    reader.side = BACK
    return front, read_surface(material, reader)


def _shader(node, reader: Reader, depth: int) -> SurfaceShader:
    """The surface of one shader node and those it mixes; the depth is capped against cycles."""
    if node.mute or node.bl_idname not in SHADERS:
        raise NotSimple(f"node {node.name}")
    if depth > 32:
        raise NotSimple("more than 32 shaders in a row")
    return SHADERS[node.bl_idname](node, reader, depth)


def _child(socket, reader: Reader, depth: int) -> SurfaceShader:
    origin = source(socket)
    return SurfaceShader() if origin is None else _shader(origin[0], reader, depth + 1)


def _mix(node, reader: Reader, depth: int) -> SurfaceShader:
    """A Mix Shader: each quantity of both, mixed by the factor."""
    weight = reader.color(node.inputs[0])
    if weight.is_constant:
        weight = constant(np.clip(weight.factor, 0.0, 1.0))
    a, b = (_child(node.inputs[i], reader, depth) for i in (1, 2))
    share = float(np.mean(weight.factor)) if weight.is_constant else 0.5
    return SurfaceShader(
        mix(weight, a.diffuse, b.diffuse),
        mix(weight, a.emission, b.emission),
        mix(weight, a.transmittance, b.transmittance),
        mix(weight, a.sent_on, b.sent_on) if _is_glossy(a, b) else None,
        (1.0 - share) * a.glossy + share * b.glossy,
        (1.0 - share) * a.sharp + share * b.sharp,
    )


def _is_glossy(*surfaces: SurfaceShader) -> bool:
    return any(surface.reflectance is not None for surface in surfaces)


def _add(node, reader: Reader, depth: int) -> SurfaceShader:
    """An Add Shader: the sums of both."""
    a, b = (_child(node.inputs[i], reader, depth) for i in (0, 1))
    return SurfaceShader(
        add(a.diffuse, b.diffuse),
        add(a.emission, b.emission),
        add(a.transmittance, b.transmittance),
        add(a.sent_on, b.sent_on) if _is_glossy(a, b) else None,
        min(a.glossy + b.glossy, 1.0),
        min(a.sharp + b.sharp, 1.0),
    )


def _diffuse(node, reader: Reader, depth: int) -> SurfaceShader:
    return SurfaceShader(reader.color(node.inputs["Color"]))


def _emission(node, reader: Reader, depth: int) -> SurfaceShader:
    strength = reader.color(node.inputs["Strength"])
    if strength.is_constant and strength.is_black:
        return SurfaceShader()
    return SurfaceShader(emission=multiply(reader.color(node.inputs["Color"]), strength))


def _through(node, reader: Reader, depth: int) -> SurfaceShader:
    return SurfaceShader(transmittance=reader.color(node.inputs["Color"]))


def _glossy(node, reader: Reader, depth: int) -> SurfaceShader:
    return _mirror(node, reader, "Color", [even] * 3)


def _metallic(node, reader: Reader, depth: int) -> SurfaceShader:
    edge = node.inputs["Edge Tint"]
    if reader.gloss and (node.fresnel_type != "F82" or edge.is_linked):
        raise NotSimple(f"metal of type {node.fresnel_type}, or its edge")
    fresnels = [functools.partial(metal, edge=share) for share in edge.default_value[:3]]
    return _mirror(node, reader, "Base Color", fresnels)


def _mirror(node, reader: Reader, color: str, fresnels) -> SurfaceShader:
    """A mirror of a ``color``, an input's, and facets of whose reflectance each channel has a function."""
    if not reader.gloss:
        return SurfaceShader(glossy=1.0)
    rough, compensated = reader.number(node.inputs["Roughness"]), node.distribution == "MULTI_GGX"
    sent = mapped(reader.color(node.inputs[color]), lambda values: albedo_of(values, fresnels, rough, compensated))
    share = _share(sent)
    return SurfaceShader(reflectance=sent, glossy=share, sharp=share)


def _share(color: Color) -> float:
    """About how much it is."""
    return float(np.clip(np.mean(values(color)), 0.0, 1.0)) if color.attribute is None else 0.5


def _principled(node, reader: Reader, depth: int) -> SurfaceShader:
    """Diffuse reflectance = base · (1 - metallic) · (1 - transmission) · share below the coating,
    all times alpha; emission = color · strength, times alpha."""
    inputs = node.inputs
    for name in ("Subsurface Weight", "Coat Weight", "Sheen Weight", "Thin Film Thickness"):
        if name in inputs and (inputs[name].is_linked or inputs[name].default_value > 0.0):
            raise NotSimple(name)
    metallic, transmission = (
        reader.color(inputs[name]) for name in ("Metallic", "Transmission Weight")
    )
    level, rough, index = (
        reader.number(inputs[name]) for name in ("Specular IOR Level", "Roughness", "IOR")
    )
    if not np.allclose(inputs["Specular Tint"].default_value[:3], 1.0):
        raise NotSimple("Specular Tint")
    alpha, base = reader.color(inputs["Alpha"]), reader.color(inputs["Base Color"])
    plain = multiply(complement(metallic), complement(transmission))
    reflectance = multiply(multiply(base, plain), constant(diffuse_share(index, rough, level)))
    through = multiply(multiply(base, complement(metallic)), transmission)
    sent, glossy, sharp = _principled_gloss(node, reader, base, plain)
    return SurfaceShader(
        multiply(alpha, reflectance),
        multiply(alpha, _principled_emission(node, reader)),
        add(complement(alpha), multiply(alpha, through)),
        None if sent is None else multiply(alpha, sent),
        glossy,
        sharp,
    )


def _principled_gloss(node, reader: Reader, base: Color, plain: Color):
    """What a Principled BSDF sends on, plain · (base · share below the coating + coating) + metallic · metal,
    before alpha, or None where that is its diffuse part alone; and the shares of light that gloss and
    sharp gloss mirror. ``plain`` is what is neither metal nor glass."""
    level, rough, index = (
        reader.number(node.inputs[name]) for name in ("Specular IOR Level", "Roughness", "IOR")
    )
    compensated = node.distribution == "MULTI_GGX"
    coating, dimmed = coating_albedo(index, rough, level, compensated)
    metallic, below = reader.color(node.inputs["Metallic"]), _share(plain) * coating
    if not reader.gloss or (metallic.is_black and below == 0):
        return None, _share(metallic) + below, 0.0
    mirrors = metallic if metallic.is_black else multiply(metallic, mapped(
        base, lambda values: albedo_of(values, [metal] * 3, rough, compensated)
    ))  # fmt: skip
    metals = _share(mirrors)
    sent = multiply(plain, affine(base, np.full(3, 1 - dimmed), np.full(3, coating)))
    return add(sent, mirrors), metals + below, metals + below * (rough < SMOOTH)


def _principled_emission(node, reader: Reader) -> Color:
    strength = reader.color(node.inputs["Emission Strength"])
    if strength.is_constant and strength.is_black:
        return ZERO
    return multiply(reader.color(node.inputs["Emission Color"]), strength)


SHADERS = {
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeEmission": _emission,
    "ShaderNodeBsdfTransparent": _through,
    "ShaderNodeBsdfGlass": _through,
    "ShaderNodeBsdfRefraction": _through,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}
