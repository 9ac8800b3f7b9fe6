"""Gather: cosine-distributed rays from points, and the light they bring back.

One ray of n carries 1/n of the irradiance: rows built from rays have entries >= 0 and sums <= 1,
whatever the geometry.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..lights.context import Context
from ..lights.polygons import NEAR
from ..sampling.guide import Guide, Lesson, PlainRays, sums_by_bin
from ..sampling.points import Points, PointSampler, grouped_chunks
from ..sampling.sobol import sobol
from ..transport.onward import Ends, ends_of, go_on, join_ends
from ..transport.patches import Patches
from ..transport.radiosity import Radiosity
from ..transport.rays import (
    RAYS_PER_CHUNK,
    Met,
    Shot,
    guided_directions,
    mean_of_rays,
    of_first,
    shared_directions,
    shoot,
    sky_of,
    sums_of,
)


@dataclass(frozen=True)
class Gathered:
    """Means over each of ``count`` owners' rays. ``lessons`` are what ``Learning.add`` takes."""

    bounced: np.ndarray  # (count, channels) float64 irradiance that surfaces reflected
    # (count, channels) float64 irradiance first-hand: of the sky and of emission not sampled explicitly
    first: np.ndarray
    unknown: Ends  # where nothing is known; the weight is the share in the owner's mean
    lessons: list[Lesson]


@dataclass(frozen=True)
class Bundle:
    """Rays to be shot: ``rays`` from each of ``owners`` (count,) int, from the Points that
    ``sample_points(chosen, group)`` gives of some of them. ``guide`` aims them; None: the cosine law does."""

    owners: np.ndarray  # (count,) int: the receivers' numbers
    rays: int
    sample_points: PointSampler
    key: tuple[int, ...]
    guide: Guide | None = None


@dataclass(frozen=True)
class _ShotBundle:
    """Rays of some of a bundle's owners that were shot, and how they count."""

    numbers: np.ndarray  # (R,) int: the owners' in the bundle
    key: tuple[int, ...]
    points: Points
    rays: Shot
    share: np.ndarray | None  # (rays · R, 1) that counts, as owners are shaded; None: all
    weight: np.ndarray | None  # (rays · R, 1) the same times what guided rays weigh; None: 1
    bins: np.ndarray | None  # (rays, R) of the guide's; None: no guide


@dataclass(frozen=True)
class _Light:
    """What rays bring to R owners: ``bounced`` light and light ``first``-hand, means (R, channels) over an owner's
    rays; where they ended and nothing is known; and the light of each ray (rays · R,)."""

    bounced: np.ndarray
    first: np.ndarray | float
    unknown: list[Ends]
    light: np.ndarray | None


def gather(
    context: Context, radiosity: Radiosity, bundle: Bundle, phase: str, learns: bool = False
) -> Gathered:
    """Light that a ``bundle`` of rays brings, with lessons for a guide where ``learns``."""
    count = len(bundle.owners)
    totals, unknown, lessons = np.zeros((2, count, context.channels)), [], []
    work = _GatherChunk(
        context, radiosity.table(), bundle, first_hand_table(context, radiosity), learns
    )
    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // bundle.rays))
    for chosen, found, lesson in context.map_chunks(work, chunks, phase):
        totals[0, chosen] = found.bounced
        totals[1, chosen] = found.first
        unknown += found.unknown
        if learns:
            lessons.append(lesson)
    return Gathered(*totals, join_ends(unknown, context.channels), lessons)


@dataclass(frozen=True)
class _GatherChunk:
    """Gathers for a (group, slice) of a bundle's owners. ``emitted``: see ``first_hand_table``."""

    context: Context
    radiosity: Radiosity
    bundle: Bundle
    emitted: np.ndarray | None
    learns: bool

    def __call__(self, chunk: tuple[int, slice]) -> tuple[slice, _Light, Lesson | None]:
        shot = _shoot(self.context, self.radiosity.patches, self.bundle, *chunk)
        found = _light_of(self.context, self.radiosity, self.emitted, shot, self.learns)
        lesson = _lesson(self.bundle, shot, found.light) if self.learns else None
        return chunk[1], replace(found, light=None), lesson


def _shoot(
    context: Context, patches: Patches, bundle: Bundle, group: int, chosen: slice
) -> _ShotBundle:
    """Shoot the rays of the owners ``chosen`` of one ``group``."""
    points, owners = bundle.sample_points(chosen, group), bundle.owners[chosen]
    key, weight, share, bins = (*bundle.key, group, 3), None, None, None
    if bundle.guide is None:
        directions = shared_directions(points, bundle.rays, *key)
    else:
        directions, bins = guided_directions(points, bundle.rays, bundle.guide, owners, *key)
    rays = shoot(context, patches, points, directions, near_goes_onward=True)
    if bins is not None:
        bins = rays.replaced(bins)
        weight = np.take(bundle.guide.weight, bins.ravel())[:, None]
    if points.shade is not None:
        share = rays.replaced(points.shade.share_of_rays(rays.directions))
        weight = share if weight is None else weight * share
    numbers = np.arange(len(bundle.owners))[chosen]
    return _ShotBundle(numbers, key, points, rays, share, weight, bins)


