"""A lamp above the origin, and what each kind brings there by its textbook formula."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.scene import PointLamp, SunLamp
from tests.export.scene_building import add_object

HEIGHT = 2.0


def irradiance(lamp):
    """(3,) [W/m²] at the origin on a surface facing up, from each lamp's textbook formula."""
    if isinstance(lamp, SunLamp):
        return lamp.irradiance * -lamp.direction[2]
    if isinstance(lamp, PointLamp):
        # A soft lamp is a disk of radius r that faces the receiver: E = I / (d² + r²). A ball seen
        # whole brings I / d², seen from inside I / r².
        square, soft = np.sum(lamp.position**2), lamp.radius**2
        whole = max(square, soft) if lamp.sphere else square + soft
        return lamp.intensity / whole * falloff(lamp)
    area = np.linalg.norm(np.cross(lamp.u, lamp.v)) * (np.pi / 4 if lamp.ellipse else 1.0)
    toward = lamp.center / np.linalg.norm(lamp.center)
    cosine = -lamp.normal @ toward
    return lamp.radiance * area * cosine * toward[2] / np.sum(lamp.center**2) * beam(lamp, cosine)


def falloff(lamp):
    """Spot: smoothstep of (cos a - cos c/2) / (blend (1 - cos c/2)), a the angle to the axis."""
    if lamp.axis is None:
        return 1.0
    cosine = -lamp.axis @ lamp.position / np.linalg.norm(lamp.position)
    rim = np.cos(lamp.cone / 2)
    if lamp.blend == 0.0:
        return float(cosine > rim)
    x = np.clip((cosine - rim) / (lamp.blend * (1 - rim)), 0, 1)
    return x * x * (3 - 2 * x)


def shape_at(lamp, way):
    """The lamp's distribution in direction ``way`` (3,), from the four pixels around it."""
    height, width = lamp.distribution.shape
    x, y, z = way / np.linalg.norm(way)
    row = (0.5 + np.arcsin(z) / np.pi) * height - 0.5
    column = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * width - 0.5
    total = 0.0
    for i in (0, 1):
        for j in (0, 1):
            at = np.clip(int(np.floor(row)) + i, 0, height - 1), (int(np.floor(column)) + j) % width
            weight = abs(1 - i - row % 1) * abs(1 - j - column % 1)
            total += weight * lamp.distribution[at]
    return total


def beam(lamp, cosine):
    """Area spread: (tan s/2 - tan a) / (tan s/2 - s/2), a the angle to the normal."""
    if lamp.spread >= np.pi:
        return 1.0
    half = lamp.spread / 2
    return max(np.tan(half) - np.tan(np.arccos(min(cosine, 1.0))), 0) / (np.tan(half) - half)


def add_lamp(bpy, kind, scale=(1, 1, 1), turn=0.0, **attributes):
    data = bpy.data.lights.new("Lamp", kind)
    for name, value in attributes.items():
        setattr(data, name, value)
    lamp = add_object(bpy, "Lamp", data)
    lamp.location, lamp.scale = (0, 0, HEIGHT), scale
    lamp.rotation_euler = (turn, 0, 0)
    return lamp
