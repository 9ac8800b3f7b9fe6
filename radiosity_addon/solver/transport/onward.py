"""Onward: where a ray ends on no patch it is reflected, as a path, until it ends on one.

Nothing is averaged over such a place, so no light leaks there; each ray finds its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Generic, Protocol

import numpy as np

from ..array_struct import ArrayStruct
from ..direct.irradiance import direct_at
from ..geometry.triangles import OFFSET
from ..lights.context import Context
from ..sampling.points import Points
from ..sampling.sobol import uniform
from ..workers.parallel import Result_co, ranges
from .patches import Patches
from .places import Places, no_places, places_at
from .rays import Met, own_directions, shoot, sky_of, sums_of

MOST_BOUNCES = 64  # number [bounces] of a ray, at most: chance ends nearly all long before
FULL_BOUNCES = 2  # number [bounces] after which as few rays of an owner go on as their lower weight asks for, one at least
LAST_BOUNCES = 6  # number [bounces] after which Russian roulette ends the last one, too, and near patches' means are read
NEAR_BOUNCES = 24  # number [bounces] of rays that go on from near patches, too, after which both hold for these
BACK = 4 * OFFSET  # distance [unit box] before its end at which a ray goes on; of a short ray half of its length
FOLLOWED_PER_CHUNK = 1 << 15  # number [rays] of a chunk
TINY = 1e-300  # weight [of an owner's rays], at least, so that quotients are finite
PHASE = "transport"


@dataclass(frozen=True)
class Ends(ArrayStruct):
    """Where k rays ended: their owners (k,) int, the places, ``weight`` (k, channels) of the light
    that comes back to the owner, and ``back`` (k, 3) float32 from there a little on the way they came."""

    owner: np.ndarray
    places: Places
    weight: np.ndarray
    back: np.ndarray

    def points(self, context: Context, shift: np.ndarray) -> Points:
        """A point of its own at each end, a little back on the ray's way: nothing stands there. Points drawn
        in from the triangle's edges, or a hit as it is rounded, may lie behind a wall that stands close by."""
        places, geometry = self.places, context.geometry
        normal = np.where(places.front[:, None], 1.0, -1.0) * geometry.normal[places.triangle]
        normal = normal.astype(np.float32)
        position = geometry.at(places.triangle, places.uv) + self.back
        height = (self.back * normal).sum(axis=1, keepdims=True)
        position += np.maximum(OFFSET - height, 0) * normal
        uv = places.uv.astype(np.float32)
        return Points(
            position[None].astype(np.float32), normal[None], places.triangle[None], uv[None], shift
        )

    def surviving(self, chance: np.ndarray, xi: np.ndarray) -> Ends:
        """The ends that Russian roulette keeps: those whose number ``xi`` (k,) lies below their ``chance`` (k,),
        weighted so that they stand for the others, too."""
        kept = np.flatnonzero(xi < chance)
        ends = self.take(kept)
        return replace(ends, weight=ends.weight / chance[kept, None])


def ends_of(
    met: Met, directions: np.ndarray, chosen: np.ndarray, owner: np.ndarray, weight: np.ndarray
) -> Ends:
    """Of the hits ``chosen`` (k,) of a part, as ``owner`` (k,) has them; ``weight`` (k, channels)
    beside what came through surfaces. Rays started in ``directions`` (rays, R, 3)."""
    if met.weight is not None:
        weight = weight * met.weight[chosen]
    length = np.minimum(np.float32(BACK), met.hits.distance[chosen] / 2)
    back = -length[:, None] * directions.reshape(-1, 3)[met.number(chosen)]
    return Ends(owner, places_at(met, chosen), weight, back)


def join_ends(parts: list[Ends], channels: int) -> Ends:
    """All ends of all parts, of which there may be none."""
    if not parts:
        nothing = np.zeros((0, 3), np.float32)
        return Ends(np.zeros(0, np.int64), no_places(), np.zeros((0, channels)), nothing)
    return Ends.join(parts)