def _light_of(
    context: Context, radiosity: Radiosity, emitted: np.ndarray | None, shot: _ShotBundle,
    learns: bool,
) -> _Light:
    """Means over the ``rays`` of each owner of the ``shot``, (count, channels). ``emitted`` is from
    ``first_hand_table``. Where the guide ``learns``, the light of each ray is kept, too."""
    directions = shot.rays.directions
    rays, count = directions.shape[:2]
    bounced, first, by_ray, ends = 0.0, 0.0, None, []
    for part in shot.rays.met:
        unknown = _unknown(radiosity, part, shot.share)
        if len(unknown):
            ends.append(_ends_unknown(shot, part, unknown, context.channels))
        light = np.take(radiosity.reflected, part.entry, axis=0)
        bounced = bounced + mean_of_rays(light, part, rays, count, shot.weight)
        direct = first_hand(context, radiosity, emitted, part, directions)
        if direct is not None:
            first = first + mean_of_rays(direct, part, rays, count, shot.weight)
            light = light + direct
        if learns:
            seen = light if shot.share is None else light * of_first(shot.share, part)
            by_ray = _light_by_ray(seen, part, by_ray)
    return _Light(bounced, first, ends, by_ray)


def _ends_unknown(shot: _ShotBundle, met: Met, unknown: np.ndarray, channels: int) -> Ends:
    """The Ends at the hits ``unknown`` (k,) int, weighted by their shares of owners' means."""
    directions = shot.rays.directions
    rays, count = directions.shape[:2]
    weight = 1 if shot.weight is None else of_first(shot.weight, met)[unknown]
    weight = np.broadcast_to(weight / rays, (len(unknown), channels))
    owner = shot.numbers[met.number(unknown) % count]
    return ends_of(met, directions, unknown, owner, weight)


def _lesson(bundle: Bundle, shot: _ShotBundle, light: np.ndarray) -> Lesson:
    """What a guide learns from rays that brought ``light`` (rays · R,)."""
    if shot.bins is not None:
        return sums_by_bin(shot.bins, light)
    xi, owners = sobol(bundle.rays, 2, *shot.key), bundle.owners[shot.numbers]
    return PlainRays(xi, shot.points.shift[:, 2], owners, light)


def _unknown(radiosity: Radiosity, met: Met, share: np.ndarray | None) -> np.ndarray:
    """(k,) int: hits of which nothing is known, of rays that count at all."""
    unknown = np.take(radiosity.unknown, met.entry) | (met.entry == radiosity.patches.onward)
    unknown = np.flatnonzero(unknown)
    return unknown if share is None else unknown[of_first(share, met)[unknown, 0] > 0]


def light_at(table: np.ndarray, ends: Ends, count: int) -> np.ndarray:
    """(count, channels) sums of what ``table`` (n_entries, channels) has where owners' rays ended."""
    return sums_of(ends.owner, ends.weight * table[ends.places.entry], count)


def follow_onward(
    context: Context, radiosity: Radiosity, rays: Ends, count: int, key: tuple[int, ...],
    near_goes_onward: bool = True,
) -> tuple[np.ndarray, np.ndarray, Ends]:
    """What owners' ``rays`` that ended on no patch bring in the end, (count, channels) each: light reflected on the
    way, without what the patches reflect that rays end on; first-hand light; and the Ends on those patches, near ones
    only where not ``near_goes_onward``."""
    patches = radiosity.patches
    if near_goes_onward:  # others read avoided patches as they are
        patches = patches.with_all_counted()
    onward = go_on(context, patches, rays, count, (*key, 1), near_goes_onward)
    light, first = onward.light(context, (*key, 2))
    light += onward.sky
    if radiosity.emitted is not None:
        light += light_at(radiosity.emitted, onward.ends, count)
    return light, first, onward.ends


def _light_by_ray(light: np.ndarray, met: Met, before: np.ndarray | None) -> np.ndarray:
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
    """(n_entries, channels) float32 first-hand light of what rays meet, by entry: emission that is not sampled
    explicitly and, for the miss, a constant sky. None where there is neither."""
    emitted, sky = radiosity.emitted, context.sky
    if sky is None or not sky.constant:
        return emitted
    table = np.zeros_like(radiosity.reflected) if emitted is None else emitted.copy()
    table[radiosity.patches.miss] = sky.pixels[0, 0]
    return table


def first_hand(
    context: Context, radiosity: Radiosity, emitted: np.ndarray | None, met: Met,
    directions: np.ndarray,
) -> np.ndarray | None:
    """(k, channels) float32 light from the sky, and emission met; None where there is neither. A
    near ray takes a picture's value where it ends, a far one the mean over the cell."""
    light = None if emitted is None else np.take(emitted, met.entry, axis=0)
    if radiosity.varied is not None:
        near = np.take(radiosity.varied, met.entry) > NEAR * met.hits.distance
        some = np.flatnonzero(near & (met.hits.triangle >= 0))
        uv = np.stack([met.hits.u[some], met.hits.v[some]], 1).astype(float)
        found = context.emission(met.hits.triangle[some], uv, met.hits.front[some])
        light[some] = np.pi * found
    if context.sky is None or context.sky.constant:
        return light
    if light is None:
        light = np.zeros((len(met.entry), context.channels), np.float32)
    missed = np.flatnonzero(met.hits.triangle < 0)
    light[missed] += sky_of(context.sky, met, missed, directions)
    return light
