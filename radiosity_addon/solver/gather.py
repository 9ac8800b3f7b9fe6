"""Gather: cosine-distributed rays from points, and the light they bring back.

Depends on ``context``, ``points``, ``elements``, ``passage``, ``guide``, ``parallel``. One ray of n
carries 1/n of the irradiance: rows built from rays have entries >= 0 and sums <= 1, whatever the
geometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from .context import Context
from .elements import Elements
from .embree import Hits
from .guide import Guide, Learning
from .parallel import map_chunks
from .passage import followed
from .points import Points, grouped_chunks, shifted
from .sampling import cosine_directions, cosine_lifted, sobol
from .skylight import Skylight

RAYS_PER_CHUNK = 1 << 16


@dataclass(frozen=True)
class Met:
    """What rays met: all of them first, then those that went on through a surface.

    ``rays`` (k,) numbers the rays, ``weight`` (k, channels) the share of their light; both None for
    the first, which is every ray with weight 1.
    """

    hits: Hits
    rays: np.ndarray | None = None
    weight: np.ndarray | None = None


def shoot(context: Context, points: Points, rays: int, *key: int) -> tuple[list[Met], np.ndarray]:
    """``rays`` cosine-distributed rays from each owner, shared among its points.

    Returns what they met and their directions (rays, R, 3) float32; ray (m, r) has the number
    m·R + r. ``rays`` is a multiple of the points per owner.
    """
    return _trace(context, points, _shared_directions(points, sobol(rays, 2, *key)))


def shoot_guided(context: Context, points: Points, rays: int, guide: Guide, owners, *key: int):
    """The same as ``guide`` aims them for ``owners`` (R,), and the cells (rays, R) they are in."""
    table = sobol(rays, 2, *key).astype(np.float32)
    u, v = (shifted(table[:, axis, None], points.turn[:, axis]) for axis in (0, 1))
    *place, cells = guide.aim(owners, u, v)
    return *_trace(context, points, _own_directions(points, *place)), cells


def _trace(context: Context, points: Points, directions: np.ndarray):
    """Rays in ``directions`` (per, rays per point, R, 3) from the points: see ``shoot``."""
    origins = np.empty_like(directions)
    origins[:] = points.position[:, None]
    origins, flat = origins.reshape(-1, 3), directions.reshape(-1, 3)
    met = [Met(context.tracer.intersect(origins, flat))]
    if context.transmits.any():
        later = followed(context, origins, flat, met[0].hits)
        met += [Met(hits, number, weight) for number, hits, weight in later]
    return met, flat.reshape(-1, *directions.shape[2:])


def _shared_directions(points: Points, xi: np.ndarray) -> np.ndarray:
    """(per, rays per point, R, 3) float32 at places ``xi`` (rays, 2) of the square, the same for
    all owners but for a turn. Matrix products make them."""
    # Consecutive Sobol points cover the hemisphere evenly by themselves; every n-th would not.
    per, count = points.shape
    axes = points.axes(points.turn[:, 2])
    axes = axes.reshape(3, -1, 3 * count).swapaxes(0, 1)
    local = cosine_directions(xi).reshape(len(axes), -1, 3)
    return (local @ axes).reshape(per, -1, count, 3)


def _own_directions(points: Points, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(per, rays per point, R, 3) float32 at places (rays, R) of the square."""
    per, count = points.shape
    axes = points.axes()
    local = [axis.reshape(per, -1, count) for axis in cosine_lifted(u, v)]
    directions = np.empty(local[0].shape + (3,), np.float32)
    for axis in range(3):  # inner loops over owners, not over three numbers
        x, y, z = (part * each[:, None, :, axis] for part, each in zip(local, axes))
        x += y
        np.add(x, z, out=directions[..., axis])
    return directions


