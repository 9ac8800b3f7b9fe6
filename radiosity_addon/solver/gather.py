"""Gather: cosine-distributed rays from points, and the light they bring back.

Depends on ``context``, ``points``, ``elements``, ``embree``, ``parallel``. One ray of n carries 1/n of the
irradiance: rows built from rays have entries >= 0 and sums <= 1, whatever the geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .context import Context
from .elements import Elements
from .embree import Hits, Tracer
from .parallel import map_chunks
from .points import Points, grouped_chunks
from .sampling import cosine_directions, sobol
from .skylight import Skylight

RAYS_PER_CHUNK = 1 << 16
POINTS = 4  # points on a receiver that share its rays


def shoot(tracer: Tracer, points: Points, rays: int, *key: int) -> tuple[Hits, np.ndarray]:
    """``rays`` cosine-distributed rays from each owner, shared among its points.

    Returns the hits, in order (rays, R) flattened, and directions (rays, R, 3) float32. ``rays``
    is a multiple of the points per owner. One matrix product turns the shared directions.
    """
    per, count = points.shape
    frames = points.frames()
    local = cosine_directions(sobol(rays, 2, *key))
    origins = np.empty((per, rays // per, count, 3), np.float32)
    directions = np.empty_like(origins)
    for p in range(per):
        axes = frames[p].transpose(1, 0, 2).reshape(3, 3 * count)
        directions[p] = (local[p::per] @ axes).reshape(-1, count, 3)
        origins[p] = points.position[p]
    hits = tracer.intersect(origins.reshape(-1, 3), directions.reshape(-1, 3))
    return hits, directions.reshape(rays, count, 3)


def sides_hit(elements: Elements, hits: Hits) -> np.ndarray:
    """(n,) int32 cell side of each hit: 2·cell + back; ``2 n_cells`` where nothing was hit."""
    sides = elements.cells_at(np.maximum(hits.triangle, 0), hits.u, hits.v)
    sides *= 2
    sides += ~hits.front
    sides[hits.triangle < 0] = elements.miss
    return sides


@dataclass(frozen=True)
class Gathered:
    """Mean over each owner's rays, (count, 3) float64: reflected light met, and sky met."""

    bounced: np.ndarray
    sky: np.ndarray


def gather(
    context: Context, elements: Elements, table: np.ndarray, count: int, rays: int, place, key,
    stage: str,
) -> Gathered:
    """Light that ``rays`` from each of ``count`` owners bring; ``place(chosen, group)`` gives the
    owners' Points. ``table`` (2 n_cells + 1, 3) float32: radiosity of cell sides, 0 in the last."""
    result = Gathered(np.zeros((count, 3)), np.zeros((count, 3)))

    def work(chunk):
        group, chosen = chunk
        hits, directions = shoot(context.tracer, place(chosen, group), rays, *key, group, 3)
        sides = sides_hit(elements, hits)
        brought = np.take(table, sides, axis=0).reshape(rays, -1, 3).mean(axis=0)
        missed = (sides == elements.miss).reshape(rays, -1)
        return chosen, brought, sky_mean(context.sky, missed, directions)

    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, brought, escaped in map_chunks(work, chunks, context.threads, context.tick(stage)):
        result.bounced[chosen] = brought
        result.sky[chosen] = escaped
    return result


def sky_mean(sky: Skylight | None, missed: np.ndarray, directions: np.ndarray):
    """(R, 3) mean over rays of the sky's radiosity where ``missed`` (rays, R); 0 without a sky."""
    if sky is None:
        return 0.0
    if sky.constant:
        return missed.mean(axis=0)[:, None] * sky.pixels[0, 0]
    light = np.zeros(missed.shape + (3,), np.float32)
    light[missed] = sky(directions[missed])
    return light.mean(axis=0)
