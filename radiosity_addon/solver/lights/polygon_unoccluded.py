"""A flat light from owners that are far from it for their size: what all of their points share.

Its places are spread as what they bring the owner's middle: bilinear between the light's corners
where it looks small, else by the cosine law itself. What a place brings one of the points differs a
little from that, and is known too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.lambert import polygon_form_factor
from ..geometry.nusselt import Projected, project_rays
from ..geometry.triangles import OFFSET
from ..geometry.vectors import dot, lengths
from ..geometry.warps import bilinear_pdf, sample_bilinear
from ..sampling.points import Middles, masked, owned
from .flat_shapes import (
    ELLIPSE,
    RECTANGLE,
    TRIANGLE,
    FlatLights,
    coordinates_in,
    corner_coordinates,
)
from .light_batch import Unoccluded, combined

FAR = 16  # distance [radii of a footprint]: from it on, a form factor's curvature across it is < 0.1 %
NO_HEIGHT = 1e-6  # height [unit box] over a plane: what lies nearer may be on either side of it
# Height [unit box] over a light: float32 is too coarse for places on a nearer one.
NO_DISTANCE = 1e-4
NEAR = 0.1  # radius [of its distance] of a light: a larger one looks large, and has its texture's value at each place
# Radius [of its distance] of a light: what a larger one brings is not bilinear between its corners.
SMALL = 0.4
# Ratio [of what two corners bring]: below it, shapes other than rectangles are sampled by area.
EVEN = 1.3


@dataclass(frozen=True)
class OneLight:
    """A flat light: origin + s·u + t·v."""

    shape: int
    origin: np.ndarray  # (3,), as the others
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray
    area: float

    def rays(self, position: np.ndarray, coordinates: Sequence[tuple[float, float]]) -> list[np.ndarray]:
        """(3, n) each, from ``position`` (3, n) to some of its ``coordinates`` (s, t)."""
        return [(self.origin + s * self.u + t * self.v)[:, None] - position for s, t in coordinates]

    def coordinates(self, position: np.ndarray) -> np.ndarray:
        """(2, n) of places (3, n) in its plane."""
        dual = np.linalg.pinv(np.stack([self.u, self.v], 1))
        s, t = np.clip(dual @ (position - self.origin[:, None]), 0, 1)
        return np.stack([s, np.minimum(t, 1 - s) if self.shape == TRIANGLE else t])


def unoccluded_polygon(lights: FlatLights, which: int, middles: Middles) -> Unoccluded:
    """Known for owners that lie before it or behind it with all of their points."""
    light = OneLight(int(lights.shape[which]), lights.origin[which], lights.u[which],
                     lights.v[which], lights.normal[which], float(lights.area[which]))  # fmt: skip
    corners = corner_coordinates(light.shape)
    heights = [dot(ray, middles.normal) for ray in light.rays(middles.position, corners)]
    lowest, highest = np.minimum.reduce(heights), np.maximum.reduce(heights)
    side = light.normal @ middles.position - light.normal @ light.origin
    behind, below = middles.depth(light.normal), middles.depth(middles.normal) + NO_HEIGHT
    center, radius = (values[which] for values in lights.middle())
    away, extent = lengths(center[:, None] - middles.position), middles.extent
    lit = (np.abs(side) > behind + NO_DISTANCE) & ((extent == 0) | (away - radius > FAR * extent))
    dark = highest < -below
    if not lights.two_sided[which]:
        dark |= side < -behind - NO_HEIGHT
    lit &= ~dark & (lights.spread[which] >= np.pi)
    if lights.triangle[which] >= 0:
        lit &= radius < NEAR * away
    density = _at_corners(light, middles)
    gentle = (lowest > below) & (radius < SMALL * away)
    if light.shape != RECTANGLE:
        gentle &= density.max(axis=0) < EVEN * density.min(axis=0)
    if light.shape == ELLIPSE:
        lit &= gentle
    some = masked(lit)
    irradiance, position = np.zeros(len(side)), owned(middles.position, some)
    polygon = [light.origin + s * light.u + t * light.v for s, t in corners]
    irradiance[some] = np.pi * polygon_form_factor(
        position.T, owned(middles.normal, some).T, polygon
    )
    shared = _Shared(light, middles, side, irradiance, density, *_large(light, middles, lit & ~gentle))
    return Unoccluded(
        irradiance, middles.flat & (lit | dark), shared.segments, shared.value, warp=shared.warp
    )


def _at_corners(light: OneLight, middles: Middles) -> np.ndarray:
    """(3 or 4, R) float32: the integrand at the origin, + u, + v, + both, up to a factor that is
    common to an owner's."""
    coordinates = ((0, 0), (1, 0), (0, 1), (1, 1))[: 3 if light.shape == TRIANGLE else 4]
    rays = light.rays(middles.position, coordinates)
    found = np.stack([
        np.maximum(dot(ray, middles.normal), 0) / np.maximum(dot(ray, ray) ** 2, 1e-30)
        for ray in rays
    ])  # fmt: skip
    return (found / np.maximum(found.max(axis=0), 1e-300)).astype(np.float32)


