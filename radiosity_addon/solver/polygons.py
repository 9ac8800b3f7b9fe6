"""Polygons: flat lights, that is area lamps and emissive faces.

Depends on ``lights``, ``geometry``, ``lambert``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import OFFSET
from .lambert import polygon_form_factor
from .lights import Sample

TRIANGLE, RECTANGLE, ELLIPSE = range(3)
RIM = 48  # corners of the polygon that stands for an ellipse


@dataclass(frozen=True)
class Polygons:
    """Flat lights of constant radiance: origin + s·u + t·v, as triangles, rectangles, ellipses."""

    color: np.ndarray  # (k, 3) radiance
    shape: np.ndarray  # (k,) TRIANGLE, RECTANGLE or ELLIPSE
    origin: np.ndarray  # (k, 3) normalised; of an ellipse the corner of its parallelogram
    u: np.ndarray  # (k, 3)
    v: np.ndarray  # (k, 3)
    normal: np.ndarray  # (k, 3) unit
    two_sided: np.ndarray  # (k,) bool
    spread: np.ndarray  # (k,) [rad]; π: Lambertian

    @property
    def area(self) -> np.ndarray:
        """(k,) normalised."""
        share = np.array([0.5, 1.0, np.pi / 4])[self.shape]
        return share * np.linalg.norm(np.cross(self.u, self.v), axis=1)

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (k, 3) and radii (k,) of spheres around the lights."""
        share = np.where(self.shape == TRIANGLE, 1 / 3, 0.5)[:, None]
        size = np.linalg.norm(self.u, axis=1) + np.linalg.norm(self.v, axis=1)
        return self.origin + share * (self.u + self.v), size

    def sample(self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample light ``which`` (an int, or (n,) of them) uniformly by area, for n points."""
        s, t = self.place(which, xi)
        target = self.origin[which] + s[:, None] * self.u[which] + t[:, None] * self.v[which]
        side = np.einsum("ij,ij->i", position - target, np.broadcast_to(self.normal[which], target.shape))
        lift = np.where(side >= 0, OFFSET, -OFFSET)[:, None] * self.normal[which]
        segment = target + lift - position
        square = np.maximum(np.einsum("ij,ij->i", segment, segment), 1e-30)
        cosine = np.einsum("ij,ij->i", segment, normal)
        weight = np.maximum(cosine, 0) * np.abs(side) / square**2
        shines = self.two_sided[which] | (side > 0)
        segment = segment.astype(np.float32)
        if np.any(self.spread[which] < np.pi):
            beam = spread_falloff(side / np.sqrt(square), self.spread[which])
            value = np.where(shines, weight * beam * self.area[which], 0)
            return Sample(value, (value > 0) * 1.0, segment, 1.0, False)
        factor = np.where(shines, np.pi * self._form_factor(which, position, normal), 0)
        return Sample(factor, np.where(factor > 0, weight, 0), segment, 1.0, True)

    def _form_factor(self, which, position, normal) -> np.ndarray:
        """(n,) Lambert's formula, by shape: every point's light has as many corners."""
        if np.ndim(which) == 0:
            return polygon_form_factor(position, normal, self._corners(which))
        result = np.empty(len(position))
        for shape in np.unique(self.shape[which]):
            some = np.flatnonzero(self.shape[which] == shape)
            corners = self._corners(which[some])
            result[some] = polygon_form_factor(position[some], normal[some], corners)
        return result

    def _corners(self, which) -> list[np.ndarray]:
        """Corners in order, (3,) or (n, 3) each; an ellipse becomes a polygon of the same area."""
        shape = self.shape[which] if np.ndim(which) == 0 else self.shape[which][0]
        places = [(0, 0), (1, 0), (0, 1)] if shape == TRIANGLE else [(0, 0), (1, 0), (1, 1), (0, 1)]
        if shape == ELLIPSE:
            turn = (np.arange(RIM) + 0.5) * (2 * np.pi / RIM)
            radius = 0.5 * np.sqrt(2 * np.pi / RIM / np.sin(2 * np.pi / RIM))
            places = np.stack([0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)], 1)
        origin, u, v = self.origin[which], self.u[which], self.v[which]
        return [origin + s * u + t * v for s, t in places]

    def place(self, which, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(n,) s and t, uniform in the light's shape."""
        s, t, shape = xi[:, 0], xi[:, 1], self.shape[which]
        fold = (shape == TRIANGLE) & (s + t > 1)
        round_ = shape == ELLIPSE
        if np.any(round_):
            radius, turn = 0.5 * np.sqrt(s), 2 * np.pi * t
            s = np.where(round_, 0.5 + radius * np.cos(turn), s)
            t = np.where(round_, 0.5 + radius * np.sin(turn), t)
        return np.where(fold, 1 - s, s), np.where(fold, 1 - t, t)

    def strength(self, which, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) rough irradiance of lights at points, above 0 wherever any may arrive."""
        center, size = self.middle()
        toward = center[which] - position
        square = np.einsum("...j,...j->...", toward, toward)
        reach = size[which] ** 2
        distance = np.sqrt(np.maximum(square, 1e-30))
        slack = np.minimum(size[which] / distance, 1)
        facing = np.einsum("...j,...j->...", toward, normal) / distance + slack
        leaving = -np.einsum("...j,...j->...", toward, self.normal[which]) / distance
        leaving = np.where(self.two_sided[which], np.abs(leaving), leaving) + slack
        power = (self.area * self.color.mean(axis=1))[which]
        return power * np.maximum(facing, 0) * np.maximum(leaving, 0) / (square + reach)


def spread_falloff(cosine: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalised
    so that the lamp's power does not depend on it."""
    half = np.maximum(spread, 1e-3) / 2
    tangent = np.tan(half)
    gap = tangent - half
    normalise = np.where(gap > 1e-9, 1 / np.maximum(gap, 1e-30), 3 / tangent**3)
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.where(spread < np.pi, np.maximum((tangent - ray) * normalise, 0), 1.0)
