"""Direct light: irradiance from explicit lights, shadows included.

Depends on ``context``, ``blockers``, ``choose``, ``sources``, ``passage``, ``points``,
``parallel``. Each light's irradiance is its unoccluded value, exact by Lambert's formula for
polygons, times the visible share, sampled. So a wall that touches a lamp is right, and a receiver
that sees the whole light has no noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .blockers import Blockers
from .choose import PER_POINT, choose_lights
from .context import Context
from .parallel import map_chunks
from .passage import visibility
from .points import Middles, Points, grouped_chunks, shifted
from .sampling import GROUPS, sobol

POINTS_PER_CHUNK = 1 << 14


@dataclass(frozen=True)
class DirectLight:
    """Irradiance (count, channels) float64, where shadow rays disagreed (count,) bool, and the
    variance (count,) of its channels' mean that the choice among many lights leaves."""

    irradiance: np.ndarray
    mixed: np.ndarray
    variance: np.ndarray


def direct_light(context: Context, count: int, per: int, place, key, stage: str) -> DirectLight:
    """Explicit light at ``count`` owners; ``place(chosen, group)`` gives their ``per`` Points."""
    result = DirectLight(
        np.zeros((count, context.channels)), np.zeros(count, bool), np.zeros(count)
    )
    if count == 0 or not (context.sources.always or context.sources.pools):
        return result

    def work(chunk):
        group, chosen = chunk
        return chosen, *_light_points(context, place(chosen, group), (*key, group))

    groups = 1 if per == 1 else GROUPS  # single points are independent as they are
    chunks = grouped_chunks(count, max(1, POINTS_PER_CHUNK // per), groups)
    for chosen, *found in map_chunks(work, chunks, context.threads, context.tick(stage)):
        for array, values in zip((result.irradiance, result.mixed, result.variance), found):
            array[chosen] = values
    return result


def _light_points(context: Context, points: Points, key):
    """(R, channels) irradiance, (R,) bool: some light's shadow rays disagreed, and (R,)
    variance."""
    per, count = points.shape
    middles = points.middles()
    irradiance, mixed = _from_each(context, points, middles, key)
    variance = np.zeros(count)
    if not context.sources.pools:
        return irradiance, mixed, variance
    if middles.flat.all():
        chosen, variance = _from_chosen(context, points, middles, key)
        return irradiance + chosen, mixed, variance
    for flat in (True, False):
        some = np.flatnonzero(middles.flat == flat)
        part = points.take(some) if flat else points.take(some).single()
        chosen, apart = _from_chosen(context, part, part.middles(), (*key, 4 + flat))
        repeats = part.shape[1] // max(len(some), 1)  # points that are owners of their own
        irradiance[some] += chosen.reshape(-1, len(some), context.channels).mean(axis=0)
        variance[some] = apart.reshape(-1, len(some)).mean(axis=0) / max(repeats, 1)
    return irradiance, mixed, variance


def _from_each(context: Context, points: Points, middles: Middles, key):
    """(R, channels) irradiance from the lights that are sampled at every point, and (R,) bool: some
    light's shadow rays disagreed."""
    per, count = points.shape
    irradiance, mixed = np.zeros((count, context.channels)), np.zeros(count, bool)
    for number, light in enumerate(context.sources.always):
        kind, place = context.sources.named(light)
        table = sobol(per, 4, *key, number, 1).astype(np.float32)  # points take 0, 1 and 4
        xi = [shifted(table[:, axis, None], points.turn[:, turn]) for axis, turn in ((2, 2), (3, 0))]
        whole = kind.whole(place, middles)
        dark = _unlinked(context, light, None, points)
        known = whole.known
        if dark is not None:
            dark = dark.reshape(per, count)
            known = known & (dark[0] == dark).all(axis=0)
        arriving, seen = whole.irradiance, known & (whole.irradiance > 0)
        if dark is not None:
            seen &= ~dark[0]
        some = np.flatnonzero(seen)
        blockers = context.blockers[context.sources.block[light]]
        if len(some):
            share, partly = _visible_share(context, blockers, whole, points, some, xi)
            irradiance[some] += arriving[some, None] * share * kind.color[place]
            mixed[some] |= partly
        some = np.flatnonzero(~known)
        if len(some):
            found, partly = _from_points(context, light, points, some, xi, dark)
            irradiance[some] += found * kind.color[place]
            mixed[some] |= partly
    return irradiance, mixed


def _visible_share(context: Context, blockers: Blockers, whole, points: Points, some, xi):
    """(k, 1 or channels) share of a light's irradiance that arrives at the owners ``some`` (k,), at
    which it is known, and (k,) bool: shadow rays disagree."""
    every = len(some) == points.shape[1]
    position, s, t = (
        array if every else array[:, some] for array in (points.position, *xi)
    )
    segments = whole.segments(some, position, s, t)
    visible = visibility(
        context, blockers, position.reshape(-1, 3), segments.reshape(-1, 3), whole.length
    ).reshape(*s.shape, -1)
    share = visible.mean(axis=0, dtype=np.float32).astype(float)
    partly = _is_part(share)
    if whole.weight is not None and partly.any():  # a part below the horizon weighs nothing
        weight = whole.weight(some[partly], segments[:, partly])[..., None]
        total = weight.sum(axis=0)
        seen = (weight * visible[:, partly]).sum(axis=0)
        share[partly] = seen / np.where(total > 0, total, 1)
        partly = _is_part(share)
    return share, partly


def _is_part(share: np.ndarray) -> np.ndarray:
    """(k,) bool: some of the shares (k, c) is neither nothing nor all."""
    return ((share > 0) & (share < 1 - 1e-9)).any(axis=1)


def _from_points(context: Context, light: int, points: Points, some, xi, dark):
    """(k, 1 or channels) irradiance of a light at the owners ``some`` (k,), looked at from each of
    their points, and (k,) bool: shadow rays disagree."""
    kind, place = context.sources.named(light)
    position, normal = (array[:, some].reshape(-1, 3) for array in (points.position, points.normal))
    xi = np.stack([axis[:, some].ravel() for axis in xi], 1).astype(float)
    sample = kind.sample(place, position.astype(float), normal.astype(float), xi)
    if dark is not None:
        sample.irradiance[dark[:, some].ravel()] = 0
        sample.weight[dark[:, some].ravel()] = 0
    blockers = context.blockers[context.sources.block[light]]
    return _visible_mean(context, blockers, position, sample, points.shape[0])


def _from_chosen(context: Context, points: Points, middles: Middles, key):
    """(R, channels) irradiance from the lights of which every point chooses some, and (R,)
    variance, for owners that are flat."""
    per, count = points.shape
    position = points.position.reshape(-1, 3).astype(float)
    normal = points.normal.reshape(-1, 3).astype(float)
    irradiance, choices = np.zeros((count, context.channels)), 0
    total, square = np.zeros((2, count))
    for light, factor in _choices(context, points, middles, key):
        table = sobol(per, 4, *key, choices, 3)
        xi = [shifted(table[:, axis, None], points.turn[:, turn]) for axis, turn in ((2, 2), (3, 0))]
        xi = np.stack([axis.ravel() for axis in xi], 1)
        choices += 1
        arriving = np.zeros((per * count, context.channels))
        for sample, color, rows in _samples(context, light, position, normal, xi):
            dark = _unlinked(context, light, rows, points)
            if dark is not None:
                sample.irradiance[dark] = 0
                sample.weight[dark] = 0
            found = _visible_each(context, points.position, sample, rows)
            arriving[rows] = found * factor[rows, None] * color
        irradiance += arriving.reshape(per, count, -1).mean(axis=0)
        level = arriving.mean(axis=1).reshape(per, count)
        total += level.sum(axis=0)
        square += (level * level).sum(axis=0)
    return irradiance, _variance(total, square, choices, per)


def _variance(total: np.ndarray, square: np.ndarray, choices: int, per: int) -> np.ndarray:
    """(R,) variance of sums over ``choices`` of means over ``per`` points, from the ``total`` and
    the ``square`` sum (R,) of all these numbers."""
    many = choices * per
    if many < 2:
        return np.zeros(len(total))
    return np.maximum(square - total**2 / many, 0) / (many - 1) * choices / per


def _choices(context: Context, points: Points, middles: Middles, key):
    """Yield (light, factor) pairs (n,): what was chosen for each point, and one over its
    probability and the number of choices."""
    per, count = points.shape
    for number, pool in enumerate(context.sources.pools):
        table = sobol(per, 6, *key, 2, number)[:, 5:]
        xi = shifted(table, points.turn[:, 0].astype(float))
        xi = (xi + np.arange(PER_POINT)[:, None, None]) / PER_POINT  # a point's choices lie apart
        lights, factors = choose_lights(
            context.sources, pool, middles.place, middles.normal, middles.reach,
            xi.reshape(-1, count),
        )
        for pair in zip(*(array.reshape(PER_POINT, -1) for array in (lights, factors / PER_POINT))):
            yield pair


def _samples(context: Context, light: np.ndarray, position, normal, xi):
    """Yield (sample, colour, rows): of each kind at the points, (k,) or a slice of all, whose
    ``light`` (n,) is of that kind."""
    sources = context.sources
    kinds = sources.kind[light]
    for number, kind in enumerate(sources.kinds):
        rows = np.flatnonzero(kinds == number)
        if len(rows):
            rows = slice(None) if len(rows) == len(light) else rows
            place = sources.place[light[rows]]
            sample = kind.sample(place, position[rows], normal[rows], xi[rows])
            color = kind.color[place]
            if sample.surface is not None:
                varied, triangle, uv = sample.surface
                color[varied] = context.emission(triangle, uv)
            yield sample, color, rows


def _unlinked(context: Context, light, rows, points: Points) -> np.ndarray | None:
    """(k,) bool: points on objects that their light is not linked to; None where all are lit."""
    sources = context.sources
    if sources.allowed is None:
        return None
    objects = context.scene.object[points.triangle].ravel()
    if rows is None:
        allowed = sources.allowed[sources.link[light]]
        return None if allowed.all() else ~allowed[objects]
    return ~sources.allowed[sources.link[light[rows]], objects[rows]]


def _visible_each(context: Context, origins: np.ndarray, sample, rows: np.ndarray) -> np.ndarray:
    """(k, 1 or channels) irradiance of each sample, of lights that all objects block."""
    carrying = np.flatnonzero(sample.weight > 0)
    blockers = context.blockers[0]
    result = np.zeros((len(sample.weight), 1 if blockers.veil is None else context.channels))
    if len(carrying):
        visible = visibility(
            context,
            blockers,
            np.ascontiguousarray(origins.reshape(-1, 3)[rows][carrying]),
            np.ascontiguousarray(sample.segment[carrying]),
            sample.length,
        ).reshape(len(carrying), -1)
        result[carrying] = sample.irradiance[carrying, None] * visible
    return result


def _visible_mean(context: Context, blockers: Blockers, origins: np.ndarray, sample, per: int):
    """(R, 1 or channels) irradiance: mean unoccluded times visible share of the weight; (R,)
    shadow rays disagree. Rays are traced only where they carry anything."""
    carrying = np.flatnonzero(sample.weight > 0)
    channels = 1 if blockers.veil is None else context.channels
    visible = np.zeros((len(sample.weight), channels))
    if len(carrying):
        visible[carrying] = visibility(
            context,
            blockers,
            np.ascontiguousarray(origins.reshape(-1, 3)[carrying]),
            np.ascontiguousarray(sample.segment[carrying]),
            sample.length,
        ).reshape(-1, channels)
    weight = sample.weight.reshape(per, -1, 1)
    visible = visible.reshape(per, -1, channels)
    seen, total = (weight * visible).sum(axis=0), weight.sum(axis=0)
    irradiance = sample.irradiance.reshape(per, -1, 1)
    if sample.exact:
        mean = irradiance.mean(axis=0) * seen / np.where(total > 0, total, 1)
    else:
        mean = (irradiance * visible).mean(axis=0)
    return mean, _is_part(seen / np.where(total > 0, total, 1))