def _large(
    light: OneLight, middles: Middles, chosen: np.ndarray
) -> tuple[Projected | None, np.ndarray]:
    """The light as owners ``chosen`` (R,) bool see it above their horizons, and their places in
    there (R,), -1: none; nothing where there are none."""
    number = np.where(chosen, np.cumsum(chosen) - 1, -1)
    if not chosen.any():
        return None, number
    some = np.flatnonzero(chosen)
    rays = light.rays(middles.position[:, some], corner_coordinates(light.shape))
    return project_rays(rays, middles.normal[:, some]), number


@dataclass(frozen=True)
class _Shared:
    """What ``Unoccluded`` asks for."""

    light: OneLight
    middles: Middles
    side: np.ndarray  # (R,) heights of the middles above the light
    irradiance: np.ndarray  # (R,) at the middles
    density: np.ndarray  # see ``_at_corners``
    large: Projected | None
    number: np.ndarray  # (R,) int: in there, -1: not

    def warp(
        self, owners: np.ndarray | slice, s: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """See ``Unoccluded``."""
        rows = np.arange(len(self.side))[owners]
        large = np.flatnonzero(self.number[rows] >= 0)
        if self.light.shape == RECTANGLE and len(large) < len(rows):
            uniform, (s, t) = (s, t), sample_bilinear(self.density[:, owners], s, t)
        else:
            uniform, s, t = (s, t), s.copy(), t.copy()
        if len(large):
            per, mine = len(s), rows[large]
            xi = np.stack([axis[:, large].ravel() for axis in uniform]).astype(float)
            toward = self.large.directions(xi, np.tile(self.number[mine], per))
            slope = self.light.normal @ toward
            step = np.tile(-self.side[mine], per) / np.where(slope == 0, 1, slope)
            position = np.tile(self.middles.position[:, mine], per) + step * toward
            s[:, large], t[:, large] = self.light.coordinates(position).reshape(2, per, -1)
        return s, t

    def segments(
        self, owners: np.ndarray | slice, position: np.ndarray, s: np.ndarray, t: np.ndarray
    ) -> np.ndarray:
        """See ``Unoccluded``."""
        light, lift = self.light, np.where(self.side[owners] > 0, OFFSET, -OFFSET)
        start = [origin + lift * up for origin, up in zip(light.origin, light.normal)]
        coordinates = self._coordinates(owners, s, t)
        return combined(start, (light.u, light.v), coordinates, position)

    def _coordinates(
        self, owners: np.ndarray | slice, s: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Places on the light: those that are not warped lie in its shape already."""
        if self.light.shape == RECTANGLE:
            return s, t
        inside, warped = coordinates_in(self.light.shape, s, t), self.number[owners] >= 0
        return tuple(np.where(warped, one, other) for one, other in zip((s, t), inside))

    def value(
        self, owners: np.ndarray, segments: np.ndarray, s: np.ndarray, t: np.ndarray
    ) -> np.ndarray:
        """See ``Unoccluded``. Points of an owner lie in one plane: their heights below a place on
        the light are the same, and only its distances differ."""
        light, large = self.light, self.number[owners] >= 0
        square = np.einsum("pkj,pkj->pk", segments, segments, dtype=float)
        side = np.abs(segments @ light.normal)
        cosine = np.einsum("pkj,jk->pk", segments, self.middles.normal[:, owners])
        value = np.maximum(cosine, 0) * side / square**2 * light.area
        if light.shape == RECTANGLE:
            value /= bilinear_pdf(self.density[:, owners], s, t)
        if large.any():
            mine = owners[large]
            there = combined(light.origin, (light.u, light.v), (s[:, large], t[:, large]))
            there = there - self.middles.position.T[mine]
            middle = np.einsum("pkj,pkj->pk", there, there) / square[:, large]
            ratio = side[:, large] / np.abs(self.side[mine]) * middle**2
            value[:, large] = self.irradiance[mine] * ratio
        return value
