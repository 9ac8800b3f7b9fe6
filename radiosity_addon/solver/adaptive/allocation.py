"""Allocation: how many more points and rays receivers should get, by the errors expected of them.

The mean error over the surface is to reach the goal with the fewest samples, and no place is to be much worse:
single texels that are far off can be seen, though they hardly change the mean.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..filtering.neighborhood import Neighborhood
from ..filtering.smooth import dilate, smooth_map
from ..gather.lighting import Lighting, Samples
from ..sampling.guide import Guide
from .estimate import Estimate

# Errors [of the goal] of explicit and of gathered light that are allowed at single places: a place where the expected
# error is larger gets more samples even if the mean over the surface is good, as it would show as a dash or a stain.
# And errors [relative] that nobody sees: a place gets no samples to go below them.
WORST, SEEN = (0.8, 1.3), (0.018, 0.029)
# Difference [relative] of the replicates' gathered light from their mean, and number [rays] of a receiver: where both are
# as large, what its rays read is wrong in one of them.
DISPUTED, ENOUGH_RAYS = 0.5, 32
# Gathered light [of that around] above which a receiver stands out, [of the mean over the surface] that what is around counts as, at least;
# number [rays] up to which a receiver that stands out gets more; share [of all]: where more stand out, it is noise as usual.
OUTSTANDING, DIM, SURE_RAYS, RARE = 1.3, 0.25, 128, 0.02
LEAST_MORE = 1.25  # factor [samples of a receiver]: one that needs fewer than so many times as many gets none
GROWTH = 8  # factor [samples of a receiver so far] by which they grow in one round, at most
# Number [rays] of a large round, and factor [as GROWTH] of it: should elements be too coarse, fewer rays are wasted.
LARGE_ROUND, LARGE_GROWTH = 1.5e7, 3
MAX_SAMPLES = 1 << 14  # number [rays or points of a receiver] in one round, at most

Lacking = tuple[np.ndarray, np.ndarray]  # numbers of points and of rays, (count,) float64 each


def lacking_in_mean(
    estimate: Estimate, goal: float, light: Lighting, neighborhoods: Sequence[Neighborhood]
) -> Lacking:
    """What receivers lack for a relative error ``goal`` in the mean over the surface, of explicit and of gathered
    light together; a point is taken to cost as much as a ray."""
    found, numbers = zip(*_parts(estimate, light))
    squares = [
        _adding_up_to(wanted, np.maximum(estimate.share * local, 0).astype(float))
        for local, wanted in zip(found, estimate.squares())
    ]
    more = _more_in_mean(np.concatenate(squares), goal**2, np.concatenate(numbers))
    points, rays = np.split(more, 2)
    # Shadow rays that agree may have missed what shows next to them.
    beside = dilate(neighborhoods, points > 0) & (points == 0)
    points[beside] = light.points[beside, 0]
    return points, rays


def lacking_at_worst(estimate: Estimate, goal: float, light: Lighting) -> Lacking:
    """Samples that receivers lack for none to have an expected error above WORST times the ``goal``, or above SEEN where
    that is more. Slivers, which are smaller than the mean receiver, may have more."""
    seen = np.minimum(estimate.share * len(estimate.share), 1)
    points, rays = (
        _beyond(number * seen * np.maximum(local, 0) / max(worst * goal, least) ** 2, number)
        for (local, number), worst, least in zip(_parts(estimate, light), WORST, SEEN)
    )
    return points, rays


def disputed_receivers(estimate: Estimate, light: Lighting, settled: np.ndarray) -> np.ndarray:
    """(k,) int: receivers of many rays about whose gathered light the replicates differ, but those that are ``settled`` (count,)
    bool. So it is in a pocket that few rays leave: one of its rows' rays found the way out in one replicate, and
    brought light that was reflected in there until all of the pocket was bright. Receivers that read one another
    correct that by no more than a reflection a round."""
    difference = np.abs(estimate.difference).mean(axis=1)
    return np.flatnonzero(~settled & (difference > DISPUTED) & (light.rays[:, 0] >= ENOUGH_RAYS))


def lacking_where_outstanding(estimate: Estimate, light: Lighting, neighborhoods: Sequence[Neighborhood]) -> np.ndarray:
    """What receivers of fewer than SURE_RAYS rays lack of these (count,) that are much brighter than those around. Where a bright ray was
    met from the same receiver in both replicates, they agree, and nothing else tells: one white texel on a wall."""
    level, rays = estimate.indirect.mean(axis=1), light.rays[:, 0]
    around = np.maximum(smooth_map(neighborhoods, level), DIM * (estimate.share @ level))
    stands_out = (level > OUTSTANDING * around) & (rays < SURE_RAYS)
    return np.where(stands_out & (stands_out.mean() <= RARE), SURE_RAYS - rays, 0)


def bundled(
    lacking: Lacking, light: Lighting, guide: Guide | None, more: np.ndarray, part: float = 1.0
) -> tuple[Samples, Samples]:
    """[(owners, samples of each)] to add to ``light``, of points for direct light and of rays, of which ``more`` (count,)
    come beyond GROWTH; a ``part`` of all of these."""
    points = _bounded(lacking[0], light.points[:, 0], GROWTH)
    large = GROWTH * light.rays.sum() > LARGE_ROUND
    rays = _bounded(lacking[1], light.rays[:, 0], LARGE_GROWTH if large else GROWTH) + more
    if guide is not None:
        rays = rays / guide.worth[guide.cluster]
    return alike_samples(part * points, 4), alike_samples(part * rays, 8)


def total(*rounds: Samples) -> int:
    """Points and rays of rounds of [(owners, samples of each)]."""
    return sum(len(owners) * samples for parts in rounds for owners, samples in parts)


def _bounded(more: np.ndarray, number: np.ndarray, growth: float) -> np.ndarray:
    """(count,) samples to add to ``number`` (count,), to ``growth`` times as many at most."""
    return np.minimum(more, (growth - 1) * number)


def alike_samples(samples: np.ndarray, least: int) -> Samples:
    """[(owners, samples)] of about ``samples`` (count,) for each: powers of two, as Sobol sets
    want."""
    some = np.flatnonzero(samples >= least / 2)
    exponent = np.rint(np.log2(np.clip(samples[some], least, MAX_SAMPLES))).astype(int)
    return [(some[exponent == e], 1 << int(e)) for e in np.unique(exponent)]


def _parts(
    estimate: Estimate, light: Lighting
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Of explicit and of gathered light: squared errors (count,) and numbers of samples (count,)."""
    points, rays = light.points[:, 0], light.rays[:, 0]
    return (estimate.direct_square, points), (estimate.gather_square, rays)


