"""Gather: cosine-distributed rays from points, and the light they bring back.

Depends on ``context``, ``points``, ``elements``, ``passage``, ``parallel``. One ray of n carries 1/n of the
irradiance: rows built from rays have entries >= 0 and sums <= 1, whatever the geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .context import Context
from .elements import Elements
from .embree import Hits
from .parallel import map_chunks
from .passage import followed
from .points import Points, grouped_chunks
from .sampling import cosine_directions, sobol
from .skylight import Skylight

RAYS_PER_CHUNK = 1 << 16


@dataclass(frozen=True)
class Met:
    """What rays met: all of them first, then those that went on through a surface.

    ``rays`` (k,) numbers the rays, ``weight`` (k, 3) the share of their light; both None for the
    first, which is every ray with weight 1.
    """

    hits: Hits
    rays: np.ndarray | None = None
    weight: np.ndarray | None = None


def shoot(context: Context, points: Points, rays: int, *key: int) -> tuple[list[Met], np.ndarray]:
    """``rays`` cosine-distributed rays from each owner, shared among its points.

    Returns what they met and their directions (rays, R, 3) float32; ray (m, r) has the number
    m·R + r. ``rays`` is a multiple of the points per owner. One matrix product turns the shared
    directions.
    """
    per, count = points.shape
    frames = points.frames()
    # A run of consecutive Sobol points covers the hemisphere evenly by itself; every n-th would not.
    local = cosine_directions(sobol(rays, 2, *key)).reshape(per, -1, 3)
    origins = np.empty((per, rays // per, count, 3), np.float32)
    directions = np.empty_like(origins)
    for p in range(per):
        axes = frames[p % len(frames)].transpose(1, 0, 2).reshape(3, 3 * count)
        directions[p] = (local[p] @ axes).reshape(-1, count, 3)
        origins[p] = points.position[p]
    origins, flat = origins.reshape(-1, 3), directions.reshape(-1, 3)
    met = [Met(context.tracer.intersect(origins, flat))]
    if context.transmits.any():
        later = followed(context, origins, flat, met[0].hits)
        met += [Met(hits, number, weight) for number, hits, weight in later]
    return met, directions.reshape(rays, count, 3)


def sides_hit(elements: Elements, hits: Hits) -> np.ndarray:
    """(n,) int32 cell side of each hit: 2·cell + back; ``2 n_cells`` where nothing was hit."""
    sides = elements.cells_at(np.maximum(hits.triangle, 0), hits.u, hits.v)
    sides *= 2
    sides += ~hits.front
    sides[hits.triangle < 0] = elements.miss
    return sides


@dataclass(frozen=True)
class Gathered:
    """Mean over each owner's rays, (count, 3) float64: reflected light, and light first-hand, from
    the sky and from emission that is not sampled explicitly."""

    bounced: np.ndarray
    first: np.ndarray


def gather(
    context: Context, elements: Elements, reflected: np.ndarray, emitted: np.ndarray | None,
    count: int, rays: int, place, key, stage: str,
) -> Gathered:
    """Light that ``rays`` from each of ``count`` owners bring; ``place(chosen, group)`` gives the
    owners' Points. ``reflected`` and ``emitted`` (2 n_cells + 1, 3) float32: radiosity of cell
    sides, 0 in the last."""
    result = Gathered(np.zeros((count, 3)), np.zeros((count, 3)))

    def work(chunk):
        group, chosen = chunk
        met, directions = shoot(context, place(chosen, group), rays, *key, group, 3)
        bounced, first = 0.0, 0.0
        for part in met:
            sides = sides_hit(elements, part.hits)
            bounced = bounced + mean_of_rays(np.take(reflected, sides, axis=0), part, rays, len(chosen))
            first = first + sky_mean(context.sky, sides == elements.miss, part, directions)
            if emitted is not None:
                first = first + mean_of_rays(np.take(emitted, sides, axis=0), part, rays, len(chosen))
        return chosen, bounced, first

    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, bounced, first in map_chunks(work, chunks, context.threads, context.tick(stage)):
        result.bounced[chosen] = bounced
        result.first[chosen] = first
    return result


def mean_of_rays(values: np.ndarray, met: Met, rays: int, count: int) -> np.ndarray:
    """(R, 3) mean over each owner's ``rays`` of values (k, 3) at what they met, weighted."""
    if met.rays is None:
        return values.reshape(rays, -1, 3).mean(axis=0)
    owner = met.rays % count
    values = values * met.weight
    sums = [np.bincount(owner, values[:, channel], count) for channel in range(3)]
    return np.stack(sums, 1) / rays


def sky_mean(sky: Skylight | None, missed: np.ndarray, met: Met, directions: np.ndarray):
    """(R, 3) mean over rays of the sky's radiosity where ``missed`` (k,); 0 without a sky."""
    if sky is None:
        return 0.0
    rays, count = directions.shape[:2]
    if sky.constant and met.rays is None:
        return missed.reshape(rays, count).mean(axis=0)[:, None] * sky.pixels[0, 0]
    light = np.zeros((len(missed), 3), np.float32)
    numbers = np.flatnonzero(missed) if met.rays is None else met.rays[missed]
    light[missed] = sky(directions.reshape(-1, 3)[numbers])
    return mean_of_rays(light, met, rays, count)
