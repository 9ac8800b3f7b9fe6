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
from .points import Points, grouped_chunks
from .sampling import sobol

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

    chunks = grouped_chunks(count, max(1, POINTS_PER_CHUNK // per))
    for chosen, *found in map_chunks(work, chunks, context.threads, context.tick(stage)):
        for array, values in zip((result.irradiance, result.mixed, result.variance), found):
            array[chosen] = values
    return result


def _light_points(context: Context, points: Points, key):
    """(R, channels) irradiance, (R,) bool: some light's shadow rays disagreed, and (R,)
    variance."""
    per, count = points.shape
    position = points.position.reshape(-1, 3).astype(float)
    normal = points.normal.reshape(-1, 3).astype(float)
    irradiance, mixed = np.zeros((count, context.channels)), np.zeros(count, bool)
    choices, chosen, square = 0, np.zeros(count), np.zeros(count)
    for number, (light, factor) in enumerate(_lights_for(context, points, position, normal, key)):
        choices += factor is not None
        table = sobol(per, 4, *key, number, 1)[:, 2:]  # points take dimensions 0, 1 and 4
        shift = points.turn[:, [2, 0]].astype(float)
        xi = ((table[:, None] + shift) % 1.0).reshape(-1, 2)
        for sample, color, rows in _samples(context, light, position, normal, xi, per):
            dark = _unlinked(context, light, rows, points)
            if dark is not None:
                sample.irradiance[dark] = 0
                sample.weight[dark] = 0
            if factor is None:
                blockers = context.blockers[context.sources.block[light]]
                arriving, partly = _visible_mean(context, blockers, points.position, sample, per)
                irradiance += arriving * color
            else:
                arriving = _visible_each(context, points.position, sample, rows)
                arriving = arriving * factor[rows, None] * color
                np.add.at(irradiance, rows % count, arriving / per)
                level = arriving.mean(axis=1)
                chosen += np.bincount(rows % count, level, count)
                square += np.bincount(rows % count, level**2, count)
                partly = False
            mixed |= partly
    return irradiance, mixed, _variance(chosen, square, choices, per)


def _variance(total: np.ndarray, square: np.ndarray, choices: int, per: int) -> np.ndarray:
    """(R,) variance of sums over ``choices`` of means over ``per`` points, from the ``total`` and
    the ``square`` sum (R,) of all these numbers."""
    many = choices * per
    if many < 2:
        return np.zeros(len(total))
    return np.maximum(square - total**2 / many, 0) / (many - 1) * choices / per


def _lights_for(context: Context, points: Points, position, normal, key):
    """(light, factor) pairs to sample: every light, an int with factor None, where they are few;
    else arrays (n,) of what was chosen at each point, with one over its probability."""
    sources = context.sources
    pairs = [(light, None) for light in sources.always]
    per, count = points.shape
    for number, pool in enumerate(sources.pools):
        table = sobol(per, 6, *key, 2, number)[:, 5:]
        xi = ((table + points.turn[:, 0].astype(float)) % 1.0).reshape(-1, 1)
        xi = (xi + np.arange(PER_POINT)) / PER_POINT  # a point's choices lie apart, too
        choices = choose_lights(sources, pool, position, normal, xi)
        pairs += [(choice.light, choice.factor) for choice in choices]
    return pairs


def _samples(context: Context, light, position, normal, xi, per: int):
    """Yield (sample, colour, rows): of one light at all points (rows None), or of each kind at the
    points (k,) whose light is of that kind."""
    sources = context.sources
    if np.ndim(light) == 0:
        kind, place = sources.kinds[sources.kind[light]], int(sources.place[light])
        yield kind.sample(place, position, normal, xi, per), kind.color[place], None
        return
    for number, kind in enumerate(sources.kinds):
        rows = np.flatnonzero(sources.kind[light] == number)
        if len(rows):
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
    result = np.zeros((len(rows), 1 if blockers.veil is None else context.channels))
    if len(carrying):
        visible = visibility(
            context,
            blockers,
            np.ascontiguousarray(origins.reshape(-1, 3)[rows[carrying]]),
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
    return mean, ((seen > 0) & (seen < total * (1 - 1e-9))).any(axis=1)
