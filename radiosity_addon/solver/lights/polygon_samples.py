"""Polygon samples: places on flat lights for points, each point its own.

Each strategy takes ``lights``, the numbers ``which`` (n,) of one for each point, points ``position`` (3, n) with unit
``normal`` (3, n), and ``xi`` (2, n) in [0, 1). It gives (n,) irradiance, the integrand over the density, and segments
(3, n) to just before the places. All are unbiased; they differ in noise and cost.
"""

from __future__ import annotations

import numpy as np

from ..geometry.lambert import polygon_form_factor
from ..geometry.nusselt import cosine_toward
from ..geometry.spherical_triangles import uniform_toward
from ..geometry.triangles import OFFSET
from ..geometry.vectors import dot
from ..geometry.warps import bilinear_pdf, sample_bilinear
from .flat_shapes import (
    ELLIPSE,
    RIM,
    TRIANGLE,
    FlatLights,
    coordinates_at,
    coordinates_in,
    corner_coordinates,
    each,
    spread_falloff,
)
from .light_tree import sample_discrete

SLICES = 8  # number [slices] that an ellipse is cut into where it looks large


def by_area(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Uniform in the light's area: for lights that look small."""
    s, t = coordinates_in(lights.shape[which], *xi)
    origin, u, v = (each(array, which) for array in (lights.origin, lights.u, lights.v))
    return _carried(lights, which, position, normal, origin + s * u + t * v)


def by_corners(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """In rectangles, bilinear between what their corners bring: nearly even where they do not look
    large."""
    origin, u, v = (each(array, which) for array in (lights.origin, lights.u, lights.v))
    corners = []
    for corner in (origin, origin + u, origin + v, origin + u + v):
        ray = corner - position
        corners.append(np.maximum(dot(ray, normal), 0) / np.maximum(dot(ray, ray) ** 2, 1e-30))
    corners = np.stack(corners)
    s, t = sample_bilinear(corners, *xi)
    target = origin + s * u + t * v
    value, segment = _carried(lights, which, position, normal, target)
    return value / bilinear_pdf(corners, s, t), segment


def by_cosine(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """By the cosine-weighted solid angle: all samples stand for the same irradiance, unless a beam
    is narrowed."""
    total, direction = np.zeros(len(which)), np.array(normal)
    ellipse = lights.shape[which] == ELLIPSE
    for some, rays in ((~ellipse, _rays), (ellipse, _slice_rays)):
        some = np.flatnonzero(some)
        if len(some):
            points = which[some], position[:, some], normal[:, some], xi[:, some]
            share, corners, level = rays(lights, *points)
            total[some], direction[:, some] = cosine_toward(corners, points[2], level)
            total[some] *= share
    return _met(lights, which, position, total, direction)


def by_solid_angle(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Uniform in the solid angle, of ellipses in that of the rectangles around them: a tenth of the work of
    ``by_cosine``, for samples that differ by their cosines, and of ellipses by whether they are met."""
    _, rays, xi = _rays(lights, which, position, normal, xi)
    total, direction = uniform_toward(rays, xi)
    cosine = np.maximum(dot(direction, normal), 0)
    value, segment = _met(lights, which, position, total * cosine, direction)
    round_ = np.flatnonzero((lights.shape[which] == ELLIPSE) & (value > 0))
    s, t = coordinates_at(lights, which[round_], position[:, round_] + segment[:, round_])
    value[round_[(s - 0.5) ** 2 + (t - 0.5) ** 2 > 0.25]] = 0
    return value, segment


def _met(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, total: np.ndarray,
    direction: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance and segments of samples in ``direction`` (3, n) that stand for ``total`` (n,) if the
    light shines alike to all sides."""
    up = each(lights.normal, which)
    height, slope = dot(each(lights.origin, which) - position, up), dot(direction, up)
    reached = height * slope > 0
    step = height / np.where(reached, slope, 1)
    segment, side = _segment(lights, which, position, position + step * direction)
    value = total * _leaving(lights, which, side, np.maximum(step, 1e-30))
    return np.where(reached, value, 0), np.where(reached, segment, 1)


def _carried(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray,
    target: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance from places (3, n) that are uniform in the area, and segments to them."""
    segment, side = _segment(lights, which, position, target)
    square = np.maximum(dot(segment, segment), 1e-30)
    value = np.maximum(dot(segment, normal), 0) * np.abs(side) / square**2
    return value * lights.area[which] * _leaving(lights, which, side, np.sqrt(square)), segment


def _leaving(
    lights: FlatLights, which: np.ndarray, side: np.ndarray, length: np.ndarray
) -> np.ndarray:
    """(n,) how much brighter than its radiance a light is to points at heights ``side`` (n,) above
    its plane, ``length`` (n,) away from the place they look at."""
    beam = spread_falloff(np.abs(side) / length, lights.spread[which])
    return np.where(lights.two_sided[which] | (side > 0), beam, 0)


def _segment(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, target: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(3, n) to just before places (3, n) on lights, and (n,) heights of the points above them."""
    normal = each(lights.normal, which)
    side = dot(position - target, normal)
    return target + np.where(side >= 0, OFFSET, -OFFSET) * normal - position, side


def _rays(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[float, list[np.ndarray], np.ndarray]:
    """1, what runs to the corners of triangles, of rectangles and of those around ellipses, and ``xi``; a
    triangle has one corner twice."""
    origin, u, v = (each(array, which) for array in (lights.origin, lights.u, lights.v))
    a = origin - position
    c = a + v
    return 1.0, [a, a + u, np.where(lights.shape[which] == TRIANGLE, c, c + u), c], xi


def _slice_rays(
    lights: FlatLights, which: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """For ellipses, cut into SLICES: one over the chance (n,) of the one that is taken, in
    proportion to its irradiance, what runs to its corners, and ``xi`` made anew."""
    origin, u, v = (each(array, which) for array in (lights.origin, lights.u, lights.v))
    rim = [origin + s * u + t * v - position for s, t in corner_coordinates(ELLIPSE)]
    middle, step = origin + 0.5 * (u + v) - position, RIM // SLICES
    slices = [[middle, *(rim[(first + k) % RIM] for k in range(step + 1))]
              for first in range(0, RIM, step)]  # fmt: skip
    nowhere = np.zeros(normal.T.shape)
    importance = np.stack([polygon_form_factor(nowhere, normal.T, [ray.T for ray in one])
                         for one in slices])  # fmt: skip
    (taken,), (chance,), (rest,) = sample_discrete(importance, xi[:1])
    numbers = np.arange(len(taken))
    corners = [np.stack(ray)[taken, :, numbers].T for ray in zip(*slices)]
    share = np.where(chance > 0, 1 / np.where(chance > 0, chance, 1), 0)
    return share, corners, np.stack([rest, xi[1]])
