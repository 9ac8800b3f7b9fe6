"""Encodings: linear colors as codes of 8 or 16 bits, and back. Imports no bpy.

A color is divided by a scale first, so that what is brighter than 1 need not be cut:

    png, png16   srgb(value / scale), 8 or 16 bits
    linear       value / scale, 8 bits: what loaders of glTF take a lightmap for
    rgbm         value = scale · rgb · alpha, 8 bits, rgb and alpha linear
    rgbe         value = rgb · 2^(255 alpha − 128), 8 bits; its range needs no scale
    hdr          as rgbe, but with rgb in 256ths: what readers of Radiance files make of one
"""

from __future__ import annotations

import numpy as np

from ..solver.adaptive import relative_error
from ..solver.fields import srgb_to_linear

BITS = {"png": 8, "png16": 16, "linear": 8, "rgbm": 8, "rgbe": 8, "hdr": 8}
SRGB = ("png", "png16")
OWN_RANGE = ("rgbm",)  # formats whose scale is the brightest value unless one is named
ONE = {"rgbe": 255, "hdr": 256}  # code [of a mantissa] of 1, of formats with a shared exponent
EXPONENT_OFFSET = 128  # offset [of an exponent] in RGBE (Ward 1991, "Real Pixels")


def encoding_scale(colors: list[np.ndarray], encoding: str, asked: float | None) -> float:
    """What to divide ``colors``, arrays of any shape, by: the scale that is ``asked`` for; the brightest
    value (at least 1e-6) where that is 0, or None for RGBM; else 1."""
    if encoding in ONE:
        return 1.0
    if asked is None:
        asked = 0.0 if encoding in OWN_RANGE else 1.0
    if asked > 0:
        return float(asked)
    return max([1e-6, *(float(c.max()) for c in colors if c.size)])


def share_above(colors: np.ndarray, limit: float) -> float:
    """The share of ``colors`` (n, 3) with a channel above ``limit``, by more than rounding."""
    return float((colors.max(axis=1) > limit * (1 + 1e-6)).mean()) if len(colors) else 0.0


def encode(colors: np.ndarray, encoding: str, scale: float, seed: int = 0) -> np.ndarray:
    """Codes of ``colors`` (..., 3) linear: (..., 3), or (..., 4) for RGBM, RGBE and HDR, as uint8,
    or uint16 for png16. See the module for formulas.

    Dithered: a value between two codes becomes either of them by chance, the nearer the likelier,
    so that its mean is kept and no bands are seen. The same ``seed`` gives the same codes.
    """
    values = np.maximum(np.asarray(colors, np.float64), 0) / scale
    chance = np.random.default_rng(seed).random(values.shape)
    if encoding == "rgbm":
        return _rgbm(np.minimum(values, 1), chance)
    if encoding in ONE:
        return _rgbe(values, chance, ONE[encoding])
    most = 2 ** BITS[encoding] - 1
    values = np.minimum(values, 1)
    values = to_srgb(values) if encoding in SRGB else values
    return _dither(values, most, chance).astype(f"u{BITS[encoding] // 8}")


def decode(codes: np.ndarray, encoding: str, scale: float) -> np.ndarray:
    """The linear colors (..., 3) float64 that an engine reads from ``codes`` (..., 3 or 4)."""
    if encoding in ONE:
        return codes[..., :3] / ONE[encoding] * np.exp2(codes[..., 3:].astype(float) - EXPONENT_OFFSET)
    parts = codes / (2.0 ** BITS[encoding] - 1)
    if encoding == "rgbm":
        return scale * parts[..., :3] * parts[..., 3:]
    return scale * (srgb_to_linear(parts) if encoding in SRGB else parts)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """The sRGB curve (IEC 61966-2-1, 4.4) at values from 0 to 1, of any shape: the inverse of ``srgb_to_linear``."""
    return np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055
    )


def coding_error(colors: np.ndarray, decoded: np.ndarray) -> float:
    """Root mean square of the error of ``decoded`` beside ``colors`` (n, 3), relative as the report's is; rows
    count alike."""
    if not len(colors):
        return 0.0
    scale = relative_error.scale_of(colors, relative_error.area_shares(np.ones(len(colors))))
    return float(np.sqrt((((decoded - colors) / scale) ** 2).mean()))


def _dither(values: np.ndarray, most: int, chance: np.ndarray) -> np.ndarray:
    return np.minimum(np.floor(values * most + chance), most)


def _rgbm(values: np.ndarray, chance: np.ndarray) -> np.ndarray:
    """The smallest multiplier that holds the brightest channel, and the rest in rgb."""
    multiplier = np.clip(np.ceil(values.max(-1, keepdims=True) * 255 - 1e-9), 1, 255)
    rgb = _dither(np.minimum(values * 255 / multiplier, 1), 255, chance)
    return np.concatenate([rgb, multiplier], -1).astype(np.uint8)


def _rgbe(values: np.ndarray, chance: np.ndarray, one: int) -> np.ndarray:
    """The smallest power of two with which the brightest channel is at most 255 of ``one`` as exponent."""
    peak = np.maximum(values.max(-1, keepdims=True), 2.0 ** (1 - EXPONENT_OFFSET))
    exponent = np.minimum(np.ceil(np.log2(peak * one / 255)), 255 - EXPONENT_OFFSET)
    rgb = np.minimum(np.floor(values / np.exp2(exponent) * one + chance), 255)
    return np.concatenate([rgb, exponent + EXPONENT_OFFSET], -1).astype(np.uint8)
