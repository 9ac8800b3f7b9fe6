"""Choose: which lights to sample at which points, where there are many.

Depends on ``sources`` and SciPy's k-d tree. Every point takes a few lights with probability
proportional to the light they would bring without obstacles, so that what is left to chance is
only whether they are seen (Shirley, Wang & Zimmerman 1996, section 4). Among thousands, the
nearest are always candidates and the others by their power.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sources import Sources

FEW = 6  # lights up to here are all sampled at every point
PER_POINT = 3  # lights sampled at a point where there are more
ALL = 128  # lights up to here are all candidates
NEAR = FAR = 32  # candidates among more


@dataclass(frozen=True)
class Choice:
    """For every point one light, and one over the probability with which it was taken."""

    light: np.ndarray  # (n,) int
    factor: np.ndarray  # (n,) float64


def choose_lights(sources: Sources, position, normal, xi: np.ndarray) -> list[Choice]:
    """``PER_POINT`` choices for n points (n, 3); ``xi`` (n, PER_POINT) in [0, 1)."""
    candidate, weight = _candidates(sources, position, xi[:, 0])
    strength = np.zeros(candidate.shape)
    for number, kind in enumerate(sources.kinds):
        row, column = np.nonzero(sources.kind[candidate] == number)
        place = sources.place[candidate[row, column]]
        strength[row, column] = kind.strength(place, position[row], normal[row])
    strength *= weight
    cumulative = np.cumsum(strength, axis=1)
    total = cumulative[:, -1:]
    choices = []
    for k in range(xi.shape[1]):
        level = (xi[:, k : k + 1] * total * (1 - 1e-12))
        column = np.minimum((cumulative <= level).sum(axis=1), candidate.shape[1] - 1)
        rows = np.arange(len(candidate))
        taken = strength[rows, column]
        factor = np.where(taken > 0, total[:, 0] / np.where(taken > 0, taken, 1), 0)
        factor *= weight[rows, column] / xi.shape[1]
        choices.append(Choice(candidate[rows, column], factor))
    return choices


def _candidates(sources: Sources, position: np.ndarray, xi: np.ndarray):
    """(n, c) lights for each point, and (n, c) one over the chance that each was a candidate."""
    n = len(position)
    if sources.count <= ALL:
        every = np.broadcast_to(np.arange(sources.count), (n, sources.count))
        return every, np.ones(every.shape)
    from scipy.spatial import cKDTree

    center = np.concatenate([kind.middle()[0] for kind in sources.kinds])
    power = np.concatenate([_power(kind) for kind in sources.kinds])
    near = cKDTree(center).query(position, NEAR)[1]
    cumulative = np.cumsum(power) / power.sum()
    level = (np.arange(FAR) + xi[:, None]) / FAR
    far = np.minimum(np.searchsorted(cumulative, level), sources.count - 1)
    weight = power.sum() / (FAR * power[far])
    for column in range(NEAR):
        weight[far == near[:, column : column + 1]] = 0
    return np.concatenate([near, far], axis=1), np.concatenate([np.ones(near.shape), weight], axis=1)


def _power(kind) -> np.ndarray:
    """(k,) relative power, by which far lights become candidates."""
    size = getattr(kind, "area", None)
    return kind.color.mean(axis=1) * (1.0 if size is None else size)