def _adding_up_to(wanted: float, parts: np.ndarray) -> np.ndarray:
    """``parts`` (n,) scaled to the sum ``wanted``; as they are where their sum is 0."""
    total = parts.sum()
    return parts * (wanted / total) if total > 0 else parts


def _more_in_mean(square: np.ndarray, goal: float, number: np.ndarray) -> np.ndarray:
    """(n,) samples to add to ``number`` (n,), so that parts ``square`` (n,) of the squared error, which fall as
    1 / samples, add up to ``goal``.

    With v_i = square_i number_i the sum of v_i / n_i is least, for a sum of the n_i, where each n_i is in proportion
    to √v_i or, where that is fewer, stays as it is. Those that grow first have the largest √v_i / number_i.
    """
    if square.sum() <= goal:
        return np.zeros(len(number))
    root = np.sqrt(square * number)
    slope = root / np.maximum(number, 1)
    order = np.argsort(-slope, kind="stable")
    grown = np.cumsum(root[order])
    left = np.maximum(square.sum() - np.cumsum(square[order]), 0)
    # The k that grow have so many times their roots that all have as many as the next one has now.
    reached = grown * slope[order] + left
    k = min(int(np.searchsorted(-reached, -goal)), len(order)) - 1
    return _beyond(root * (grown[k] / (goal - left[k])), number)


def _beyond(best: np.ndarray, number: np.ndarray) -> np.ndarray:
    """(count,) by how much the ``best`` numbers exceed the ``number`` (count,) there is; 0 where that is little."""
    return np.where(best > LEAST_MORE * number, best - number, 0.0)
