"""Flat shapes: triangles, rectangles and ellipses in their own coordinates, and their beams."""

from __future__ import annotations

import numpy as np

from ..geometry.vectors import columns
from .light_batch import in_disk

TRIANGLE, RECTANGLE, ELLIPSE = range(3)
RIM = 48  # number [corners] of the polygon that stands for an ellipse


def corner_coordinates(shape: int) -> list[tuple[float, float]]:
    """(s, t) of a shape's corners in order; an ellipse becomes a polygon of the same area."""
    if shape == ELLIPSE:
        azimuth = (np.arange(RIM) + 0.5) * (2 * np.pi / RIM)
        radius = 0.5 * np.sqrt(2 * np.pi / RIM / np.sin(2 * np.pi / RIM))
        return list(zip(0.5 + radius * np.cos(azimuth), 0.5 + radius * np.sin(azimuth)))
    return [(0, 0), (1, 0), (0, 1)] if shape == TRIANGLE else [(0, 0), (1, 0), (1, 1), (0, 1)]


def coordinates_in(
    shape: int | np.ndarray, s: np.ndarray, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(s, t) uniform in the ``shape``, one or (n,), from those in the unit square."""
    if np.all(shape == RECTANGLE):
        return s, t
    fold = (shape == TRIANGLE) & (s + t > 1)
    round_ = shape == ELLIPSE
    if np.any(round_):
        x, y = in_disk(s, t)
        s, t = np.where(round_, 0.5 + 0.5 * x, s), np.where(round_, 0.5 + 0.5 * y, t)
    return (np.where(fold, 1 - s, s), np.where(fold, 1 - t, t)) if np.any(fold) else (s, t)


def each(vectors: np.ndarray, which: int | np.ndarray) -> np.ndarray:
    """(3, n) of vectors (k, 3), or (3, 1) where ``which`` is one of them."""
    return columns(np.take(vectors, np.atleast_1d(which), axis=0))


def spread_falloff(cosine: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalized
    so that the lamp's power does not depend on it."""
    half = np.maximum(spread, 1e-3) / 2
    tangent = np.tan(half)
    gap = tangent - half
    normalize = np.where(gap > 1e-9, 1 / np.maximum(gap, 1e-30), 3 / tangent**3)
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.where(spread < np.pi, np.maximum((tangent - ray) * normalize, 0), 1.0)