def sides_hit(elements: Elements, hits: Hits) -> np.ndarray:
    """(n,) int32 cell side of each hit: 2·cell + back; the miss where nothing was hit."""
    sides = elements.cells_at(hits.triangle, hits.u, hits.v)
    sides *= 2
    sides += ~hits.front
    if elements.has_cuts:
        np.copyto(sides, elements.nowhere, where=sides >= elements.miss)
    np.copyto(sides, elements.miss, where=hits.triangle < 0)
    return sides


def find_lost(sides: np.ndarray, elements: Elements, count: int) -> None:
    """What lies on a cut of its element, where none of its parts is sure, counts as what the
    owner's next ray met: ``sides`` (rays · count,) of all rays, changed in place."""
    if elements.has_cuts:
        lost = np.flatnonzero(sides == elements.nowhere)
        sides[lost] = sides[(lost + count) % len(sides)]


@dataclass(frozen=True)
class Unseen:
    """k places met of which nothing is known: cell side, triangle, barycentric u and v, which
    owner's ray met it, and ``weight`` (k, channels): its share in the owner's mean."""

    side: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray
    owner: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class Gathered:
    """Mean over each owner's rays, (count, channels) float64: reflected light, and light
    first-hand, from the sky and from emission that is not sampled explicitly. ``lessons`` are what
    ``Learning.add`` takes, or make it of the Learning."""

    bounced: np.ndarray
    first: np.ndarray
    unseen: Unseen | None
    lessons: list


def gather(
    context: Context, radiosity, count: int, rays: int, place, key, stage: str,
    owners: np.ndarray, learns: bool = False, guide: Guide | None = None,
) -> Gathered:
    """Light that ``rays`` from each of ``count`` owners bring; ``place(chosen, group)`` gives the
    owners' Points. ``radiosity`` has ``elements`` and, by cell side, ``reflected`` and ``emitted``
    (2 n_cells + 2, channels) float32, and bool whether it is ``unknown``. ``owners`` (count,) are
    the receivers' numbers; where somebody ``learns``, lessons are given; ``guide`` aims the rays;
    None: nobody."""
    totals, unseen, lessons = np.zeros((2, count, context.channels)), [], []
    elements = radiosity.elements
    emitted = _met_first(context, radiosity)

    def work(chunk):
        group, chosen = chunk
        whose = owners[chosen]
        points = place(chosen, group)
        key_, weight = (*key, group, 3), None
        if guide is None:
            met, directions = shoot(context, points, rays, *key_)
        else:
            met, directions, cells = shoot_guided(context, points, rays, guide, whose, *key_)
            weight = np.take(guide.weight, cells.ravel())[:, None]
        bounced, first, brought = 0.0, 0.0, None
        unseen = []
        for part in met:
            sides = sides_hit(elements, part.hits)
            unknown = np.flatnonzero(np.take(radiosity.unknown, sides))
            if len(unknown):
                share = 1 if part.weight is None else part.weight[unknown]
                share = share * (1 if weight is None else _of_first(weight, part)[unknown])
                share = np.broadcast_to(share / rays, (len(unknown), context.channels))
                numbers = np.arange(count)[chosen]
                unseen.append(_unseen(sides, part, unknown, numbers, share))
            if part.rays is None:
                find_lost(sides, elements, len(whose))
            light = np.take(radiosity.reflected, sides, axis=0)
            bounced = bounced + mean_of_rays(light, part, rays, len(whose), weight)
            direct = _first_hand(context, emitted, sides, part, directions)
            if direct is not None:
                first = first + mean_of_rays(direct, part, rays, len(whose), weight)
                light = light + direct
            if learns:
                brought = _brought(light, part, brought)
        if not learns:
            lesson = None
        elif guide is None:  # most bakes end with their first round: nobody asks
            lesson = partial(_lesson, sobol(rays, 2, *key_), points.turn[:, 2], whose, brought)
        else:
            lesson = Learning.sums(cells, brought)
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
    return Gathered(*totals, _join_unseen(unseen), lessons)


