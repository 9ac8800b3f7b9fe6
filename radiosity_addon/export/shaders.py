"""Shaders: reflectance, emission and transmittance of a node tree.

Reads the trees people build most: Principled, Diffuse, Emission, Transparent, Glass, Refraction,
Glossy, Metallic, and Mix and Add of them. Everything else raises NotSimple and is evaluated by
Cycles (see ``evaluated``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .colors import ONE, ZERO, Color, NotSimple, add, complement, constant, mix, multiply
from .principled import diffuse_share, mirrored_share
from .sockets import BACK, FRONT, Reader, source, uses_nodes


@dataclass(frozen=True)
class SurfaceShader:
    """What a shader does with light; ``glossy`` in [0, 1] is the share it mirrors instead."""

    reflectance: Color = ZERO
    emission: Color = ZERO
    transmittance: Color = ZERO
    glossy: float = 0.0


def read_surface(material, reader: Reader) -> SurfaceShader:
    """The surface of a bpy material. Raises NotSimple when Cycles has to evaluate it."""
    if not uses_nodes(material):
        return SurfaceShader(reflectance=constant(material.diffuse_color[:3]))
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
    weight = reader.color(node.inputs[0])
    if weight.is_constant:
        weight = constant(np.clip(weight.factor, 0.0, 1.0))
    a, b = (_child(node.inputs[i], reader, depth) for i in (1, 2))
    share = float(np.mean(weight.factor)) if weight.is_constant else 0.5
    return SurfaceShader(
        mix(weight, a.reflectance, b.reflectance),
        mix(weight, a.emission, b.emission),
        mix(weight, a.transmittance, b.transmittance),
        (1.0 - share) * a.glossy + share * b.glossy,
    )


def _add(node, reader: Reader, depth: int) -> SurfaceShader:
    a, b = (_child(node.inputs[i], reader, depth) for i in (0, 1))
    return SurfaceShader(
        add(a.reflectance, b.reflectance),
        add(a.emission, b.emission),
        add(a.transmittance, b.transmittance),
        min(a.glossy + b.glossy, 1.0),
    )


def _diffuse(node, reader: Reader, depth: int) -> SurfaceShader:
    return SurfaceShader(reflectance=reader.color(node.inputs["Color"]))


def _emission(node, reader: Reader, depth: int) -> SurfaceShader:
    strength = reader.color(node.inputs["Strength"])
    if strength.is_constant and strength.is_black:
        return SurfaceShader()
    return SurfaceShader(emission=multiply(reader.color(node.inputs["Color"]), strength))


def _through(node, reader: Reader, depth: int) -> SurfaceShader:
    return SurfaceShader(transmittance=reader.color(node.inputs["Color"]))


def _mirror(node, reader: Reader, depth: int) -> SurfaceShader:
    return SurfaceShader(glossy=1.0)


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
    glossy = 1.0 - float(np.mean(plain.factor)) if plain.is_constant else 0.0
    if transmission.is_constant:
        glossy = max(glossy - float(np.mean(transmission.factor)), 0.0)
    glossy += (1.0 - glossy) * mirrored_share(index, rough, level)
    return SurfaceShader(
        multiply(alpha, reflectance),
        multiply(alpha, _principled_emission(node, reader)),
        add(complement(alpha), multiply(alpha, through)),
        glossy,
    )


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
    "ShaderNodeBsdfAnisotropic": _mirror,
    "ShaderNodeBsdfGlossy": _mirror,
    "ShaderNodeBsdfMetallic": _mirror,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}
