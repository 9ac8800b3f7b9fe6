"""Polygons: flat lights, that is area lamps and emissive faces."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ..geometry.lambert import polygon_form_factor
from ..geometry.nusselt import cosine_toward
from ..geometry.triangles import OFFSET
from ..geometry.vectors import columns, dot
from ..geometry.vectors import size as distance
from ..sampling.points import Middles, masked, owned
from .light_batch import Sample, Unoccluded, bilinear_density, bilinear_places, combined
from .light_batch import in_disc, partly_above
from .light_tree import Emitters, pick

TRIANGLE, RECTANGLE, ELLIPSE = range(3)
RIM = 48  # corners of the polygon that stands for an ellipse
SLICES = 8  # of an ellipse that looks large
FAR = 16  # times the reach of a footprint: a form factor's curvature across it is < 0.1 % there
NO_HEIGHT = 1e-6  # of the scene: what lies nearer to a plane may be on either side of it,
NO_DISTANCE = 1e-4  # and nearer to a light's than this float32 does not tell its places well
NEAR = 0.1  # of a light's distance: a larger one of many is sampled by the cosine law, and as its
# texture is,
SMALL = 0.4  # and a larger rectangle alone: below, four corners tell how its light is spread
EVEN = 1.3  # ratio of the integrand at corners below which other shapes are sampled by area alone


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
        """Sample light ``which`` for n points: an int, or (n,) of them. A light that looks large
        is sampled by the cosine law, a small one of many by its area."""
        position, normal = columns(position), columns(normal)
        alone, which = np.ndim(which) == 0, np.broadcast_to(which, position.shape[1])
        near = self._near(which, position)
        value, segment = np.zeros(len(which)), np.ones(position.shape)
        for some, sampled in ((near | alone, self._by_cosine), (~near & ~alone, self._by_area)):
            some = np.flatnonzero(some)
            if len(some):
                value[some], segment[:, some] = sampled(
                    which[some], position[:, some], normal[:, some], xi[some].T
                )
        surface, textured = None, np.flatnonzero(near & (self.triangle[which] >= 0))
        if len(textured):
            mine = which[textured]
            uv = self._texture_place(mine, position[:, textured] + segment[:, textured])
            surface = textured, self.triangle[mine], uv
        segment = np.ascontiguousarray(segment.T, np.float32)
        return Sample(value, segment, 1.0, surface=surface)

    def whole(self, which: int, middles: Middles) -> Unoccluded:
        """One light from owners that are far from it for their size and its own, and before or
        behind it, above or below their horizon, with all of it and all of their points."""
        corners, normal = self._corners(which), self.normal[which]
        center, size = (values[which] for values in self.middle())
        height = [dot(c[:, None] - middles.place, middles.normal) for c in corners]
        lowest, highest = np.minimum.reduce(height), np.maximum.reduce(height)
        side = normal @ middles.place - normal @ self.origin[which]
        behind = middles.depth(normal)
        below = middles.depth(middles.normal) + NO_HEIGHT
        away = distance(center[:, None] - middles.place)
        far = (middles.reach == 0) | (away - size > FAR * middles.reach)
        far &= size < (SMALL if self.triangle[which] < 0 else NEAR) * away
        dark = highest < -below
        if not self.two_sided[which]:
            dark |= side < -behind - NO_HEIGHT
        lit = far & (lowest > below) & (np.abs(side) > behind + NO_DISTANCE) & ~dark
        density = self._density(which, middles, side)
        if self.spread[which] < np.pi:
            lit[:] = False
        elif self.shape[which] != RECTANGLE:
            lit &= np.max(density, axis=0) < EVEN * np.min(density, axis=0)
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

        def warp(owners, s, t):
            return bilinear_places(density[:, owners], s, t)

        def value(owners, segments, s, t):
            cosine = np.einsum("pkj,jk->pk", segments, middles.normal[:, owners])
            square = np.einsum("pkj,pkj->pk", segments, segments, dtype=float)
            value = np.maximum(cosine, 0) * np.abs(segments @ normal) / square**2
            if warped is not None:
                value /= bilinear_density(density[:, owners], s, t)
            return value * self.area[which]

        warped = warp if self.shape[which] == RECTANGLE else None
        return Unoccluded(irradiance, middles.flat & (lit | dark), segments, value, warp=warped)

    def _density(self, which: int, middles: Middles, side: np.ndarray) -> np.ndarray:
        """(4, R) float32: the integrand at the corners of the light's parallelogram, origin, + u,
        + v, + both, up to a factor that is common to an owner's."""
        found = []
        for s, t in ((0, 0), (1, 0), (0, 1), (1, 1)):
            ray = (self.origin[which] + s * self.u[which] + t * self.v[which])[:, None]
            ray = ray - middles.place
            square = dot(ray, ray)
            found.append(np.maximum(dot(ray, middles.normal), 0) / np.maximum(square**2, 1e-30))
        if self.shape[which] == TRIANGLE:
            found.pop()
        found = np.stack(found) * np.abs(side)
        return (found / np.maximum(found.max(axis=0), 1e-300)).astype(np.float32)

    def _near(self, which: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n,) bool: the light's apparent size from (3, n) is above NEAR."""
        center, size = self.middle()
        away = position - _each(center, which)
        return size[which] ** 2 > NEAR**2 * dot(away, away)

    def _by_area(self, which, position, normal, xi) -> tuple[np.ndarray, np.ndarray]:
        """(n,) irradiance and (3, n) segments of lights ``which`` (n,), sampled by their area."""
        s, t = self.place(which, *xi)
        origin, u, v = (_each(array, which) for array in (self.origin, self.u, self.v))
        segment, side = self._segment(which, position, origin + s * u + t * v)
        square = np.maximum(dot(segment, segment), 1e-30)
        value = np.maximum(dot(segment, normal), 0) * np.abs(side) / square**2
        value *= self.area[which] * self._leaving(which, side, np.sqrt(square))
        return value, segment

    def _leaving(self, which, side: np.ndarray, length: np.ndarray) -> np.ndarray:
        """(n,) how much brighter than its radiance a light is to points at heights ``side`` (n,)
        above its plane, ``length`` (n,) away from the place they look at."""
        beam = spread_falloff(np.abs(side) / length, self.spread[which])
        return np.where(self.two_sided[which] | (side > 0), beam, 0)

    def _segment(self, which, position, target) -> tuple[np.ndarray, np.ndarray]:
        """(3, n) to just before places (3, n) on lights, and (n,) heights of the points above
        them."""
        normal = _each(self.normal, which)
        side = dot(position - target, normal)
        return target + np.where(side >= 0, OFFSET, -OFFSET) * normal - position, side

    def _by_cosine(self, which, position, normal, xi) -> tuple[np.ndarray, np.ndarray]:
        """The same, sampled by the cosine-weighted solid angle they are seen under: all samples
        stand for the same irradiance, unless a beam is narrowed."""
        total, direction = np.zeros(len(which)), np.array(normal)
        ellipse = self.shape[which] == ELLIPSE
        for some, rays in ((~ellipse, self._rays), (ellipse, self._slice_rays)):
            some = np.flatnonzero(some)
            if len(some):
                places = which[some], position[:, some], normal[:, some], xi[:, some]
                share, corners, level = rays(*places)
                total[some], direction[:, some] = cosine_toward(corners, places[2], level)
                total[some] *= share
        up = _each(self.normal, which)
        height, slope = dot(_each(self.origin, which) - position, up), dot(direction, up)
        reached = height * slope > 0
        step = height / np.where(reached, slope, 1)
        segment, side = self._segment(which, position, position + step * direction)
        value = np.where(reached, total * self._leaving(which, side, np.maximum(step, 1e-30)), 0)
        return value, np.where(reached, segment, 1)

    def _rays(self, which, position, normal, xi):
        """1, what runs to the corners of triangles and rectangles, and ``xi``; a triangle has one
        corner twice."""
        origin, u, v = (_each(array, which) for array in (self.origin, self.u, self.v))
        a = origin - position
        c = a + v
        return 1.0, [a, a + u, np.where(self.shape[which] == RECTANGLE, c + u, c), c], xi

    def _slice_rays(self, which, position, normal, xi):
        """For ellipses, cut into SLICES: one over the chance (n,) of the one that is taken, in
        proportion to its irradiance, what runs to its corners, and ``xi`` made anew."""
        origin, u, v = (_each(array, which) for array in (self.origin, self.u, self.v))
        places, step = np.array(_rim()), RIM // SLICES
        rim = [origin + s * u + t * v - position for s, t in places]
        middle = origin + 0.5 * (u + v) - position
        nowhere = np.zeros(normal.T.shape)
        slices = [[middle, *(rim[(first + k) % RIM] for k in range(step + 1))]
                  for first in range(0, RIM, step)]  # fmt: skip
        strength = np.stack([polygon_form_factor(nowhere, normal.T, [ray.T for ray in one])
                             for one in slices])  # fmt: skip
        (taken,), (chance,), (rest,) = pick(strength, xi[:1])
        columns = np.arange(len(taken))
        corners = [np.stack(ray)[taken, :, columns].T for ray in zip(*slices)]
        share = np.where(chance > 0, 1 / np.where(chance > 0, chance, 1), 0)
        return share, corners, np.stack([rest, xi[1]])

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
            places = _rim()
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


def _rim() -> list[tuple[float, float]]:
    """RIM places (s, t) around an ellipse, corners of a polygon of its area."""
    turn = (np.arange(RIM) + 0.5) * (2 * np.pi / RIM)
    radius = 0.5 * np.sqrt(2 * np.pi / RIM / np.sin(2 * np.pi / RIM))
    return list(zip(0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)))


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