def _unseen(sides: np.ndarray, met: Met, index: np.ndarray, chosen, weight) -> Unseen:
    """The hits ``index`` (k,) of rays from owners ``chosen`` (R,)."""
    number, hits = index if met.rays is None else met.rays[index], met.hits
    return Unseen(
        sides[index], hits.triangle[index], hits.u[index], hits.v[index],
        chosen[number % len(chosen)], weight,
    )


def _join_unseen(parts: list[Unseen]) -> Unseen | None:
    names = ("side", "triangle", "u", "v", "owner", "weight")
    if not parts:
        return None
    return Unseen(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _lesson(xi, turn, owners, brought, learning: Learning):
    """What ``learning`` adds of rays at ``xi`` (rays, 2) with azimuths turned by ``turn`` (R,)."""
    return learning.sums(learning.cells(xi, turn, owners), brought)


def _brought(light: np.ndarray, met: Met, before: np.ndarray | None) -> np.ndarray:
    """(n,) mean of the channels of light (k, channels), as much of it as comes through, added to
    what the rays brought ``before``."""
    if met.weight is not None:
        light = light * met.weight
    mean = light @ np.full(light.shape[1], 1 / light.shape[1], np.float32)
    if met.rays is None:
        return mean
    before[met.rays] += mean
    return before


def _met_first(context: Context, radiosity) -> np.ndarray | None:
    """(2 n_cells + 2, channels) float32 light first-hand from what rays meet, by cell side: emission
    that is not sampled explicitly, and of the miss a constant sky's; None where there is neither."""
    emitted, sky = radiosity.emitted, context.sky
    if sky is None or not sky.constant:
        return emitted
    table = np.zeros_like(radiosity.reflected) if emitted is None else emitted.copy()
    table[radiosity.elements.miss] = sky.pixels[0, 0]
    return table


def _first_hand(context: Context, emitted, sides: np.ndarray, met: Met, directions: np.ndarray):
    """(k, channels) float32 light from the sky, and emission met; None where there is neither."""
    light = None if emitted is None else np.take(emitted, sides, axis=0)
    if context.sky is None or context.sky.constant:
        return light
    if light is None:
        light = np.zeros((len(sides), context.channels), np.float32)
    missed = np.flatnonzero(met.hits.triangle < 0)
    numbers = missed if met.rays is None else met.rays[missed]
    light[missed] += context.sky(directions.reshape(-1, 3)[numbers])
    return light


def mean_of_rays(values: np.ndarray, met: Met, rays: int, count: int, weight=None) -> np.ndarray:
    """(R, c) mean over each owner's ``rays`` of values (k, c) at what they met, of which the share
    ``met.weight`` comes through, of rays with ``weight`` (rays · R, 1), 1 where None."""
    if met.weight is not None:
        values = values * met.weight
    if weight is not None:
        values = values * np.repeat(_of_first(weight, met), values.shape[1]).reshape(values.shape)
    if met.rays is None:
        return values.reshape(rays, count, -1).mean(axis=0)
    owner = met.rays % count
    sums = [np.bincount(owner, values[:, channel], count) for channel in range(values.shape[1])]
    return np.stack(sums, 1) / rays


def _of_first(weight: np.ndarray, met: Met) -> np.ndarray:
    """(k, 1) weights of rays (rays · R, 1) at what they met."""
    return weight if met.rays is None else weight[met.rays]


def sky_mean(sky: Skylight | None, missed: np.ndarray, met: Met, directions: np.ndarray):
    """(R, channels) mean over rays of the sky's radiosity where ``missed`` (k,); 0 without a
    sky."""
    if sky is None:
        return 0.0
    rays, count = directions.shape[:2]
    if sky.constant and met.rays is None:
        return missed.reshape(rays, count).mean(axis=0)[:, None] * sky.pixels[0, 0]
    light = np.zeros((len(missed), sky.pixels.shape[2]), np.float32)
    numbers = np.flatnonzero(missed) if met.rays is None else met.rays[missed]
    light[missed] = sky(directions.reshape(-1, 3)[numbers])
    return mean_of_rays(light, met, rays, count)
