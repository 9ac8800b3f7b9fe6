"""Lights: everything that is sampled explicitly, in three kinds: polygons, spheres, suns.

Depends on ``geometry``, ``lambert``, ``scene``. A kind holds arrays, one entry a light. It gives,
at points: the irradiance that would arrive without obstacles, and rays that test whether it does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import OFFSET, Geometry
from .lambert import polygon_form_factor

NODES = 24  # of the quadrature across a soft spot
RIM = 48  # corners of the polygon that stands for an ellipse


@dataclass(frozen=True)
class Sample:
    """One sampled place of one light for each of n points.

    ``segment`` (n, 3) float32 runs to it, ``length`` (n,) or one number limits it (inf: a sun).
    Where ``exact``, ``irradiance`` is the whole light's, without noise, and is to be multiplied by
    the visible share of ``weight`` over an owner's points; else it is this sample's alone.
    """

    irradiance: np.ndarray  # (n,) float64, unoccluded, per unit of the light's colour
    weight: np.ndarray  # (n,) float64, the integrand at the sample
    segment: np.ndarray
    length: float
    exact: bool


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
        s, t = self._place(which, xi)
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

    def _place(self, which, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


TRIANGLE, RECTANGLE, ELLIPSE = range(3)


def spread_falloff(cosine: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalised
    so that the lamp's power does not depend on it."""
    half = np.maximum(spread, 1e-3) / 2
    tangent = np.tan(half)
    gap = tangent - half
    normalise = np.where(gap > 1e-9, 1 / np.maximum(gap, 1e-30), 3 / tangent**3)
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.where(spread < np.pi, np.maximum((tangent - ray) * normalise, 0), 1.0)


