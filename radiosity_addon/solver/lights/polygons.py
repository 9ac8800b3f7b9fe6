"""Polygons: flat lights, that is area lamps and emissive faces."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..geometry.lambert import polygon_form_factor
from ..geometry.triangles import OFFSET, Geometry
from ..geometry.vectors import columns, dot
from ..sampling.points import Middles
from ..sampling.sobol import cosine_directions, tangent_frames
from ..scene import AreaLamp
from .flat_shapes import (
    ELLIPSE,
    RECTANGLE,
    FlatLights,
    coordinates_at,
    coordinates_in,
    corner_coordinates,
    each,
    spread_falloff,
)
from .light_batch import Leaving, Sample, Unoccluded, no_cones, partly_above
from .light_tree import Emitters
from .polygon_samples import by_area, by_corners, by_cosine, by_solid_angle
from .polygon_unoccluded import NEAR, SMALL, unoccluded_polygon


class Polygons(FlatLights):
    """Flat lights as a ``LightBatch``."""

    @property
    def distant(self) -> bool:
        """False."""
        return False

    @property
    def power(self) -> np.ndarray:
        """(k, channels): π·radiance·area a side."""
        return self.color * (np.pi * self.area * (1 + self.two_sided))[:, None]

    def leave(self, which: np.ndarray, xi: np.ndarray) -> Leaving:
        """By the cosine law, but for the beams of narrowed ones, from either side of two."""
        s, t = self.coordinates(which, xi[:, 2], xi[:, 3])
        both, spread = self.two_sided[which], self.spread[which]
        side = np.where(both & (xi[:, 0] < 0.5), -1.0, 1.0)
        first = np.where(both, 2 * xi[:, 0] % 1, xi[:, 0])
        widest = np.sin(np.minimum(spread, np.pi) / 2) ** 2
        local = cosine_directions(np.stack([widest * first, xi[:, 1]], 1))
        beam = widest * spread_falloff(local[:, 2], spread)
        normal = side[:, None] * self.normal[which]
        origin = self.origin[which] + s[:, None] * self.u[which] + t[:, None] * self.v[which]
        direction = np.einsum("ni,nij->nj", local, tangent_frames(normal))
        power = np.pi * self.area[which] * (1 + both) * beam
        return Leaving(origin + 2 * OFFSET * normal, direction, power)

    def cones(self) -> tuple[np.ndarray, np.ndarray]:
        """None."""
        return no_cones(len(self.color))

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample light ``which`` for n points: an int, so that samples differ little, or (n,) of
        them, cheaply. Alone a light is sampled by the cosine law, a small rectangle as its corners
        tell, its whole irradiance by Lambert's formula; one of many by its solid angle, a small one
        by its area."""
        position, normal = columns(position), columns(normal)
        alone, which = np.ndim(which) == 0, np.broadcast_to(which, position.shape[1])
        near, gentle = self._near(which, position), np.zeros(len(which), bool)
        if alone and len(which):
            gentle = self._gentle(which[0], position, normal)
            strategies = (gentle, by_corners), (~gentle, by_cosine)
        else:
            strategies = (~near, by_area), (near, by_solid_angle)
        value, segment = np.zeros(len(which)), np.ones(position.shape)
        for some, sampled in strategies:
            some = np.flatnonzero(some)
            if len(some):
                value[some], segment[:, some] = sampled(
                    self, which[some], position[:, some], normal[:, some], xi[some].T
                )
        exact, surface, textured = None, None, np.flatnonzero(near & (self.triangle[which] >= 0))
        if gentle.any():
            exact, some = value.copy(), np.flatnonzero(gentle & (value > 0))
            exact[some] = np.pi * polygon_form_factor(
                position[:, some].T, normal[:, some].T, self._corners(which[0])
            )
        if len(textured):
            mine = which[textured]
            uv = self._texture_uv(mine, position[:, textured] + segment[:, textured])
            surface = textured, self.triangle[mine], uv
        return Sample(value, np.ascontiguousarray(segment.T, np.float32), 1.0, exact, surface)

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """One light from owners that are far from it for their size."""
        return unoccluded_polygon(self, which, middles)

    def _gentle(self, which: int, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) bool: a rectangle is above the horizons of points (3, n), and looks small."""
        if self.shape[which] != RECTANGLE or self.spread[which] < np.pi:
            return np.zeros(position.shape[1], bool)
        center, radius = (values[which] for values in self.middle())
        away = position - center[:, None]
        above = [dot(corner[:, None] - position, normal) > 0 for corner in self._corners(which)]
        return np.all(above, axis=0) & (radius**2 < SMALL**2 * dot(away, away))

    def _near(self, which: np.ndarray, position: np.ndarray) -> np.ndarray:
        """(n,) bool: the light's apparent size from (3, n) is above NEAR."""
        center, size = self.middle()
        away = position - each(center, which)
        return size[which] ** 2 > NEAR**2 * dot(away, away)

    def _texture_uv(self, which: np.ndarray, target: np.ndarray) -> np.ndarray:
        """(n, 2) barycentric coordinates, in their triangles, of places (3, n) on lights."""
        s, t = (np.clip(axis, 0, 1)[:, None] for axis in coordinates_at(self, which, target))
        first, second, third = np.moveaxis(self.corners[which], 1, 0)
        return first + s * (second - first) + t * (third - first)

    def _corners(self, which: int) -> list[np.ndarray]:
        """Corners in order, (3,) each."""
        origin, u, v = self.origin[which], self.u[which], self.v[which]
        return [origin + s * u + t * v for s, t in corner_coordinates(self.shape[which])]

    def coordinates(
        self, which: int | np.ndarray, s: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(s, t) uniform in the light's shape, from those in the unit square."""
        return coordinates_in(self.shape[which], s, t)

    def importance(
        self, which: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """See ``LightBatch``."""
        found = [np.take(row, which) for row in self._rows]
        toward = [middle - x for middle, x in zip(found[:3], position)]
        square = np.maximum(dot(toward, toward), 1e-30)
        inverse = 1 / np.sqrt(square)
        front, back, radius = found[6:]
        radius = radius + extent
        slack = np.minimum(radius * inverse, 1)
        facing = partly_above(dot(toward, normal) * inverse, slack)
        leaving = -dot(toward, found[3:6]) * inverse
        power = np.where(leaving > 0, front, back)
        near = np.abs(leaving) <= extent * inverse  # some points may be on the other side
        if near.any():
            power = np.where(near, np.maximum(front, back), power)
        leaving = power * (np.abs(leaving) + np.float32(0.1) * slack)
        return facing * leaving / (square + np.float32(0.5) * radius**2)

    @cached_property
    def _rows(self) -> np.ndarray:
        """(9, k) float32: middles, normals, and power and reach by which ``importance`` tells lights apart."""
        center, radius = self.middle()
        power = self.area * self.color.mean(axis=1)
        rows = [*center.T, *self.normal.T, power * self.front, power * self.back, radius]
        return np.stack(rows).astype(np.float32)

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: some box, center and half edges (g, 3), has a part on the side that shines."""
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


def lamp_polygons(
    color: np.ndarray, shape: np.ndarray, origin: np.ndarray, u: np.ndarray, v: np.ndarray,
    normal: np.ndarray, spread: np.ndarray,
) -> Polygons:
    """One-sided lights (k,) that are no surface of any object. The arguments are as in ``Polygons``."""
    k = len(color)
    one, none = np.ones(k), np.full(k, -1)
    return Polygons(color, shape, origin, u, v, normal, np.zeros(k, bool), spread, one, 0 * one, none,
                    np.zeros((k, 3, 2)), none)  # fmt: skip


def batch_of_area_lamps(lamps: list[AreaLamp], geometry: Geometry) -> Polygons:
    """Of area lamps."""
    u, v, normal, color, center = (
        np.array([np.asarray(getattr(lamp, name), float) for lamp in lamps])
        for name in ("u", "v", "normal", "radiance", "center")
    )
    u, v = u / geometry.scale, v / geometry.scale
    shape = np.array([ELLIPSE if lamp.ellipse else RECTANGLE for lamp in lamps])
    spread = np.array([min(lamp.spread, np.pi) for lamp in lamps])
    return lamp_polygons(color, shape, geometry.normalized(center) - (u + v) / 2, u, v, normal, spread)
