"""Flat shapes: triangles, rectangles and ellipses in their own coordinates, lights of these shapes, and their beams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..array_struct import ArrayStruct
from ..geometry.vectors import columns, dot
from .light_batch import in_disk

TRIANGLE, RECTANGLE, ELLIPSE = range(3)
RIM = 48  # number [corners] of the polygon that stands for an ellipse


@dataclass(frozen=True)
class FlatLights(ArrayStruct):
    """Flat lights of constant radiance: origin + s·u + t·v, as triangles, rectangles, ellipses."""

    color: np.ndarray  # (k, 3) radiance
    shape: np.ndarray  # (k,) TRIANGLE, RECTANGLE or ELLIPSE
    origin: np.ndarray  # (k, 3) normalized; of an ellipse the corner of its parallelogram
    u: np.ndarray  # (k, 3)
    v: np.ndarray  # (k, 3)
    normal: np.ndarray  # (k, 3) unit
    two_sided: np.ndarray  # (k,) bool
    spread: np.ndarray  # (k,) [rad]; π: Lambertian
    front: np.ndarray  # (k,) how likely light that leaves the front goes anywhere, above 0
    back: np.ndarray  # (k,) the same of the back; 0 where it does not shine
    triangle: np.ndarray  # (k,) int: whose texture ``color`` is a mean of, -1: none
    corners: np.ndarray  # (k, 3, 2) barycentric in there, of origin, origin + u, origin + v
    object: np.ndarray  # (k,) int: whose surface it is, -1: a lamp

    @property
    def area(self) -> np.ndarray:
        """(k,) normalized."""
        share = np.array([0.5, 1.0, np.pi / 4])[self.shape]
        return share * np.linalg.norm(np.cross(self.u, self.v), axis=1)

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Centers (k, 3) and radii (k,) of spheres around the lights."""
        return self._spheres

    @cached_property
    def _spheres(self) -> tuple[np.ndarray, np.ndarray]:
        share = np.where(self.shape == TRIANGLE, 1 / 3, 0.5)[:, None]
        corners = [s * self.u + t * self.v - share * (self.u + self.v)
                   for s, t in ((0, 0), (1, 0), (0, 1), (1, 1))]  # fmt: skip
        size = np.array([np.linalg.norm(corner, axis=1) for corner in corners])
        size[3, self.shape == TRIANGLE] = 0
        return self.origin + share * (self.u + self.v), size.max(axis=0)


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


def coordinates_at(
    lights: FlatLights, which: np.ndarray, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(s, t), (n,) each, of ``places`` (3, n) in the planes of lights ``which`` (n,)."""
    origin, u, v = (each(array, which) for array in (lights.origin, lights.u, lights.v))
    away = places - origin
    uu, uv, vv, au, av = (dot(p, q) for p, q in ((u, u), (u, v), (v, v), (away, u), (away, v)))
    below = np.maximum(uu * vv - uv * uv, 1e-300)
    return (au * vv - av * uv) / below, (av * uu - au * uv) / below


def spread_falloff(cosine: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalized
    so that the lamp's power does not depend on it."""
    half = np.maximum(spread, 1e-3) / 2
    tangent = np.tan(half)
    gap = tangent - half
    normalize = np.where(gap > 1e-9, 1 / np.maximum(gap, 1e-30), 3 / tangent**3)
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.where(spread < np.pi, np.maximum((tangent - ray) * normalize, 0), 1.0)
