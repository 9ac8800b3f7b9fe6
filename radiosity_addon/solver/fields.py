"""Fields: colors that vary over the surface (an image texture, corner colors, a constant).

A field is evaluated at points named by (triangle, barycentric u, v), where a point is ``(1-u-v)·p0
+ u·p1 + v·p2``: Embree's convention, used throughout.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Union

import numpy as np


@dataclass(frozen=True)
class Constant:
    """The same color everywhere."""

    value: np.ndarray  # (3,) float64


@dataclass(frozen=True)
class Texture:
    """An image looked up through a UV map.

    ``pixels``: (height, width, 3) float32, linear working space unless encoded, row 0 at v = 0
    as in Blender.
    ``uv``: (n_triangles, 3, 2) float32, the UV of each corner; shared between textures.
    ``extension``: REPEAT, EXTEND, CLIP (black outside) or MIRROR. ``interpolation``: Linear or
    Closest. ``factor``: (3,) multiplies the lookup, then ``offset`` (3,) is added (of
    reflectances only, and not below 0). ``encoded``:
    the pixels are sRGB-encoded, and decoded after they were interpolated, as Cycles does with 8-bit images.
    """

    pixels: np.ndarray
    uv: np.ndarray
    extension: str = "REPEAT"
    interpolation: str = "Linear"
    factor: np.ndarray | float = 1.0
    encoded: bool = False
    offset: np.ndarray | float = 0.0


@dataclass(frozen=True)
class CornerColors:
    """Colors given at triangle corners and interpolated linearly: (n_triangles, 3, 3) float32."""

    values: np.ndarray


Field = Union[Constant, Texture, CornerColors]


def is_black(field: Field) -> bool:
    """Whether it is nothing everywhere; what varies is taken to be something somewhere."""
    return isinstance(field, Constant) and not np.any(np.asarray(field.value) > 0)


def same_field(a: Field, b: Field) -> bool:
    """Whether two fields are known to be the same: equal constants, or one and the same."""
    constant = isinstance(a, Constant) and isinstance(b, Constant)
    return a is b or (constant and np.array_equal(a.value, b.value))


def is_rescaled(a: Field, b: Field) -> bool:
    """Whether both are known to be one picture, times other factors, those of ``a`` above 0, plus offsets."""
    if not (isinstance(a, Texture) and isinstance(b, Texture) and np.all(np.asarray(a.factor) > 0)):
        return False
    same = (a.extension, a.interpolation, a.encoded) == (b.extension, b.interpolation, b.encoded)
    return same and a.pixels is b.pixels and a.uv is b.uv


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1 decoding, in the values' own precision, float32 at least."""
    values = np.asarray(values)
    values = values.astype(np.result_type(values.dtype, np.float32), copy=False)
    bright = ((np.maximum(values, 0) + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, values / 12.92, bright)


def decoded(texture: Texture) -> Texture:
    """The same texture with linear pixels; between them it differs, if it was encoded."""
    if not texture.encoded:
        return texture
    return replace(texture, pixels=srgb_to_linear(texture.pixels), encoded=False)