@dataclass(frozen=True)
class Spheres:
    """Point and spot lamps: ``color`` radiant intensity [W/sr] in normalised lengths."""

    color: np.ndarray  # (k, 3)
    position: np.ndarray  # (k, 3)
    radius: np.ndarray  # (k,)
    axis: np.ndarray  # (k, 3) direction a spot shines in
    edge: np.ndarray  # (k,) cosine of the cone's half angle; -2 for a point lamp
    smooth: np.ndarray  # (k,) width of the spot's blend, in cosines

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (k, 3) and radii (k,)."""
        return self.position, self.radius

    def sample(self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample the disc of the lamp's radius r that faces the point, as Cycles' soft lamps do.

        Seen whole from a distance d it brings I cosθ / (d² + r²): a uniform disc's irradiance
        vector on its axis. A soft spot's beam is that of the sampled place; its mean over the disc
        is known beforehand, so that only the shadows are sampled.
        """
        toward = self.position[which] - position
        distance = np.sqrt(np.maximum(np.einsum("ij,ij->i", toward, toward), 1e-30))
        unit = toward / distance[:, None]
        cosine = np.maximum(np.einsum("ij,ij->i", unit, normal), 0)
        irradiance = cosine / (distance**2 + self.radius[which] ** 2)
        segment = toward
        soft = np.broadcast_to(self.radius[which] > 0, distance.shape)
        if np.any(soft):
            segment = toward + _disc(unit, xi) * np.reshape(self.radius[which], (-1, 1))
        if np.ndim(which) > 0 or not soft[0] or self.edge[which] < -1:
            irradiance = irradiance * self._beam(which, segment / _length(segment)[:, None])
            weight = (irradiance > 0) * 1.0
            return Sample(irradiance, weight, segment.astype(np.float32), 1.0, False)
        irradiance = irradiance * self._mean_beam(which, toward, distance)
        weight = np.maximum(self._beam(which, segment / _length(segment)[:, None]), 1e-3)
        weight = np.where(irradiance > 0, weight, 0.0)
        return Sample(irradiance, weight, segment.astype(np.float32), 1.0, True)

    def _mean_beam(self, which: int, toward: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """(n,) a soft spot's beam averaged over its disc, for ``toward`` (n, 3) its centre.

        The beam changes along one direction g across the disc only, in which the disc's points are
        spread by 2/π √(1−x²): Gauss-Chebyshev quadrature of the second kind, nodes cos(kπ/(K+1)),
        weights ∝ sin². Where the whole disc lies inside or outside the cone its centre suffices.
        """
        unit, radius = toward / distance[:, None], self.radius[which]
        slack = radius / distance
        result = self._beam(which, unit)
        partly = self._beam(which, unit, slack) > self._beam(which, unit, -slack)
        near = np.flatnonzero(partly)
        along = unit[near] @ self.axis[which]
        across = self.axis[which] - along[:, None] * unit[near]
        across *= radius / np.maximum(_length(across), 1e-9)[:, None]
        angle = np.arange(1, NODES + 1) * np.pi / (NODES + 1)
        share = np.sin(angle) ** 2 / np.sum(np.sin(angle) ** 2)
        mean = np.zeros(len(near))
        for x, part in zip(np.cos(angle), share):
            place = toward[near] + x * across
            mean += part * self._beam(which, place / _length(place)[:, None])
        result[near] = mean
        return result

    def _beam(self, which, unit: np.ndarray, slack=0.0) -> np.ndarray:
        """Cycles' spot: a smoothstep between the cone's edge and its blended inside, for unit
        directions to the sampled point; ``slack`` is added to the cosine with the axis."""
        cosine = -np.einsum("...j,...j->...", unit, np.broadcast_to(self.axis[which], unit.shape))
        cosine, edge = cosine + slack, self.edge[which]
        t = np.clip((cosine - edge) / np.maximum(self.smooth[which], 1e-9), 0, 1)
        return np.where(edge < -1, 1.0, t * t * (3 - 2 * t))

    def strength(self, which, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) rough irradiance of lights at points, above 0 wherever any may arrive."""
        toward = self.position[which] - position
        square = np.maximum(np.einsum("...j,...j->...", toward, toward), 1e-30)
        distance = np.sqrt(square)
        slack = np.minimum(self.radius[which] / distance, 1) + 1e-3
        cosine = np.einsum("...j,...j->...", toward, normal) / distance + slack
        beam = self._beam(which, toward / distance[..., None], slack)
        return self.color.mean(axis=1)[which] * np.maximum(cosine, 0) * beam / square


@dataclass(frozen=True)
class Suns:
    """Distant discs: ``color`` the irradiance on a surface that faces them."""

    color: np.ndarray  # (k, 3)
    toward: np.ndarray  # (k, 3) unit, to the sun
    radius: np.ndarray  # (k,) tangent of the half angle

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Far away: centres (k, 3) and radii (k,)."""
        return self.toward * 1e6, np.zeros(len(self.toward))

    def sample(self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample a direction in the disc."""
        toward = np.broadcast_to(self.toward[which], position.shape)
        direction = toward + _disc(toward, xi) * np.reshape(self.radius[which], (-1, 1))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        cosine = np.maximum(np.einsum("ij,ij->i", direction, normal), 0)
        return Sample(cosine, (cosine > 0) * 1.0, direction.astype(np.float32), np.inf, False)

    def strength(self, which, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) rough irradiance of lights at points, above 0 wherever any may arrive."""
        cosine = np.einsum("...j,...j->...", self.toward[which], normal) + self.radius[which] + 1e-3
        return self.color.mean(axis=1)[which] * np.maximum(cosine, 0)


def _length(vectors: np.ndarray) -> np.ndarray:
    """(n,) Euclidean lengths of (n, 3), never 0."""
    return np.sqrt(np.maximum(np.einsum("ij,ij->i", vectors, vectors), 1e-30))


def _disc(axis: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(n, 3) points uniform in the unit disc across unit ``axis`` (n, 3)."""
    helper = np.where(np.abs(axis[:, :1]) > 0.7, [[0.0, 1, 0]], [[1.0, 0, 0]])
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(axis, across)
    radius, turn = np.sqrt(xi[:, :1]), 2 * np.pi * xi[:, 1:]
    return radius * (np.cos(turn) * across + np.sin(turn) * up)
