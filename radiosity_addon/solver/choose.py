"""Choose: which lights to sample at which points, where there are many.

Depends on ``light_tree``. Every point takes a few lights with probability proportional to the
light they would bring without obstacles, so that what is left to chance is only whether they are
seen (Shirley, Wang & Zimmerman 1996, section 4). Among thousands, a tree leads to a handful.
Distant lights are chosen apart from near ones: no distance compares them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .light_tree import Emitters, LightTree, build_tree, pick

FEW = 6  # lights up to here are all sampled at every point
PER_POINT = 3  # lights sampled at a point where there are more
ALL = 16  # lights up to here are all compared at every point
TOP = 64  # nodes of the tree that are all compared at every point, where there are more
BLOCK = 8  # lights that are compared where a way down the tree ends


@dataclass(frozen=True)
class Choice:
    """For every point one light, and one over the probability with which it was taken; or one
    light (an int) for all points, with factor None."""

    light: np.ndarray | int  # (n,) int
    factor: np.ndarray | None  # (n,) float64


@dataclass(frozen=True)
class Pool:
    """Lights to choose from. ``blocks`` (m, size) their numbers, filled up with −1; ``tree`` leads
    to one of several blocks."""

    blocks: np.ndarray
    tree: LightTree | None


def make_pool(lights: np.ndarray, emitters: Emitters) -> Pool:
    """A pool of ``lights`` (n,) int, which shine as ``emitters``."""
    if len(lights) <= ALL:
        return Pool(lights[None], None)
    tree = build_tree(emitters, TOP, BLOCK)
    return Pool(np.where(tree.blocks >= 0, lights[tree.blocks], -1), tree)


def choose_lights(sources, pool: Pool, position, normal, xi: np.ndarray) -> list[Choice]:
    """Choices of a pool of ``sources`` for n points (n, 3): one for every column of ``xi``
    (n, k) in [0, 1)."""
    n, k = xi.shape
    if pool.tree is None:
        strength = _strengths(sources, np.broadcast_to(pool.blocks, (n, pool.blocks.shape[1])),
                              position, normal)  # fmt: skip
    else:
        block, chance, xi = pool.tree.descend(position, normal, xi)
    choices = []
    for i in range(k):
        before, members = 1.0, pool.blocks
        if pool.tree is not None:
            before, members = chance[:, i], pool.blocks[block[:, i]]
            strength = _strengths(sources, members, position, normal)
        column, share, _ = pick(strength, xi[:, i])
        share = share * before
        light = np.broadcast_to(members, strength.shape)[np.arange(n), column]
        factor = np.where(share > 0, 1 / np.where(share > 0, share, 1), 0) / k
        choices.append(Choice(np.maximum(light, 0), factor))
    return choices


def _strengths(sources, light: np.ndarray, position, normal) -> np.ndarray:
    """(n, c) rough irradiance of lights (n, c) at points (n, 3); 0 where a light is −1."""
    kinds = np.where(light >= 0, sources.kind[light], -1)
    alone = np.unique(kinds[kinds >= 0]) if len(sources.kinds) > 1 else np.zeros(1, int)
    if len(alone) == 1:
        kind = sources.kinds[alone[0]]
        found = kind.strength(sources.place[light], position[:, None], normal[:, None])
        return np.where(light >= 0, found, 0.0)
    strength = np.zeros(light.shape)
    for number, kind in enumerate(sources.kinds):
        row, column = np.nonzero(kinds == number)
        place = sources.place[light[row, column]]
        strength[row, column] = kind.strength(place, position[row], normal[row])
    return strength
