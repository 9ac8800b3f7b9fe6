"""Onward: where a ray ends on no patch it is reflected, as a path, until it ends on one.

Nothing is averaged over such a place, so no light leaks there; each ray finds its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..direct.irradiance import direct_light
from ..lights.context import Context
from ..sampling.points import points_on
from ..sampling.sobol import uniform
from .patches import Patches
from .places import Places, join_places, no_places
from .rays import Met, shoot_apart

MOST_BOUNCES = 64  # of one ray; chance ends nearly all long before
FULL_BOUNCES = 2  # from which on chance ends a ray sooner:
LATE_CHANCE = 0.5  # times the chance to go on; little light is left there, and few rays cost much
STAGE = "transport"


@dataclass(frozen=True)
class Ends:
    """Where k rays ended: their owners (k,) int, the places, ``weight`` (k, channels) of the light
    that comes back to the owner."""

    owner: np.ndarray
    places: Places
    weight: np.ndarray

    def take(self, chosen: np.ndarray) -> Ends:
        """Some of them."""
        return Ends(self.owner[chosen], self.places[chosen], self.weight[chosen])


def ends_of(met: Met, entry: np.ndarray, chosen: np.ndarray, owner: np.ndarray, weight) -> Ends:
    """Of the hits ``chosen`` (k,) of a part with ``entry`` (n,), as ``owner`` (k,) has them;
    ``weight`` (k, channels) beside what came through surfaces."""
    if met.weight is not None:
        weight = weight * met.weight[chosen]
    hits = met.hits
    places = Places(entry[chosen], hits.triangle[chosen], hits.u[chosen], hits.v[chosen],
                    hits.front[chosen])  # fmt: skip
    return Ends(owner, places, weight)


def join_ends(parts: list[Ends], channels: int) -> Ends:
    """All of all parts."""
    if not parts:
        return Ends(np.zeros(0, np.int64), no_places(), np.zeros((0, channels)))
    owner, weight = (np.concatenate([getattr(p, name) for p in parts]) for name in ("owner", "weight"))
    return Ends(owner, join_places([part.places for part in parts]), weight)


@dataclass(frozen=True)
class Onward:
    """What came of rays that went on: their ``ends`` on patches, and what they found on their way,
    (count, channels) by owner: ``light`` that was reflected, and emission ``first``-hand."""

    ends: Ends
    light: np.ndarray
    first: np.ndarray


def go_on(context: Context, patches: Patches, rays: Ends, count: int, key) -> Onward:
    """Follow ``rays`` that ended on no patch; their owners are below ``count``."""
    light, first = np.zeros((2, count, context.channels))
    ended = []
    for bounce in range(MOST_BOUNCES):
        if len(rays.owner) == 0:
            break
        glow = _emission(context, rays.places)
        if glow is not None:
            _add(first if bounce == 0 else light, rays.owner, rays.weight * glow)
        rays = _surviving(context, rays, bounce, (*key, bounce))
        if len(rays.owner) == 0:
            break
        points = points_on(
            context.geometry, *(array[None] for array in rays.places.of_surface()),
            uniform((len(rays.owner), 3), *key, bounce, 2),
        )
        numbers = np.arange(len(rays.owner))
        lit, _ = direct_light(
            context, len(numbers), 1, lambda some, _: points.take(numbers[some]),
            (*key, bounce, 3), STAGE,
        )
        _add(light, rays.owner, rays.weight * lit)
        met, directions = shoot_apart(context, points, 1, *key, bounce, 4)
        parts = []
        for part in met:
            entry = patches.hit(part.hits)
            number = numbers if part.rays is None else part.rays
            parts.append(ends_of(part, entry, np.arange(len(entry)), rays.owner[number],
                                 rays.weight[number]))  # fmt: skip
            missed = np.flatnonzero(entry == patches.miss)
            if context.sky is not None and len(missed):
                sky = context.sky(directions.reshape(-1, 3)[number[missed]])
                _add(light, parts[-1].owner[missed], parts[-1].weight[missed] * sky)
        rays = join_ends(parts, context.channels)
        ended.append(rays.take(np.flatnonzero(patches.somewhere(rays.places.entry))))
        rays = rays.take(np.flatnonzero(rays.places.entry == patches.onward))
    return Onward(join_ends(ended, context.channels), light, first)


def _emission(context: Context, places: Places) -> np.ndarray | None:
    """(k, channels) exitance that rays must find at places; None where nothing has any."""
    if not context.glows:
        return None
    triangle, u, v, front = places.of_surface()
    glow = np.pi * context.emission(triangle, np.stack([u, v], 1).astype(float), front)
    return glow * ~context.explicit[triangle][:, None]


def _surviving(context: Context, rays: Ends, bounce: int, key) -> Ends:
    """Reflected rays; chance ends some (Russian roulette)."""
    triangle, u, v, front = rays.places.of_surface()
    weight = rays.weight * context.reflectance(
        triangle, np.stack([u, v], 1).astype(float), front
    )
    largest = np.maximum(rays.weight.max(axis=1, initial=0), 1e-30)
    chance = np.minimum(weight.max(axis=1, initial=0) / largest, 1)
    chance = chance * (LATE_CHANCE if bounce >= FULL_BOUNCES else 1.0)
    kept = np.flatnonzero(uniform((len(chance),), *key, 1) < chance)
    rays = rays.take(kept)
    return Ends(rays.owner, rays.places, weight[kept] / chance[kept, None])


def _add(sums: np.ndarray, owner: np.ndarray, light: np.ndarray) -> None:
    """Add light (k, channels) to sums (count, channels) of owners (k,)."""
    for channel in range(sums.shape[1]):
        sums[:, channel] += np.bincount(owner, light[:, channel], len(sums))
