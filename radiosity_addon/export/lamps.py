"""Lamps: Blender's lights in the solver's units.

Blender's own conventions (measured against Cycles in tests/export/test_export_lamps.py): a point or spot
of P watts has intensity P/4π, an area lamp of P watts and area A has radiance P/(πA),
a sun's strength is the irradiance of a surface that faces it.
"""

from __future__ import annotations

import numpy as np

from ..bake.layers import FARTHEST, within_range
from ..solver.scene import AreaLamp, Lamp, PointLamp, SunLamp
from .colors import NO_LIGHT, sound
from .scaled_beam import scaled_beam, widest_cone

SMALLEST_SIZE = 1e-4  # size [m] of an area lamp without extent
SMALLEST_CONE = np.radians(1.0)  # angle [rad] of a cone, at least: Blender's own limit
UNEVEN = 1.001  # ratio [of a spot's scales]: above it its light is a picture, as that of a scaled cone


def read_lamp(item, matrix: np.ndarray, warnings: list[str]) -> Lamp | None:
    """The lamp of an evaluated light object; None when it gives no light.

    ``matrix`` (4, 4) is its world transform. What had to be changed is added to ``warnings``.
    """
    light = item.data
    power, bad = sound(_power(light))
    if bad:
        warnings.append(
            f'lamp "{item.name}" has a color or energy ({light.energy:g}) that is {NO_LIGHT}; that '
            "part is taken as 0"
        )
    elif not np.any(power):
        warnings.append(f'lamp "{item.name}" has no energy or a black color; it gives no light')
    if not np.any(power):
        return None
    if not within_range(matrix[:3, :3] if light.type == "SUN" else matrix[:3]).all():
        warnings.append(
            f'lamp "{item.name}" is left out: its place, rotation or scale is not a number, or beyond '
            f"{FARTHEST:g}"
        )
        return None
    return READERS[light.type](item.name, light, matrix, power, warnings)


def _power(light) -> np.ndarray:
    """(3,) energy × color × 2^exposure × blackbody tint."""
    power = np.array(light.color, np.float64) * light.energy
    power = power * 2.0 ** getattr(light, "exposure", 0.0)
    if getattr(light, "use_temperature", False):
        power = power * np.array(light.temperature_color, np.float64)
    return power


def _unit(vector: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else np.array([0.0, 0.0, -1.0])


def _point(name, light, matrix, power, warnings) -> PointLamp:
    """Intensity P/4π [W/sr]; without ``normalize`` the energy is π times the sphere's radiance, so
    that the intensity is P·r², and P/π for a lamp without radius."""
    radius = float(light.shadow_soft_size)
    intensity = power / (4.0 * np.pi)
    if not getattr(light, "normalize", True):
        intensity = power * (radius**2 if radius > 0.0 else 1.0 / np.pi)
    soft = getattr(light, "use_soft_falloff", True)
    return PointLamp(name, matrix[:3, 3].copy(), intensity, radius, sphere=not soft)


def _spot(name, light, matrix, power, warnings) -> PointLamp:
    """A point lamp with a cone, the blend of its edge, and the axis along its own -z."""
    plain = _point(name, light, matrix, power, warnings)
    cone = float(light.spot_size)
    if cone < SMALLEST_CONE:
        warnings.append(f'spot "{name}" has a cone of {np.degrees(cone):g}°; 1° is used')
        cone = SMALLEST_CONE
    axis, blend, shape = _unit(-matrix[:3, 2]), float(light.spot_blend), None
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    if scale.max() > UNEVEN * scale.min() > 0:
        shape = scaled_beam(matrix[:3, :3], cone, blend)
        cone, blend = widest_cone(scale, cone), 0.0
    return PointLamp(
        name, plain.position, plain.intensity, plain.radius,
        axis=axis, cone=cone, blend=blend, sphere=plain.sphere, distribution=shape,
    )  # fmt: skip


def _sun(name, light, matrix, power, warnings) -> SunLamp:
    """Irradiance; without ``normalize`` the strength is the disk's radiance: E = L π sin²(a/2)."""
    angle = float(light.angle)
    if not getattr(light, "normalize", True) and angle > 0.0:
        power = power * np.pi * np.sin(angle / 2.0) ** 2
    return SunLamp(name, _unit(-matrix[:3, 2]), power, angle)


def _area(name, light, matrix, power, warnings) -> AreaLamp:
    """Radiance P/(πA); without ``normalize`` P/π."""
    width = float(light.size)
    uneven = light.shape in ("RECTANGLE", "ELLIPSE")
    height = float(light.size_y) if uneven else width
    u, v = matrix[:3, 0] * width, matrix[:3, 1] * height
    if min(np.linalg.norm(u), np.linalg.norm(v)) < SMALLEST_SIZE:
        warnings.append(f'area lamp "{name}" has no size; {SMALLEST_SIZE * 1000:g} mm is used')
        u, v = (_at_least(a, i, matrix) for a, i in ((u, 0), (v, 1)))
    ellipse = light.shape in ("DISK", "ELLIPSE")
    area = float(np.linalg.norm(np.cross(u, v))) * (np.pi / 4.0 if ellipse else 1.0)
    radiance = power / np.pi
    if getattr(light, "normalize", True):
        radiance = radiance / area
    return AreaLamp(
        name, matrix[:3, 3].copy(), u, v, _unit(-matrix[:3, 2]), radiance,
        ellipse=ellipse, spread=min(float(light.spread), np.pi),
    )  # fmt: skip


def _at_least(edge: np.ndarray, axis: int, matrix: np.ndarray) -> np.ndarray:
    """The edge, lengthened to SMALLEST_SIZE along its own axis."""
    if np.linalg.norm(edge) >= SMALLEST_SIZE:
        return edge
    direction = matrix[:3, axis]
    if not np.linalg.norm(direction) > 0.0:
        direction = np.eye(3)[axis]
    return _unit(direction) * SMALLEST_SIZE


READERS = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
