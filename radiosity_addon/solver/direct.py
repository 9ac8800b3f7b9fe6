"""Direct light: irradiance from explicit lights, shadows included.

Depends on ``lights``, ``points``, ``embree``, ``parallel``. Each light's irradiance is its
unoccluded value, exact by Lambert's formula for polygons, times the visible share, sampled. So a
wall that touches a lamp is right, and a receiver that sees the whole light has no noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .embree import Tracer
from .parallel import map_chunks
from .points import grouped_chunks
from .sampling import sobol

OWNERS_PER_CHUNK = 1 << 12


@dataclass(frozen=True)
class DirectLight:
    """Irradiance (count, 3) float64 and where shadow rays disagreed (count,) bool."""

    irradiance: np.ndarray
    mixed: np.ndarray


def direct_light(
    tracer: Tracer,
    lights: list,
    count: int,
    place,
    objects: np.ndarray,
    key: tuple[int, ...],
    threads: int,
    tick,
) -> DirectLight:
    """Light from ``lights`` at ``count`` owners; ``place(chosen, group)`` gives their Points.

    ``objects`` (n_triangles,) is the object of each triangle, for lights linked to some only.
    """
    result = DirectLight(np.zeros((count, 3)), np.zeros(count, bool))
    if not lights or count == 0:
        return result

    def work(chunk):
        group, chosen = chunk
        points = place(chosen, group)
        per = len(points.position)
        position = points.position.reshape(-1, 3).astype(float)
        normal = points.normal.reshape(-1, 3).astype(float)
        irradiance, mixed = np.zeros((len(chosen), 3)), np.zeros(len(chosen), bool)
        for number, light in enumerate(lights):
            table = sobol(per, 2, *key, group, number, 1)
            shift = points.turn[:, [2, 0]]
            xi = ((table[:, None] + shift + 0.5) % 1.0).reshape(-1, 2)
            sample = light.sample(position, normal, xi)
            if light.objects is not None:
                lit = np.isin(objects[points.triangle], light.objects).ravel()
                sample.irradiance[~lit] = 0
                sample.weight[~lit] = 0
            arriving, partly = _visible_mean(tracer, points.position, sample, per)
            irradiance += arriving[:, None] * light.color
            mixed |= partly
        return chosen, irradiance, mixed

    chunks = grouped_chunks(count, OWNERS_PER_CHUNK)
    for chosen, irradiance, mixed in map_chunks(work, chunks, threads, tick):
        result.irradiance[chosen] = irradiance
        result.mixed[chosen] = mixed
    return result


def _visible_mean(tracer: Tracer, origins: np.ndarray, sample, per: int):
    """(R,) irradiance: mean unoccluded times visible share of the weight; (R,) shadow rays
    disagree. Rays are traced only where they carry anything."""
    carrying = np.flatnonzero(sample.weight > 0)
    visible = np.zeros(len(sample.weight))
    if len(carrying):
        clear = tracer.clear(
            np.ascontiguousarray(origins.reshape(-1, 3)[carrying]),
            np.ascontiguousarray(sample.segment[carrying]),
            sample.length,
        )
        visible[carrying] = clear
    weight = sample.weight.reshape(per, -1)
    seen = (weight * visible.reshape(per, -1)).sum(axis=0)
    total = weight.sum(axis=0)
    irradiance = sample.irradiance.reshape(per, -1)
    if np.isinf(sample.length):  # a sun: its weight does not carry the cosine
        mean = (irradiance * visible.reshape(per, -1)).mean(axis=0)
    else:
        mean = irradiance.mean(axis=0) * seen / np.where(total > 0, total, 1)
    partly = (seen > 0) & (seen < total * (1 - 1e-9))
    return mean, partly
