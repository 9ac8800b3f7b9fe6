"""Check: what the solver is given, at its border. Inside, everything is trusted.

Vertices are checked where they are normalized (``geometry``).
"""

from __future__ import annotations

from dataclasses import fields as members
from typing import get_args

import numpy as np

from .expected import Refused
from .fields import Constant, CornerColors, Field
from .receivers import Receivers
from .scene import Quantity, Scene, sides


def check_scene(scene: Scene, receivers: Receivers) -> None:
    """Raise Refused naming the material, lamp or number that cannot be solved with."""
    if receivers.count == 0 or len(scene.triangles) == 0:
        raise Refused("there is no surface to bake: no face with an area takes part")
    if len(receivers.triangle) and not (
        0 <= receivers.triangle.min() <= receivers.triangle.max() < len(scene.triangles)
    ):
        raise ValueError("receivers name triangles that do not exist")
    if not 0 <= scene.material.min() <= scene.material.max() < len(scene.materials):
        raise ValueError("triangles name materials that do not exist")
    for material in sides(scene.materials):
        for quantity in get_args(Quantity):
            if not _finite(getattr(material, quantity)):
                raise Refused(
                    f"the {quantity.replace('_', ' ')} of material {material.name!r} is not finite; give it numbers"
                )
    for lamp in scene.lamps:
        for member in members(lamp):
            value = getattr(lamp, member.name)
            if member.name != "name" and value is not None and not np.isfinite(value).all():
                raise Refused(
                    f"the {member.name} of lamp {lamp.name!r} is {value}; give it finite numbers"
                )
    if scene.sky is not None and not np.isfinite(scene.sky.pixels).all():
        raise Refused("the sky has pixels that are not finite; repair or replace its image")


def _finite(field: Field) -> bool:
    """Whether all the field's numbers are; UVs may be anything."""
    if isinstance(field, Constant):
        return bool(np.isfinite(field.value).all())
    if isinstance(field, CornerColors):
        return bool(np.isfinite(field.values).all())
    return all(bool(np.isfinite(each).all()) for each in (field.pixels, field.factor, field.offset))
