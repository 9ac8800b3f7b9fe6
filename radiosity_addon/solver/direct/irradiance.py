"""Direct light: irradiance from explicit lights, shadows included.

Places on a light are sampled so that each stands for nearly the same irradiance, if not exactly, and
carry what each stands for: the mean of that times the visibility is unbiased for any number of them.
Several points of an owner make it the light's whole irradiance, exact by Lambert's formula for
polygons, times the visible share of what they carry: a receiver that sees the whole light has no
noise. Of many lights every point looks at a few (``many_lights``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.context import Context
from ..lights.light_batch import Sample, Unoccluded
from ..sampling.points import (
    Middles,
    Points,
    PointSampler,
    PointsGiven,
    grouped_chunks,
    light_coordinates,
    masked,
    owned,
)
from ..sampling.shade import Shade
from ..sampling.sobol import GROUPS
from ..tracing.blockers import Blockers
from .many_lights import sampled_light
from .transmission import visibility, visible_samples

POINTS_PER_CHUNK = 1 << 14  # number [points] of a chunk


def direct_light(
    context: Context, count: int, per: int, sample_points: PointSampler, key: tuple[int, ...], phase: str
) -> tuple[np.ndarray, np.ndarray]:
    """Explicit light at ``count`` owners, irradiance (count, channels) float64, and the variance
    (count,) of its channels' mean that the choice among many lights leaves; ``sample_points(chosen, group)``
    gives their ``per`` Points."""
    irradiance, variance = np.zeros((count, context.channels)), np.zeros(count)
    if count == 0 or not (context.sources.always or context.sources.samplers):
        return irradiance, variance
    groups = 1 if per == 1 else GROUPS  # single points are independent as they are
    chunks = grouped_chunks(count, max(1, POINTS_PER_CHUNK // per), groups)
    work = _LightChunk(context, sample_points, key)
    for some, light, squares in context.map_chunks(work, chunks, phase):
        irradiance[some], variance[some] = light, squares
    return irradiance, variance


@dataclass(frozen=True)
class _LightChunk:
    """Lights the points of a (group, slice) of owners."""

    context: Context
    sample_points: PointSampler
    key: tuple[int, ...]

    def __call__(self, chunk: tuple[int, slice]) -> tuple[slice, np.ndarray, np.ndarray]:
        group, some = chunk
        points = self.sample_points(some, group)
        return some, *_light_points(self.context, points, (*self.key, group))


def direct_at(
    context: Context, points: Points, key: tuple[int, ...], phase: str
) -> tuple[np.ndarray, np.ndarray]:
    """``direct_light`` at points (1, n), each an owner of its own with independent random numbers."""
    return direct_light(context, points.shape[1], 1, PointsGiven(points), key, phase)


def _light_points(
    context: Context, points: Points, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(R, channels) irradiance and (R,) variance."""
    middles = points.middles()
    irradiance = _from_each(context, points, middles, key)
    if not context.sources.samplers:
        return irradiance, np.zeros(len(irradiance))
    light, variance = sampled_light(context, points, middles, key)
    return irradiance + light, variance


def _from_each(
    context: Context, points: Points, middles: Middles, key: tuple[int, ...]
) -> np.ndarray:
    """(R, channels) irradiance from the lights that are sampled at every point."""
    per, count = points.shape
    irradiance, everyone = np.zeros((count, context.channels)), np.arange(count)
    for number, light in enumerate(context.sources.always):
        batch, index = context.sources.named(light)
        xi = light_coordinates(points, *key, number, 1)
        if per == 1:
            dark = context.sources.unlinked(light, context.scene, points.triangle)
            irradiance += _from_points(context, light, points, everyone, xi, dark)
            continue
        unoccluded = batch.unoccluded(index, middles)
        known, dark = unoccluded.known, context.sources.unlinked(light, context.scene, points.triangle)
        lit = known & (unoccluded.irradiance > 0)
        if dark is not None:
            known = known & (dark == dark[0]).all(axis=0)
            lit &= known & ~dark[0]
        blockers = context.blockers[context.sources.block[light]]
        if lit.any():
            some = masked(lit)
            share = _visible_share(context, blockers, unoccluded, points, some, xi)
            irradiance[some] += unoccluded.irradiance[some, None] * share * batch.color[index]
        some = np.flatnonzero(~known)
        if len(some):
            found = _from_points(context, light, points, some, xi, dark)
            irradiance[some] += found
    return irradiance


