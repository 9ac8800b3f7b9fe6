"""Channels: one where nothing in a scene is colored, else three.

Gray lamps on gray walls need a third of the arithmetic: all that the solver
sums, solves and smooths is as wide as this says.
"""

from __future__ import annotations

import numpy as np

from ..fields import Constant, Field, Texture
from ..scene import Scene, lamp_color, used_sides

ALIKE = 1e-6  # difference [of the largest channel]: channels that differ by less, as conversions leave them, are alike
SAMPLE = 4096  # number [values] of a picture that are compared first: most colored ones show there


def channels_of(scene: Scene) -> int:
    """1 where the channels of every color in use are alike, else 3."""
    used = used_sides(scene)
    fields = [f for m in used for f in (m.reflectance, m.diffuse_reflectance, m.emission, m.transmittance)]
    colors = [np.asarray(lamp_color(lamp)) for lamp in scene.lamps]
    colors += [] if scene.sky is None else [scene.sky.pixels]
    gray = all(map(_gray, colors)) and all(map(_gray_field, fields))
    return 1 if gray else 3


def _gray_field(field: Field) -> bool:
    if isinstance(field, Constant):
        return _gray(np.asarray(field.value))
    if isinstance(field, Texture):
        numbers = (np.asarray(each, float) * np.ones(3) for each in (field.factor, field.offset))
        return all(map(_gray, numbers)) and _gray(field.pixels)
    return _gray(field.values)


def _gray(colors: np.ndarray) -> bool:
    """Whether the three numbers of each of (..., 3) are alike."""
    colors = colors.reshape(-1, 3)
    some = colors[:: max(1, len(colors) // SAMPLE)]
    return _alike(some) and (len(some) == len(colors) or _alike(colors))


def _alike(colors: np.ndarray) -> bool:
    low, high = colors.min(axis=1), colors.max(axis=1)
    return bool((high - low <= ALIKE * np.abs(high)).all())
