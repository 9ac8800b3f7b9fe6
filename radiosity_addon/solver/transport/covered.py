"""Covered parts: patches of receivers of which something hides a part that is lit otherwise than the rest.

A glowing pane, a picture's glass or a shelf a finger's width before a wall covers a part of a texel. The texel's color is
the mean over all of it; rays from afar meet the rest alone. Where the light of the two differs by much, rays go onward.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.footprints import Footprints
from ..lights.context import Context
from ..sampling.points import Points, footprint_points, grouped_chunks
from ..sampling.sobol import uniform
from .lit_patches import lit_on
from .patches import NEAR
from .rays import RAYS_PER_CHUNK, own_directions

# numbers [rays along the normal], of a patch, that find whether a part of it is covered, and of all patches at most
STRAIGHT, MANY = 8, 4_000_000
POINTS, RAYS = 16, 2  # numbers [points of a patch covered in part], where its light is found, and [rays of each of these]
TYPICAL = 512  # number [patches] by which the mean light of all of them is found
AT_ONCE = 16_384  # number [patches] whose light is found at a time: bounds memory
LEFT = 0.1  # error [of that asked for] by what is left of patches that are covered in part


def lit_unlike_cover(
    context: Context, footprints: Footprints, tolerance: float, key: tuple[int, ...]
) -> np.ndarray:
    """(k,) int: those of the P ``footprints`` of which the part that is not covered reflects another mean than the whole, of light
    straight from its sources. The differences of the others add up to less than ``LEFT`` of the relative error ``tolerance``."""
    free = _shares_not_covered(context, footprints, key)
    some = np.flatnonzero((free > 0) & (free < 1))
    if len(some) == 0:
        return some
    step = (np.arange(TYPICAL) + 0.5) / TYPICAL * footprints.area.sum()
    typical = np.minimum(np.searchsorted(np.cumsum(footprints.area), step), footprints.count - 1)
    light = _seen(context, footprints, typical, key)[0].mean() * footprints.area.sum()
    excess = np.concatenate([
        np.subtract(*_seen(context, footprints, part, (*key, number)))
        for number, part in enumerate(np.split(some, np.arange(AT_ONCE, len(some), AT_ONCE)))
    ])  # fmt: skip
    excess = np.abs(excess) * footprints.area[some]
    order = np.argsort(excess)
    return some[order[np.searchsorted(np.cumsum(excess[order]), LEFT * tolerance * light) :]]


def _seen(
    context: Context, footprints: Footprints, chosen: np.ndarray, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Of what the ``chosen`` (k,) int reflect of light straight from its sources, mean of channels: the mean over the points that
    are not covered, and over all points, each times the share of those, (k,)."""
    points, lit = lit_on(context, footprints, chosen, POINTS, key)
    lit = (lit + _first_hand(context, points, key)).mean(axis=2)
    free = _not_covered(context, footprints, chosen, points)
    return (lit * free).mean(axis=0), lit.mean(axis=0) * free.mean(axis=0)


def _first_hand(context: Context, points: Points, key: tuple[int, ...]) -> np.ndarray:
    """(per, k, channels) what ``points`` (per, k) reflect of light that ``RAYS`` rays of each find at its source."""
    if context.sky is None and not context.glows:
        return np.zeros((1, 1, context.channels))
    directions = own_directions(points, RAYS * len(points.position), *key, 3)
    origins = np.broadcast_to(points.position[:, None], directions.shape)
    hits = context.tracer.intersect(origins.reshape(-1, 3), directions.reshape(-1, 3))
    light = np.zeros((len(hits.triangle), context.channels))
    met = np.flatnonzero(hits.triangle >= 0)
    met = met[~context.explicit[hits.triangle[met]]]
    uv = np.stack([hits.u[met], hits.v[met]], 1).astype(float)
    light[met] = np.pi * context.emission(hits.triangle[met], uv, hits.front[met])
    missed = np.flatnonzero(hits.triangle < 0)
    if context.sky is not None:
        light[missed] = context.sky(directions.reshape(-1, 3)[missed])
    triangle = points.triangle.ravel()
    reflectance = context.reflectance(triangle, points.uv.reshape(-1, 2), np.ones(len(triangle), bool))
    light = light.reshape(*directions.shape[:3], -1).mean(axis=1)
    return light * reflectance.reshape(light.shape)


def _shares_not_covered(context: Context, footprints: Footprints, key: tuple[int, ...]) -> np.ndarray:
    """(P,) of the ``footprints``."""
    rays = max(min(STRAIGHT, MANY // max(footprints.count, 1)), 1)
    free, work = np.empty(footprints.count), _Straight(context, footprints, rays, (*key, 2))
    chunks = grouped_chunks(footprints.count, RAYS_PER_CHUNK // rays)
    for chosen, found in context.map_chunks(work, chunks, "elements"):
        free[chosen] = found
    return free


@dataclass(frozen=True)
class _Straight:
    """The shares of each of a (group, slice) of the ``footprints`` that nothing covers, by so many ``rays``."""

    context: Context
    footprints: Footprints
    rays: int
    key: tuple[int, ...]

    def __call__(self, chunk: tuple[int, slice]) -> tuple[slice, np.ndarray]:
        group, chosen = chunk
        owners = np.arange(self.footprints.count)[chosen]
        shift = uniform((len(owners), 3), *self.key, 1, chosen.start)
        points = footprint_points(self.footprints, owners, shift, self.rays, *self.key, group)
        return chosen, _not_covered(self.context, self.footprints, owners, points).mean(axis=0)


def _not_covered(
    context: Context, footprints: Footprints, owners: np.ndarray, points: Points
) -> np.ndarray:
    """(per, k) bool: nothing stands over the ``points`` (per, k) of the ``owners`` (k,) int at a distance below their size."""
    length = np.sqrt(footprints.area[owners]) / NEAR
    straight = context.geometry.normal[points.triangle] * length[:, None]
    free = context.tracer.clear(points.position.reshape(-1, 3), straight.astype(np.float32).reshape(-1, 3))
    return free.reshape(points.shape)
