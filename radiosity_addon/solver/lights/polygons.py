"""Polygons: flat lights, that is area lamps and emissive faces."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ..geometry.lambert import polygon_form_factor
from ..geometry.spherical import direction_within, solid_angle
from ..geometry.triangles import OFFSET
from ..geometry.vectors import columns, dot
from ..geometry.vectors import size as distance
from ..sampling.points import Middles, masked, owned
from .light_batch import Sample, Unoccluded, combined, in_disc, partly_above
from .light_tree import Emitters

TRIANGLE, RECTANGLE, ELLIPSE = range(3)
RIM = 48  # corners of the polygon that stands for an ellipse
FAR = 8  # times the reach of a footprint: a form factor's curvature across it is < 0.4 % there
NO_HEIGHT = 1e-6  # of the scene: what lies nearer to a plane may be on either side of it,
NO_DISTANCE = 1e-4  # and nearer to a light's than this float32 does not tell its places well
NEAR = 0.1  # of a light's distance: a larger one is sampled by solid angle, and as its texture is


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
    front: np.ndarray  # (k,) how likely light that leaves the front goes anywhere, above 0
    back: np.ndarray  # (k,) the same of the back; 0 where it does not shine
    triangle: np.ndarray  # (k,) int: whose texture ``color`` is a mean of, -1: none
    corners: np.ndarray  # (k, 3, 2) barycentric in there, of origin, origin + u, origin + v

    @property
    def area(self) -> np.ndarray:
        """(k,) normalised."""
        share = np.array([0.5, 1.0, np.pi / 4])[self.shape]
        return share * np.linalg.norm(np.cross(self.u, self.v), axis=1)

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (k, 3) and radii (k,) of spheres around the lights."""
        return self._spheres

    @cached_property
    def _spheres(self) -> tuple[np.ndarray, np.ndarray]:
        share = np.where(self.shape == TRIANGLE, 1 / 3, 0.5)[:, None]
        corners = [s * self.u + t * self.v - share * (self.u + self.v)
                   for s, t in ((0, 0), (1, 0), (0, 1), (1, 1))]  # fmt: skip
        size = np.array([np.linalg.norm(corner, axis=1) for corner in corners])
        size[3, self.shape == TRIANGLE] = 0
        return self.origin + share * (self.u + self.v), size.max(axis=0)

    def sample(
        self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample light ``which`` (an int: exactly; or (n,) of them: each alone) for n points."""
        position, normal = columns(position), columns(normal)
        if np.ndim(which) == 0 or len(which) == 0:
            return self._by_area(which, position, normal, xi, np.ndim(which) == 0)
        near = self._near(which, position)
        angular = near & (self.shape[which] != ELLIPSE) & (self.spread[which] >= np.pi)
        sample = self._by_area(which, position, normal, xi, False)
        some = np.flatnonzero(angular)
        if len(some):
            value, segment = self._by_solid_angle(
                which[some], position[:, some], normal[:, some], xi[some]
            )
            sample.irradiance[some], sample.segment[some] = value, segment.T
            sample.weight[some] = value > 0
        textured = np.flatnonzero(near & (self.triangle[which] >= 0))
        if len(textured) == 0:
            return sample
        mine = which[textured]
        uv = self._texture_place(mine, position[:, textured] + sample.segment[textured].T)
        return replace(sample, surface=(textured, self.triangle[mine], uv))

    def whole(self, which: int, middles: Middles) -> Unoccluded:
        """One light from owners that are far from it for their size, and before or behind it with
        all of their points."""
        corners, normal = self._corners(which), self.normal[which]
        center, size = (values[which] for values in self.middle())
        height = np.array(corners) @ middles.normal
        highest = np.maximum.reduce(list(height)) - dot(middles.place, middles.normal)
        side = normal @ middles.place - normal @ self.origin[which]
        behind = middles.depth(normal)
        below = middles.depth(middles.normal) + NO_HEIGHT
        reach = middles.reach
        far = (reach == 0) | (distance(center[:, None] - middles.place) - size > FAR * reach)
        dark = highest < -below
        lit = far & (np.abs(side) > behind + NO_DISTANCE) & (self.spread[which] >= np.pi)
        if not self.two_sided[which]:
            dark |= side < -behind - NO_HEIGHT
        lit &= ~dark
        some = masked(lit)
        irradiance = np.zeros(len(side))
        irradiance[some] = np.pi * polygon_form_factor(
            owned(middles.place, some).T, owned(middles.normal, some).T, corners
        )

        def segments(owners, position, s, t):
            lift = np.where(side[owners] > 0, OFFSET, -OFFSET)
            start = [here + lift * up for here, up in zip(self.origin[which], normal)]
            axes = self.u[which], self.v[which]
            return combined(start, axes, self.place(which, s, t), position)

        def weight(owners, segments):
            cosine = np.einsum("pkj,jk->pk", segments, middles.normal[:, owners])
            square = np.einsum("pkj,pkj->pk", segments, segments, dtype=float)
            return np.maximum(cosine, 0) * np.abs(segments @ normal) / square**2

        return Unoccluded(irradiance, middles.flat & (lit | dark), segments, weight)

    def _near(self, which: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n,) bool: the light's apparent size from (3, n) is above NEAR."""
        center, size = self.middle()
        away = position - _each(center, which)
        return size[which] ** 2 > NEAR**2 * dot(away, away)

    def _by_area(self, which, position, normal, xi, exact: bool) -> Sample:
        """Sample uniformly by area; where ``exact``, with the irradiance of the whole light."""
        s, t = self.place(which, xi[:, 0], xi[:, 1])
        origin, u, v = (_each(array, which) for array in (self.origin, self.u, self.v))
        segment, side = self._segment(which, position, origin + s * u + t * v)
        square = np.maximum(dot(segment, segment), 1e-30)
        weight = np.maximum(dot(segment, normal), 0) * np.abs(side) / square**2
        shines = self.two_sided[which] | (side > 0)
        segment = np.ascontiguousarray(segment.T, np.float32)
        if not exact or self.spread[which] < np.pi:
            beam = spread_falloff(np.abs(side) / np.sqrt(square), self.spread[which])
            value = np.where(shines, weight * beam * self.area[which], 0)
            return Sample(value, (value > 0) * 1.0, segment, 1.0, False)
        factor = np.pi * polygon_form_factor(position.T, normal.T, self._corners(which))
        factor = np.where(shines, factor, 0)
        return Sample(factor, np.where(factor > 0, weight, 0), segment, 1.0, True)

    def _segment(self, which, position, target) -> tuple[np.ndarray, np.ndarray]:
        """(3, n) to just before places (3, n) on lights, and (n,) heights of the points above
        them."""
        normal = _each(self.normal, which)
        side = dot(position - target, normal)
        return target + np.where(side >= 0, OFFSET, -OFFSET) * normal - position, side

    def _by_solid_angle(self, which, position, normal, xi) -> tuple[np.ndarray, np.ndarray]:
        """(n,) irradiance and (3, n) segments of lights ``which`` (n,), triangles or rectangles,
        sampled uniformly in the solid angle they are seen under."""
        origin, u, v, up = (
            _each(array, which) for array in (self.origin, self.u, self.v, self.normal)
        )
        first = origin - position
        a, b, c = first, first + u, first + v
        a, b, c, d = (corner / distance(corner) for corner in (a, b, c, b + v))
        one = solid_angle(a, b, c)
        other = np.where(self.shape[which] == RECTANGLE, solid_angle(d, c, b), 0)
        whole = np.maximum(one + other, 1e-30)
        second = xi[:, 0] * whole >= one
        a, b, c = (np.where(second, q, p) for p, q in ((a, d), (b, c), (c, b)))
        angle = np.where(second, other, one)
        within = (xi[:, 0] * whole - np.where(second, one, 0)) / np.maximum(angle, 1e-30)
        within = np.stack([np.clip(within, 0, 1), xi[:, 1]], 1)
        direction = direction_within(a, b, c, angle, within)
        height, slope = dot(first, up), dot(direction, up)
        reached = height * slope > 0
        step = height / np.where(reached, slope, 1)
        segment, side = self._segment(which, position, position + step * direction)
        shines = reached & (self.two_sided[which] | (side > 0))
        cosine = np.maximum(dot(direction, normal), 0)
        return np.where(shines, whole * cosine, 0), np.where(reached, segment, 1)

    def _texture_place(self, which, target: np.ndarray) -> np.ndarray:
        """(n, 2) barycentric coordinates, in their triangles, of places (3, n) on lights."""
        origin, u, v = (_each(array, which) for array in (self.origin, self.u, self.v))
        away = target - origin
        uu, uv, vv, au, av = (dot(p, q) for p, q in ((u, u), (u, v), (v, v), (away, u), (away, v)))
        below = np.maximum(uu * vv - uv * uv, 1e-300)
        s = np.clip((au * vv - av * uv) / below, 0, 1)[:, None]
        t = np.clip((av * uu - au * uv) / below, 0, 1)[:, None]
        first, second, third = np.moveaxis(self.corners[which], 1, 0)
        return first + s * (second - first) + t * (third - first)

    def _corners(self, which: int) -> list[np.ndarray]:
        """Corners in order, (3,) each; an ellipse becomes a polygon of the same area."""
        shape = self.shape[which]
        places = [(0, 0), (1, 0), (0, 1)] if shape == TRIANGLE else [(0, 0), (1, 0), (1, 1), (0, 1)]
        if shape == ELLIPSE:
            turn = (np.arange(RIM) + 0.5) * (2 * np.pi / RIM)
            radius = 0.5 * np.sqrt(2 * np.pi / RIM / np.sin(2 * np.pi / RIM))
            places = np.stack([0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)], 1)
        origin, u, v = self.origin[which], self.u[which], self.v[which]
        return [origin + s * u + t * v for s, t in places]

    def place(self, which, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(s, t) uniform in the light's shape, from those in the unit square."""
        shape = self.shape[which]
        if np.all(shape == RECTANGLE):
            return s, t
        fold = (shape == TRIANGLE) & (s + t > 1)
        round_ = shape == ELLIPSE
        if np.any(round_):
            x, y = in_disc(s, t)
            s, t = np.where(round_, 0.5 + 0.5 * x, s), np.where(round_, 0.5 + 0.5 * y, t)
        return (np.where(fold, 1 - s, s), np.where(fold, 1 - t, t)) if np.any(fold) else (s, t)

    def strength(self, which, place: np.ndarray, normal: np.ndarray, reach) -> np.ndarray:
        """See ``lights``."""
        kind, (center, radius) = place.dtype, self.middle()
        toward = [middle[which] - x for middle, x in zip(center.T.astype(kind), place)]
        square = np.maximum(dot(toward, toward), 1e-30)
        inverse = 1 / np.sqrt(square)
        radius = radius.astype(kind)[which] + reach
        slack = np.minimum(radius * inverse, 1)
        facing = partly_above(dot(toward, normal) * inverse, slack)
        leaving = -dot(toward, self.normal.T.astype(kind)[:, which]) * inverse
        front, back = (side.astype(kind)[which] for side in (self.front, self.back))
        side = np.where(leaving > 0, front, back)
        near = np.abs(leaving) <= reach * inverse  # some points may be on the other side
        side = np.where(near, np.maximum(front, back), side)
        leaving = side * (np.abs(leaving) + kind.type(0.1) * slack)
        power = (self.area * self.color.mean(axis=1)).astype(kind)[which]
        return power * facing * leaving / (square + kind.type(0.5) * radius**2)

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: some box, centre and half edges (g, 3), has a part on the side that shines."""
        reaches = self.two_sided.copy()
        some = np.flatnonzero(~self.two_sided)
        plane = np.einsum("ij,ij->i", self.origin[some], self.normal[some])
        height = center @ self.normal[some].T + half @ np.abs(self.normal[some]).T - plane
        reaches[some] = (height > 1e-9).any(axis=0)
        return reaches

    def emitters(self) -> Emitters:
        """How they shine, roughly."""
        center, size = self.middle()
        power = self.area * self.color.mean(axis=1)
        return Emitters(center, size, self.normal, power * self.front, power * self.back,
                        np.zeros(len(power), bool))  # fmt: skip


def _each(vectors: np.ndarray, which) -> np.ndarray:
    """(3, n) of vectors (k, 3), or (3, 1) where ``which`` is one of them."""
    return columns(np.take(vectors, np.atleast_1d(which), axis=0))


def spread_falloff(cosine: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalised
    so that the lamp's power does not depend on it."""
    half = np.maximum(spread, 1e-3) / 2
    tangent = np.tan(half)
    gap = tangent - half
    normalise = np.where(gap > 1e-9, 1 / np.maximum(gap, 1e-30), 3 / tangent**3)
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.where(spread < np.pi, np.maximum((tangent - ray) * normalise, 0), 1.0)


def join_polygons(parts: list[Polygons]) -> Polygons:
    """The lights of all parts."""
    names = [field.name for field in fields(Polygons)]
    return Polygons(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
