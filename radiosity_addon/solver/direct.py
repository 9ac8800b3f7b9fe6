"""Direct light: irradiance from explicit lights, shadows included.

Depends on ``context``, ``lights``, ``passage``, ``points``, ``parallel``. Each light's irradiance is its
unoccluded value, exact by Lambert's formula for polygons, times the visible share, sampled. So a
wall that touches a lamp is right, and a receiver that sees the whole light has no noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .context import Context
from .parallel import map_chunks
from .passage import visibility
from .points import Points, grouped_chunks
from .sampling import sobol

POINTS_PER_CHUNK = 1 << 14


@dataclass(frozen=True)
class DirectLight:
    """Irradiance (count, 3) float64 and where shadow rays disagreed (count,) bool."""

    irradiance: np.ndarray
    mixed: np.ndarray


def direct_light(context: Context, count: int, per: int, place, key, stage: str) -> DirectLight:
    """Explicit light at ``count`` owners; ``place(chosen, group)`` gives their ``per`` Points."""
    result = DirectLight(np.zeros((count, 3)), np.zeros(count, bool))
    if not context.lights or count == 0:
        return result

    def work(chunk):
        group, chosen = chunk
        return chosen, *_light_points(context, place(chosen, group), (*key, group))

    chunks = grouped_chunks(count, max(1, POINTS_PER_CHUNK // per))
    for chosen, irradiance, mixed in map_chunks(work, chunks, context.threads, context.tick(stage)):
        result.irradiance[chosen] = irradiance
        result.mixed[chosen] = mixed
    return result


def _light_points(context: Context, points: Points, key) -> tuple[np.ndarray, np.ndarray]:
    """(R, 3) irradiance and (R,) bool: some light's shadow rays disagreed."""
    per, count = points.shape
    position = points.position.reshape(-1, 3).astype(float)
    normal = points.normal.reshape(-1, 3).astype(float)
    irradiance, mixed = np.zeros((count, 3)), np.zeros(count, bool)
    for number, light in enumerate(context.lights):
        table = sobol(per, 2, *key, number, 1)
        shift = points.turn[:, [2, 0]].astype(float)
        sample = light.sample(position, normal, ((table[:, None] + shift) % 1.0).reshape(-1, 2))
        if light.objects is not None:
            dark = ~np.isin(context.scene.object[points.triangle], light.objects).ravel()
            sample.irradiance[dark] = 0
            sample.weight[dark] = 0
        arriving, partly = _visible_mean(context, points.position, sample, per)
        irradiance += arriving * light.color
        mixed |= partly
    return irradiance, mixed


def _visible_mean(context: Context, origins: np.ndarray, sample, per: int):
    """(R, 1 or 3) irradiance: mean unoccluded times visible share of the weight; (R,) shadow rays
    disagree. Rays are traced only where they carry anything."""
    carrying = np.flatnonzero(sample.weight > 0)
    channels = 1 if context.veil is None else 3
    visible = np.zeros((len(sample.weight), channels))
    if len(carrying):
        visible[carrying] = visibility(
            context,
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
