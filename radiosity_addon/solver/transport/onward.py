"""Onward: where a ray ends on no patch it is reflected, as a path, until it ends on one.

Nothing is averaged over such a place, so no light leaks there; each ray finds its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..direct.irradiance import direct_light
from ..lights.context import Context
from ..sampling.points import points_on
from ..sampling.sobol import uniform
from .patches import Patches
from .rays import Met, shoot_apart

MOST_BOUNCES = 64  # of one ray; chance ends nearly all long before
STAGE = "transport"


@dataclass(frozen=True)
class Found:
    """Light that k rays found where they went on: ``rays`` (k,) numbers them, ``light`` (k, channels).
    It is ``reflected``, or first-hand."""

    rays: np.ndarray
    light: np.ndarray
    reflected: bool
    weight: None = None


def arrive(
    context: Context, patches: Patches, met: list[Met], key
) -> tuple[list[tuple[Met, np.ndarray]], list[Found]]:
    """What rays ``met`` in the end, each with its entries (k,), and what they found on their way."""
    arrived, found, queue = [], [], met
    for bounce in range(MOST_BOUNCES):
        after = []
        for number, part in enumerate(queue):
            entry = patches.hit(part.hits)
            arrived.append((part, entry))
            some = np.flatnonzero(entry == patches.onward)
            if len(some):
                parts, light = _reflected(context, part, some, (*key, bounce, number))
                after += parts
                found += light
        if not after:
            break
        queue = after
    return arrived, found


def _reflected(context: Context, part: Met, some: np.ndarray, key):
    """Where the rays ``some`` (k,) of a part go on to, and what light they found."""
    hits = part.hits
    triangle, u, v, front = (
        array[some] for array in (hits.triangle, hits.u, hits.v, hits.front)
    )
    rays = some if part.rays is None else part.rays[some]
    weight = np.ones((len(some), context.channels), np.float32)
    if part.weight is not None:
        weight *= part.weight[some]
    uv, found = np.stack([u, v], 1).astype(float), []
    if context.glows:
        light = np.pi * context.emission(triangle, uv, front) * ~context.explicit[triangle][:, None]
        found.append(Found(rays, weight * light, part.reflected))
    weight *= context.reflectance(triangle, uv, front)
    chance = np.minimum(weight.max(axis=1, initial=0), 1)
    kept = np.flatnonzero(uniform((len(some),), *key, 1) < chance)
    if len(kept) == 0:
        return [], found
    rays, weight = rays[kept], weight[kept] / chance[kept, None]
    turn = uniform((len(kept), 3), *key, 2)
    points = points_on(
        context.geometry, *(array[kept][None] for array in (triangle, u, v, front)), turn
    )
    lit, _ = direct_light(
        context, len(kept), 1, lambda chosen, _: points.take(np.arange(len(kept))[chosen]),
        (*key, 3), STAGE,
    )
    found.append(Found(rays, weight * lit, True))
    after, directions = shoot_apart(context, points, 1, *key, 4)
    directions = directions.reshape(-1, 3)
    parts = []
    for later in after:
        index = np.arange(len(kept)) if later.rays is None else later.rays
        share = weight[index] if later.weight is None else weight[index] * later.weight
        parts.append(replace(later, rays=rays[index], weight=share, directions=directions[index]))
    return parts, found
