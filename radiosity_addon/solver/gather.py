"""Gather: cosine-distributed rays from footprints, and the light they bring back.

Depends on ``footprints``, ``elements``, ``embree``, ``parallel``. One ray of n carries 1/n of the
irradiance: rows built from rays have entries >= 0 and sums <= 1, whatever the geometry.
"""

from __future__ import annotations

import numpy as np

from .elements import Elements
from .embree import Tracer
from .footprints import Footprints, grouped_chunks, point_frames, sample_points
from .parallel import map_chunks
from .sampling import cosine_directions, sobol

RAYS_PER_CHUNK = 1 << 16
POINTS = 4  # points on a footprint that share its rays


def trace_footprints(tracer, elements, footprints, chosen, rays, key, group):
    """Sides hit by ``rays`` from each of ``chosen`` footprints, and the directions.

    Returns (rays, R) int64 indices of cell sides (2·cell + back; the last one where nothing is
    hit) and (rays, R, 3) float32 directions.
    """
    per = min(POINTS, rays)
    points = sample_points(footprints, chosen, per, *key, group, 2)
    frames = point_frames(points, footprints.turn[chosen, 2])
    local = cosine_directions(sobol(rays, 2, *key, group, 3))
    count = len(chosen)
    origins = np.empty((per, rays // per, count, 3), np.float32)
    directions = np.empty_like(origins)
    for p in range(per):
        axes = frames[p].transpose(1, 0, 2).reshape(3, 3 * count)
        directions[p] = (local[p::per] @ axes).reshape(-1, count, 3)
        origins[p] = points.position[p]
    hits = tracer.intersect(origins.reshape(-1, 3), directions.reshape(-1, 3))
    return sides_hit(elements, hits).reshape(rays, count), directions.reshape(rays, count, 3)


def sides_hit(elements: Elements, hits) -> np.ndarray:
    """(n,) int64 cell side of each hit: 2·cell + back; ``2 n_cells`` where nothing was hit."""
    missed = hits.triangle < 0
    cells = elements.cells_at(np.where(missed, 0, hits.triangle), hits.u, hits.v)
    sides = 2 * cells + ~hits.front
    sides[missed] = 2 * len(elements.element)
    return sides


def gather(
    tracer: Tracer,
    elements: Elements,
    footprints: Footprints,
    table: np.ndarray,
    rays: int,
    key: tuple[int, ...],
    threads: int,
    tick,
    sky=None,
):
    """(count, 3) mean of ``table`` over each footprint's rays, and (count, 3) mean of the sky.

    ``table`` (2 n_cells + 1, channels) float32: what a ray brings from each cell side; last the
    escaped ray's. ``sky`` (n, 3) directions → (n, channels), or None where none shines.
    """
    channels = table.shape[1]
    bounced = np.zeros((footprints.count, channels))
    open_sky = np.zeros((footprints.count, channels))

    def work(chunk):
        group, chosen = chunk
        sides, directions = trace_footprints(
            tracer, elements, footprints, chosen, rays, key, group
        )
        brought = np.take(table, sides.ravel(), axis=0).reshape(rays, -1, channels).mean(axis=0)
        escaped = sky_mean(sky, sides == len(table) - 1, directions, channels)
        return chosen, brought, escaped

    chunks = grouped_chunks(footprints.count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, brought, escaped in map_chunks(work, chunks, threads, tick):
        bounced[chosen] = brought
        open_sky[chosen] = escaped
    return bounced, open_sky


def sky_mean(sky, missed: np.ndarray, directions: np.ndarray, channels: int) -> np.ndarray | float:
    """(R, channels) mean over rays of the sky's light where ``missed`` (rays, R)."""
    if sky is None:
        return 0.0
    light = np.zeros(missed.shape + (channels,), np.float32)
    light[missed] = sky(directions[missed])
    return light.mean(axis=0)