@dataclass(frozen=True)
class Onward:
    """What came of rays that went on. ``passed``: the places that they came to, weighted by the light that arrives
    there. ``lit``: the places at which they were reflected, weighted by the reflected light. ``ends``: their ends on
    patches. ``sky`` (count, channels): the light of the sky that they found."""

    passed: Ends
    lit: Ends
    ends: Ends
    sky: np.ndarray
    first_ones: int  # of ``passed``, at its start: no surface has reflected these before

    def light(self, context: Context, key: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
        """(count, channels) direct light that rays found on their way, which was reflected, and
        emission of where they ended first."""
        count = len(self.sky)
        if len(self.passed.owner) == 0:
            return np.zeros_like(self.sky), np.zeros_like(self.sky)
        points = self.lit.points(context, uniform((len(self.lit.owner), 3), *key, 1))
        direct, _ = direct_at(context, points, (*key, 2), PHASE)
        light = sums_of(self.lit.owner, self.lit.weight * direct, count)
        if not context.glows:
            return light, np.zeros_like(light)
        places, owner, first = self.passed.places, self.passed.owner, self.first_ones
        glow = np.pi * context.emission(places.triangle, places.uv, places.front)
        glow *= self.passed.weight * ~context.explicit[places.triangle][:, None]
        light += sums_of(owner[first:], glow[first:], count)
        return light, sums_of(owner[:first], glow[:first], count)

    def of(self, owners: np.ndarray) -> Onward:
        """The same of rays whose owners number the ``owners`` (n,) int."""
        passed, lit, ends = (
            replace(each, owner=owners[each.owner]) for each in (self.passed, self.lit, self.ends)
        )
        return replace(self, passed=passed, lit=lit, ends=ends)

    def divided(self) -> tuple[Ends, Ends]:
        """``passed``: those that no surface has reflected before, and the others."""
        everything = np.arange(len(self.passed.owner))
        return tuple(self.passed.take(some) for some in np.split(everything, [self.first_ones]))


def go_on(
    context: Context, patches: Patches, rays: Ends, count: int, key: tuple[int, ...],
    near_goes_onward: bool = False,
) -> Onward:
    """Follow ``rays`` that ended on no patch; their owners are below ``count``. Where ``near_goes_onward``, they go on
    from near patches, too, as often as they meet one: in a gap that is narrow beside its patches, light that is read
    from these creeps in by a patch with each reflection, however fast it fades there."""
    follow = partial(_go_on, context, patches, near_goes_onward)
    if len(rays.owner) <= FOLLOWED_PER_CHUNK:
        return follow(rays, count, key)
    sky, parts = np.zeros((count, context.channels)), []
    for owners, part in follow_in_chunks(context, follow, rays, key, PHASE):
        sky[owners] += part.sky
        parts.append(part.of(owners))
    first, later = zip(*(part.divided() for part in parts))
    passed, lit, ends = (
        join_ends(some, context.channels)
        for some in ([*first, *later], [p.lit for p in parts], [p.ends for p in parts])
    )
    return Onward(passed, lit, ends, sky, len(rays.owner))


class Follow(Protocol[Result_co]):
    """Follows ``rays``, whose owners are below ``count``: what comes of them, by owner."""

    def __call__(self, rays: Ends, count: int, key: tuple[int, ...], /) -> Result_co: ...


def follow_in_chunks(
    context: Context, follow: Follow[Result_co], rays: Ends, key: tuple[int, ...], phase: str
) -> list[tuple[np.ndarray, Result_co]]:
    """``follow`` done with ``rays``, chunk by chunk, on all cores. Of each chunk: its owners (n,) int, and what came
    of its rays, in which owners have their numbers among these."""
    chunks = ranges(len(rays.owner), FOLLOWED_PER_CHUNK)
    return context.map_chunks(_FollowChunk(follow, rays, key), chunks, phase)


@dataclass(frozen=True)
class _FollowChunk(Generic[Result_co]):
    """Follows a slice of ``rays``."""

    follow: Follow[Result_co]
    rays: Ends
    key: tuple[int, ...]

    def __call__(self, chunk: slice) -> tuple[np.ndarray, Result_co]:
        rays = self.rays.take(chunk)
        owners, number = np.unique(rays.owner, return_inverse=True)
        key = (*self.key, *([chunk.start] if chunk.start else []))
        return owners, self.follow(replace(rays, owner=number.reshape(-1)), len(owners), key)


def _go_on(
    context: Context, patches: Patches, near_goes_onward: bool, rays: Ends, count: int,
    key: tuple[int, ...],
) -> Onward:
    """``go_on`` of one chunk: see there."""
    sky, passed, lit, ended, first = np.zeros((count, context.channels)), [], [], [], len(rays.owner)
    last = NEAR_BOUNCES if near_goes_onward else LAST_BOUNCES
    for bounce in range(MOST_BOUNCES):
        if len(rays.owner) == 0:
            break
        passed.append(rays)
        rays = _reflected(context, rays)
        if bounce >= FULL_BOUNCES:
            rays = _resampled(rays, passed[-1], bounce >= last, (*key, bounce))
        if len(rays.owner) == 0:
            break
        lit.append(rays)
        points = rays.points(context, uniform((len(rays.owner), 3), *key, bounce, 2))
        shot = shoot(context, patches, points, own_directions(points, 1, *key, bounce, 4),
                     near_goes_onward and bounce + 1 < last)
        parts = []
        for part in shot.met:
            parts.append(ends_of(part, shot.directions, np.arange(len(part.entry)),
                                 rays.owner[part.numbers], rays.weight[part.numbers]))  # fmt: skip
            missed = np.flatnonzero(part.entry == patches.miss)
            if context.sky is not None and len(missed):
                found = sky_of(context.sky, part, missed, shot.directions)
                sky += sums_of(parts[-1].owner[missed], parts[-1].weight[missed] * found, count)
        rays = join_ends(parts, context.channels)
        ended.append(rays.take(np.flatnonzero(patches.somewhere(rays.places.entry))))
        rays = rays.take(np.flatnonzero(rays.places.entry == patches.onward))
    passed, lit, ended = (join_ends(parts, context.channels) for parts in (passed, lit, ended))
    return Onward(passed, lit, ended, sky, first)


def _reflected(context: Context, rays: Ends) -> Ends:
    """The ``rays`` as they leave where they ended, without those of which nothing is left."""
    places = rays.places
    weight = rays.weight * context.reflectance(places.triangle, places.uv, places.front)
    return replace(rays, weight=weight).take(np.flatnonzero(weight.max(axis=1, initial=0)))


def _resampled(rays: Ends, before: Ends, by_chance: bool, key: tuple[int, ...]) -> Ends:
    """A sample of the ``rays`` that stands for all of them: as many of each owner's as make these about as large as
    ``before`` they were reflected, rounded up, or ``by_chance``: then there may be none."""
    count = int(before.owner.max()) + 1
    total, before_total = (np.bincount(each.owner, each.weight.max(axis=1, initial=0), count) for each in (rays, before))
    left = np.bincount(before.owner, minlength=count) * (total / np.maximum(before_total, TINY))
    return _drawn(rays, left if by_chance else np.ceil(left), key)


def thinned(rays: Ends, share: float, key: tuple[int, ...]) -> Ends:
    """A sample of the ``rays`` that stands for all of them: the ``share`` of each owner's, rounded up."""
    rays = rays.take(np.flatnonzero(rays.weight.max(axis=1, initial=0)))
    return _drawn(rays, np.ceil(share * np.bincount(rays.owner)), key)


def _drawn(rays: Ends, left: np.ndarray, key: tuple[int, ...]) -> Ends:
    """A sample of about ``left`` (owners,) of each owner's ``rays``, drawn at equal steps of their weights (systematic
    resampling; Douc and Cappé 2005, section 2.4). Each owner keeps the sum of its weights, so that even light has no
    noise."""
    rays = rays.take(np.argsort(rays.owner, kind="stable"))
    weight = rays.weight.max(axis=1, initial=0)
    first = np.flatnonzero(np.diff(rays.owner, prepend=-1))
    number = np.diff(np.append(first, len(weight)))
    owner = np.repeat(np.arange(len(first)), number)
    total, left = np.bincount(owner, weight), left[rays.owner[first]]
    until = np.cumsum(weight)
    start = until[first] - weight[first]
    steps = (until - start[owner]) * (left / total)[owner] + uniform((len(first),), *key, 1)[owner]
    steps = np.floor(steps)
    drawn = np.diff(steps, prepend=0)
    drawn[first] = steps[first]
    some = np.flatnonzero(drawn)
    rays = rays.take(some)
    drawn = drawn[some] * (total / left)[owner[some]] / weight[some]
    return replace(rays, weight=rays.weight * drawn[:, None])
