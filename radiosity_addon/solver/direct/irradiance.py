"""Direct light: irradiance from explicit lights, shadows included.

Each light's irradiance is its unoccluded value, exact by Lambert's formula for polygons, times the
visible share, sampled. So a wall that touches a lamp is right, and a receiver that sees the whole
light has no noise. Of many lights every point looks at a few (``chosen``).
"""

from __future__ import annotations

import numpy as np

from ..lights.context import Context
from ..sampling.points import Middles, Points, grouped_chunks, light_places, masked, owned
from ..sampling.sobol import GROUPS
from ..tracing.blockers import Blockers
from ..workers.parallel import map_chunks
from .many_lights import chosen_light
from .transmission import visibility, visible_samples

POINTS_PER_CHUNK = 1 << 14


def direct_light(context: Context, count: int, per: int, place, key, stage: str):
    """Explicit light at ``count`` owners, irradiance (count, channels) float64, and the variance
    (count,) of its channels' mean that the choice among many lights leaves; ``place(chosen, group)``
    gives their ``per`` Points."""
    irradiance, variance = np.zeros((count, context.channels)), np.zeros(count)
    if count == 0 or not (context.sources.always or context.sources.pools):
        return irradiance, variance

    def work(chunk):
        group, some = chunk
        return some, *_light_points(context, place(some, group), (*key, group))

    groups = 1 if per == 1 else GROUPS  # single points are independent as they are
    chunks = grouped_chunks(count, max(1, POINTS_PER_CHUNK // per), groups)
    for some, light, spread in map_chunks(work, chunks, context.threads, context.tick(stage)):
        irradiance[some], variance[some] = light, spread
    return irradiance, variance


def _light_points(context: Context, points: Points, key):
    """(R, channels) irradiance and (R,) variance."""
    middles = points.middles()
    irradiance = _from_each(context, points, middles, key)
    if not context.sources.pools:
        return irradiance, np.zeros(len(irradiance))
    light, variance = chosen_light(context, points, middles, key)
    return irradiance + light, variance


def _from_each(context: Context, points: Points, middles: Middles, key) -> np.ndarray:
    """(R, channels) irradiance from the lights that are sampled at every point."""
    per, count = points.shape
    irradiance = np.zeros((count, context.channels))
    for number, light in enumerate(context.sources.always):
        kind, place = context.sources.named(light)
        xi = light_places(points, *key, number, 1)
        whole = kind.whole(place, middles)
        known, dark = whole.known, context.sources.unlinked(light, context.scene, points.triangle)
        lit = known & (whole.irradiance > 0)
        if dark is not None:
            known = known & (dark == dark[0]).all(axis=0)
            lit &= known & ~dark[0]
        blockers = context.blockers[context.sources.block[light]]
        if lit.any():
            some = masked(lit)
            share = _visible_share(context, blockers, whole, points, some, xi)
            irradiance[some] += whole.irradiance[some, None] * share * kind.color[place]
        some = np.flatnonzero(~known)
        if len(some):
            found = _from_points(context, light, points, some, xi, dark)
            irradiance[some] += found
    return irradiance


def _visible_share(context: Context, blockers: Blockers, whole, points: Points, some, xi):
    """(k, 1 or channels) share of a light's irradiance that arrives at the owners ``some``, (k,) or
    a slice, at which it is known."""
    position, s, t = (owned(array, some) for array in (points.position, *xi))
    segments = whole.segments(some, position, s, t)
    visible = visibility(
        context, blockers, position.reshape(-1, 3), segments.reshape(-1, 3), whole.length
    ).reshape(*s.shape, -1)
    share = visible.mean(axis=0, dtype=np.float32).astype(float)
    partly = np.flatnonzero(((share > 0) & (share < 1)).any(axis=1))
    if whole.weight is not None and len(partly):  # a part below the horizon weighs nothing
        owners = np.arange(points.shape[1])[some][partly]
        weight = whole.weight(owners, segments[:, partly])[..., None]
        total = weight.sum(axis=0)
        seen = (weight * visible[:, partly]).sum(axis=0)
        share[partly] = seen / np.where(total > 0, total, 1)
    return share


def _from_points(context: Context, light: int, points: Points, some, xi, dark) -> np.ndarray:
    """(k, channels) irradiance of a light at the owners ``some`` (k,), looked at from each of their
    points."""
    kind, place = context.sources.named(light)
    position, normal = (
        owned(array, some).reshape(-1, 3) for array in (points.position, points.normal)
    )
    xi = np.stack([owned(axis, some).ravel() for axis in xi], 1).astype(float)
    sample = kind.sample(place, position.astype(float), normal.astype(float), xi)
    if dark is not None:
        sample.darken(dark[:, some].ravel())
    blockers = context.blockers[context.sources.block[light]]
    arriving = _visible_mean(
        context, blockers, position, sample, points.shape[0], sample.tint
    )
    return arriving * kind.color[place]


def _visible_mean(context: Context, blockers: Blockers, origins, sample, per: int, tint):
    """(R, 1 or channels) irradiance: mean unoccluded times visible share of the weight, of a light
    with ``tint`` (n, channels) times its colour; None: 1. Rays are traced only where they carry
    anything."""
    visible = visible_samples(context, blockers, origins, sample)
    weight = sample.weight.reshape(per, -1, 1)
    visible = visible.reshape(per, -1, visible.shape[1])
    irradiance = sample.irradiance.reshape(per, -1, 1)
    if not sample.exact:
        tint = 1 if tint is None else tint.reshape(per, -1, context.channels)
        return (irradiance * visible * tint).mean(axis=0)
    seen, total = (weight * visible).sum(axis=0), weight.sum(axis=0)
    return irradiance.mean(axis=0) * seen / np.where(total > 0, total, 1)
