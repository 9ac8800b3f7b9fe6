"""Light sampler: which lights to sample at which points, where there are many.

Every point takes a few lights with probability proportional to the light they would bring its
receiver without obstacles, so that what is left to chance is only whether they are seen (Shirley,
Wang & Zimmerman 1996, section 4). Among thousands, a tree leads to a handful. Distant lights are
chosen apart from near ones: no distance compares them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..geometry.vectors import columns
from ..workers.parallel import ranges
from .light_tree import Emitters, LightTree, build_tree, sample_discrete

FEW = 6  # number [lights] up to which all are sampled at every point
PER_POINT = 3  # number [lights] sampled at each point where there are more than FEW
ALL = 64  # number [lights] up to which there is no tree: each place weighs all
TOP = 64  # number [nodes] of the tree's first level, all of which each place weighs
CHOICES = 1 << 12  # number [choices of a light from blocks] at a time: their arrays stay in the cache
BLOCK = 8  # number [lights] of a block, which each last node of the tree has


class Importance(Protocol):
    """See ``Sources.importance``."""

    def __call__(
        self, light: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray, /
    ) -> np.ndarray: ...


@dataclass(frozen=True)
class LightSampler:
    """Lights to choose from. ``blocks`` (m, size) their numbers, filled up with −1; ``tree`` leads
    to one of several blocks; ``shading`` is the row of blockers that shade all of them."""

    blocks: np.ndarray
    tree: LightTree | None
    shading: int = 0


def make_light_sampler(lights: np.ndarray, emitters: Emitters, shading: int = 0) -> LightSampler:
    """A sampler of ``lights`` (n,) int, which shine as ``emitters``."""
    if len(lights) <= ALL:
        return LightSampler(lights[None], None, shading)
    tree = build_tree(emitters, TOP, BLOCK)
    return LightSampler(np.where(tree.blocks >= 0, lights[tree.blocks], -1), tree, shading)


def sample_lights(
    importance_of: Importance, sampler: LightSampler, position: np.ndarray, normal: np.ndarray,
    extent: np.ndarray, xi: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Lights (k, n) of a sampler for n places (n, 3), each of points within ``extent`` (n,) of it that face as
    ``normal`` (n, 3) says, one for each of the numbers ``xi`` (k, n) in [0, 1); and one over the probability
    with which each was taken (k, n)."""
    narrow = [columns(array).astype(np.float32) for array in (position, normal)]
    narrow.append(extent.astype(np.float32))
    if sampler.tree is None:
        members = sampler.blocks[0]
        which, share, _ = sample_discrete(importance_of(members[:, None], *narrow), xi)
        return _taken(members[which], share)
    block, before, rest = sampler.tree.descend(position, normal, extent, xi)
    light, share = np.empty_like(block), np.empty_like(before)
    step = max(1, CHOICES // max(len(position), 1))
    for some in ranges(len(xi), step):
        members = np.moveaxis(sampler.blocks[block[some]], -1, 0)
        which, share[some], _ = sample_discrete(importance_of(members, *narrow), rest[some])
        light[some] = np.take_along_axis(members, which[None], axis=0)[0]
    return _taken(light, share * before)


def _taken(light: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lights (k, n) and one over the probability ``share`` (k, n) of each, 0 where it is 0."""
    return np.maximum(light, 0), np.where(share > 0, 1 / np.where(share > 0, share, 1), 0)
