"""Colors: what a color socket of a node tree gives, as numbers, an image or a color attribute.

Images that share one mapping can be added and multiplied texel by texel; anything else raises
NotSimple, and the material is left to Cycles.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..solver.fields import Constant, CornerColors, Field, Texture, srgb_to_linear

# Brightness [of anything] from which on it counts as infinite: Blender keeps infinity as 3.4e38, and
# sums of such float32 overflow.
INFINITE = 1e37
NO_LIGHT = f"negative, not a number or above {INFINITE:g}"  # what ``sound`` takes as 0


class NotSimple(Exception):
    """This node tree is more than constants, images and attributes."""


@dataclass(frozen=True)
class Mapping:
    """How an image lies on the surface. ``uv`` is a map's name, "" the one shaders use. ``border``: width and
    height of an image that has got a border of one texel since; None: it has none."""

    image: str
    uv: str
    extension: str
    interpolation: str
    border: tuple[int, int] | None = None


def in_border(uv: np.ndarray, border: tuple[int, int] | None) -> np.ndarray:
    """Coordinates ``uv`` (n, 3, 2) float32 of an image as they are once it has a ``border``."""
    if border is None:
        return uv
    size = np.array(border, float)
    return ((uv * size + 1) / (size + 2)).astype(np.float32)


@dataclass(frozen=True)
class Color:
    """``factor`` (3,) times ``pixels`` (height, width, 3) or times the attribute ``attribute``, plus
    ``offset`` (3,).

    Without either it is the constant ``factor``, and has no offset; attribute "" is the mesh's default one.
    """

    factor: np.ndarray
    pixels: np.ndarray | None = None
    mapping: Mapping | None = None
    attribute: str | None = None
    channel: int | None = None  # 3: the attribute's alpha in place of its color
    encoded: bool = False  # the pixels are sRGB-encoded (see ``solver.fields.Texture``)
    offset: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def is_constant(self) -> bool:
        """Whether it is the same all over the surface."""
        return self.pixels is None and self.attribute is None

    @property
    def is_black(self) -> bool:
        """Whether it is 0 all over the surface."""
        return not (np.any(self.factor) or np.any(self.offset))


def constant(value) -> Color:
    """A constant from a number or three of them."""
    return Color(np.broadcast_to(np.asarray(value, np.float64), (3,)).copy())


ZERO, ONE = constant(0.0), constant(1.0)


def sound(values: np.ndarray) -> tuple[np.ndarray, bool]:
    """``values`` with what no light can be (negative, infinite, not a number) as 0, and whether
    there was any of that."""
    good = (values >= 0.0) & (values < INFINITE)  # NaN is neither
    return (values, False) if good.all() else (np.where(good, values, 0.0), True)


def multiply(a: Color, b: Color) -> Color:
    """a · b."""
    if a.is_constant:
        a, b = b, a
    if b.is_constant:
        return affine(a, b.factor, np.zeros(3))
    a, b = _of_one_mapping(a, b)
    return _picture(a, values(a) * values(b))


def affine(a: Color, factor: np.ndarray, offset: np.ndarray) -> Color:
    """factor · a + offset, for numbers (3,)."""
    offset = factor * a.offset + offset
    if a.is_constant:
        return constant(factor * a.factor + offset)
    if not np.any(factor):
        return constant(offset)
    return replace(a, factor=factor * a.factor, offset=offset)


def mapped(a: Color, function) -> Color:
    """``function`` (k, 3) -> (k, 3) of every value. Raises NotSimple for a color attribute."""
    if a.is_constant:
        return constant(function(a.factor[None])[0])
    if a.attribute is not None:
        raise NotSimple("function of a color attribute")
    a = _bordered(a)
    return _picture(a, function(values(a).reshape(-1, 3)).reshape(a.pixels.shape))


def _picture(a: Color, pixels: np.ndarray) -> Color:
    """Other linear pixels in the place of those of ``a``."""
    return replace(a, pixels=pixels, factor=np.ones(3), encoded=False, offset=np.zeros(3))


def add(a: Color, b: Color) -> Color:
    """a + b. Raises NotSimple where the sum is no Color."""
    if a.is_black:
        return b
    if b.is_black:
        return a
    if a.is_constant and b.is_constant:
        return constant(a.factor + b.factor)
    if a.attribute is not None or b.attribute is not None:
        if not (a.is_constant or b.is_constant):
            raise NotSimple("sum with a color attribute")
        attribute, other = (b, a) if a.is_constant else (a, b)
        return affine(attribute, np.ones(3), other.factor)
    a, b = _bordered(a), _bordered(b)
    if a.pixels is not None and b.pixels is not None:
        a, b = _of_one_mapping(a, b)
    return _picture(a if a.pixels is not None else b, values(a) + values(b))


def complement(a: Color) -> Color:
    """1 - a."""
    return add(ONE, multiply(a, constant(-1.0)))


def mix(weight: Color, a: Color, b: Color) -> Color:
    """(1 - weight)·a + weight·b."""
    return add(multiply(complement(weight), a), multiply(weight, b))


def to_field(color: Color, uv_of, corners_of, limit: float) -> Field:
    """The solver's field; ``uv_of(name, border)`` and ``corners_of(name)`` give the arrays of the scene.

    Color attributes are clamped to [0, limit] here; everything else was before.
    """
    if color.is_constant:
        return Constant(color.factor)
    if color.attribute is not None:
        found = corners_of(color.attribute)
        found = found[..., 3:4] if color.channel == 3 else found[..., :3]
        found = np.nan_to_num(found * color.factor + color.offset, nan=0.0, posinf=0.0, neginf=0.0)
        return CornerColors(np.clip(found, 0.0, limit).astype(np.float32))
    mapping = color.mapping
    pixels = np.ascontiguousarray(color.pixels, np.float32)
    return Texture(
        pixels, uv_of(mapping.uv, mapping.border), mapping.extension, mapping.interpolation, color.factor,
        color.encoded, color.offset,
    )  # fmt: skip


def _of_one_mapping(a: Color, b: Color) -> tuple[Color, Color]:
    """Two images that lie alike, with a border if one of them has one."""
    if a.mapping != b.mapping:
        a, b = _bordered(a), _bordered(b)
    if a.mapping is None or a.mapping != b.mapping:
        raise NotSimple("two images, or an image and an attribute")
    return a, b


def _bordered(color: Color) -> Color:
    """An image of extension Clip with a border of black texels, which go on outward, so that colors made of it hold
    outside of the image, too. Anything else stays as it is."""
    if color.mapping is None or color.mapping.extension != "CLIP":
        return color
    height, width = color.pixels.shape[:2]
    mapping = replace(color.mapping, extension="EXTEND", border=(width, height))
    return replace(color, pixels=np.pad(color.pixels, ((1, 1), (1, 1), (0, 0))), mapping=mapping)


def values(color: Color) -> np.ndarray:
    """The linear values of a constant (3,) or of an image's pixels (height, width, 3), float32."""
    factor = color.factor.astype(np.float32)
    if color.pixels is None:
        return factor
    found = (srgb_to_linear(color.pixels) if color.encoded else color.pixels) * factor
    return found + color.offset.astype(np.float32) if np.any(color.offset) else found


def extremes(color: Color) -> np.ndarray:
    """(k, 3): the least and the greatest values of a constant's or an image's channels; NaN
    where some are."""
    if color.pixels is None:
        return color.factor[None]
    rows = color.pixels.reshape(len(color.pixels), -1)  # long rows take a tenth of the time of short ones
    ends = np.stack([rows.min(axis=0).reshape(-1, 3).min(axis=0), rows.max(axis=0).reshape(-1, 3).max(axis=0)])
    return values(replace(color, pixels=ends))
