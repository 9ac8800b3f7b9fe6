"""Gather: cosine-distributed rays from points, and the light they bring back.

One ray of n carries 1/n of the irradiance: rows built from rays have entries >= 0 and sums <= 1,
whatever the geometry.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lights.context import Context
from ..lights.polygons import NEAR
from ..sampling.guide import Guide, Lesson, PlainRays, sums_by_cell
from ..sampling.points import PlacePoints, grouped_chunks
from ..sampling.sobol import sobol
from ..transport.onward import Ends, ends_of, go_on, join_ends
from ..transport.radiosity import Radiosity
from ..transport.rays import (
    RAYS_PER_CHUNK,
    Met,
    find_lost,
    mean_of_rays,
    of_first,
    shoot,
    shoot_guided,
    sums_of,
)
from ..workers.parallel import map_chunks


@dataclass(frozen=True)
class Gathered:
    """Mean over each owner's rays, (count, channels) float64: reflected light, and light
    first-hand, from the sky and from emission that is not sampled explicitly. ``lessons`` are what
    ``Learning.add`` takes."""

    bounced: np.ndarray
    first: np.ndarray
    unseen: Ends  # where nothing is known; the weight is the share in the owner's mean
    lessons: list[Lesson]


def gather(
    context: Context, radiosity: Radiosity, count: int, rays: int, place: PlacePoints,
    key: tuple[int, ...], stage: str, owners: np.ndarray, learns: bool = False,
    guide: Guide | None = None,
) -> Gathered:
    """Light that ``rays`` from each of ``count`` owners bring; ``place(chosen, group)`` gives the
    owners' Points. ``radiosity`` is a Radiosity. ``owners`` (count,) are the receivers' numbers; where
    somebody ``learns``, lessons are given; ``guide`` aims the rays; None: nobody."""
    totals, unseen, lessons = np.zeros((2, count, context.channels)), [], []
    patches = radiosity.patches
    emitted = first_hand_table(context, radiosity)

    def work(chunk: tuple[int, slice]):
        group, chosen = chunk
        whose = owners[chosen]
        points = place(chosen, group)
        key_, weight = (*key, group, 3), None
        if guide is None:
            met, directions = shoot(context, points, rays, *key_)
        else:
            met, directions, cells = shoot_guided(context, points, rays, guide, whose, *key_)
            weight = np.take(guide.weight, cells.ravel())[:, None]
        share = None if points.shade is None else points.shade.share_of_rays(directions)
        if share is not None:
            weight = share if weight is None else weight * share
        bounced, first, brought = 0.0, 0.0, None
        unseen = []
        for part in met:
            entries = patches.hit_resolved(part.hits)
            unknown = _unknown(radiosity, part, entries, share)
            if len(unknown):
                worth = 1 if weight is None else of_first(weight, part)[unknown]
                worth = np.broadcast_to(worth / rays, (len(unknown), context.channels))
                number = unknown if part.rays is None else part.rays[unknown]
                owner = np.arange(count)[chosen][number % len(whose)]
                unseen.append(ends_of(part, directions, entries, unknown, owner, worth))
            if part.rays is None:
                find_lost(entries, patches, len(whose))
            light = np.take(radiosity.reflected, entries, axis=0)
            bounced = bounced + mean_of_rays(light, part, rays, len(whose), weight)
            direct = first_hand(context, radiosity, emitted, entries, part, directions)
            if direct is not None:
                first = first + mean_of_rays(direct, part, rays, len(whose), weight)
                light = light + direct
            if learns:
                seen = light if share is None else light * of_first(share, part)
                brought = _brought(seen, part, brought)
        if not learns:
            lesson = None
        elif guide is None:
            lesson = PlainRays(sobol(rays, 2, *key_), points.turn[:, 2], whose, brought)
        else:
            lesson = sums_by_cell(cells, brought)
        return chosen, bounced, first, unseen, lesson

    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, bounced, first, places, lesson in map_chunks(
        work, chunks, context.threads, context.tick(stage)
    ):
        totals[0, chosen] = bounced
        totals[1, chosen] = first
        unseen += places
        if learns:
            lessons.append(lesson)
    return Gathered(*totals, join_ends(unseen, context.channels), lessons)


def _unknown(
    radiosity: Radiosity, met: Met, entries: np.ndarray, share: np.ndarray | None
) -> np.ndarray:
    """(k,) int: hits with ``entries`` (n,) of which nothing is known, of rays that count at all."""
    unknown = np.take(radiosity.unknown, entries) | (entries == radiosity.patches.onward)
    unknown = np.flatnonzero(unknown)
    return unknown if share is None else unknown[of_first(share, met)[unknown, 0] > 0]


def light_at(table: np.ndarray, ends: Ends, count: int) -> np.ndarray:
    """(count, channels) sums of what ``table`` (n_entries, channels) has where owners' rays ended."""
    return sums_of(ends.owner, ends.weight * table[ends.places.entry], count)


def follow_onward(
    context: Context, radiosity: Radiosity, rays: Ends, count: int, key: tuple[int, ...]
):
    """What owners' ``rays`` that ended on no patch bring in the end, (count, channels): light that was
    reflected, but by the patches that they end on; light first-hand; and these Ends."""
    onward = go_on(context, radiosity.patches, rays, count, (*key, 1))
    light, first = onward.light(context, (*key, 2))
    light += onward.sky
    if radiosity.emitted is not None:
        light += light_at(radiosity.emitted, onward.ends, count)
    return light, first, onward.ends


def _brought(light: np.ndarray, met: Met, before: np.ndarray | None) -> np.ndarray:
    """(n,) mean of the channels of light (k, channels), as much of it as comes through, added to
    what the rays brought ``before``."""
    if met.weight is not None:
        light = light * met.weight
    mean = (light @ np.full(light.shape[1], 1 / light.shape[1])).astype(np.float32)
    if met.rays is None:
        return mean
    before[met.rays] += mean
    return before


def first_hand_table(context: Context, radiosity: Radiosity) -> np.ndarray | None:
    """(n_entries, channels) float32 light first-hand from what rays meet, by entry: emission
    that is not sampled explicitly, and of the miss a constant sky's; None where there is neither."""
    emitted, sky = radiosity.emitted, context.sky
    if sky is None or not sky.constant:
        return emitted
    table = np.zeros_like(radiosity.reflected) if emitted is None else emitted.copy()
    table[radiosity.patches.miss] = sky.pixels[0, 0]
    return table


def first_hand(
    context: Context, radiosity: Radiosity, emitted: np.ndarray | None, entries: np.ndarray,
    met: Met, directions: np.ndarray,
):
    """(k, channels) float32 light from the sky, and emission met; None where there is neither. What
    a near ray meets of a picture is its value there, of a far one the mean over the cell."""
    light = None if emitted is None else np.take(emitted, entries, axis=0)
    if radiosity.varied is not None:
        near = np.take(radiosity.varied, entries) > NEAR * met.hits.distance
        some = np.flatnonzero(near & (met.hits.triangle >= 0))
        uv = np.stack([met.hits.u[some], met.hits.v[some]], 1).astype(float)
        found = context.emission(met.hits.triangle[some], uv, met.hits.front[some])
        light[some] = np.pi * found
    if context.sky is None or context.sky.constant:
        return light
    if light is None:
        light = np.zeros((len(entries), context.channels), np.float32)
    missed = np.flatnonzero(met.hits.triangle < 0)
    numbers = missed if met.rays is None else met.rays[missed]
    light[missed] += context.sky(directions.reshape(-1, 3)[numbers])
    return light