def _visible_share(
    context: Context, blockers: Blockers, unoccluded: Unoccluded, points: Points,
    some: np.ndarray | slice, xi: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """(k, 1 or channels) share of a light's irradiance that arrives at the owners ``some``, (k,) or
    a slice, at which it is known."""
    position, s, t = (owned(array, some) for array in (points.position, *xi))
    if unoccluded.warp is not None:
        s, t = unoccluded.warp(some, s, t)
    segments = unoccluded.segments(some, position, s, t)
    visible = visibility(
        context, blockers, position.reshape(-1, 3), segments.reshape(-1, 3), unoccluded.length,
        points.shade and points.shade.take(some).together(),
    ).reshape(*s.shape, -1)
    share = visible.mean(axis=0, dtype=np.float32).astype(float)
    partly = np.flatnonzero(((share > 0) & (share < 1)).any(axis=1))
    if len(partly):
        owners = np.arange(points.shape[1])[some][partly]
        value = unoccluded.value(owners, segments[:, partly], s[:, partly], t[:, partly])[..., None]
        seen = (value * visible[:, partly]).sum(axis=0)
        total = value.sum(axis=0)
        share[partly] = seen / np.where(total > 0, total, 1)
    return share


def _from_points(
    context: Context, light: int, points: Points, some: np.ndarray,
    xi: tuple[np.ndarray, np.ndarray], dark: np.ndarray | None,
) -> np.ndarray:
    """(k, channels) irradiance of a light at the owners ``some`` (k,), looked at from each of
    their points. Owners of one point take samples as of many lights, which may differ more: only means
    over several points of an owner gain by samples that are alike."""
    batch, index = context.sources.named(light)
    position, normal = (
        owned(array, some).reshape(-1, 3) for array in (points.position, points.normal)
    )
    xi = np.stack([owned(axis, some).ravel() for axis in xi], 1).astype(float)
    which = index if points.shape[0] > 1 else np.full(len(position), index)
    sample = batch.sample(which, position.astype(float), normal.astype(float), xi)
    if dark is not None:
        sample = sample.darkened(dark[:, some].ravel())
    blockers = context.blockers[context.sources.block[light]]
    color = batch.color[index]
    if sample.surface is not None:
        varied, triangle, uv = sample.surface
        color = np.tile(color, (len(position), 1))
        color[varied] = context.emission(triangle, uv)
    if sample.tint is not None:
        color = color * sample.tint
    if color.ndim > 1:
        color = color.reshape(points.shape[0], -1, context.channels)
    shade = points.shade and points.shade.take(some).together()
    return _visible_mean(context, blockers, position, sample, points.shape[0], color, shade)


def _visible_mean(
    context: Context, blockers: Blockers, origins: np.ndarray, sample: Sample, per: int,
    color: np.ndarray, shade: Shade | None,
) -> np.ndarray:
    """(R, channels) irradiance of a light of this ``color``, (channels,) or (per, R, channels):
    the mean of what is visible of the samples, or of the whole light that share. Rays are traced
    only where they carry anything."""
    visible = visible_samples(context, blockers, origins, sample, shade)
    visible = visible.reshape(per, -1, visible.shape[1])
    irradiance = sample.irradiance.reshape(per, -1, 1)
    if sample.exact is None or per == 1:
        return (irradiance * visible * color).mean(axis=0)
    exact = sample.exact.reshape(per, -1, 1).mean(axis=0)
    seen, total = (irradiance * visible * color).sum(axis=0), irradiance.sum(axis=0)
    return exact * seen / np.where(total > 0, total, 1)
