"""Allocation: how many more points and rays receivers should get, by the errors expected of them.

The mean over the surface should be what is aimed at for the fewest samples, and no place much worse: single
texels that are far off show, though the mean hardly notices them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..filtering.neighborhood import Neighborhood
from ..filtering.smooth import dilate
from ..gather.lighting import Lighting
from .estimate import Estimate

# Share [of the squared error] allowed to direct light; the rest is for gathered light.
DIRECT_SHARE = 0.4
# Errors [of the goal] of explicit and of gathered light, expected at a single place, at most: it has more samples
# where they are larger, though the mean over the surface is good, or it shows as a dash or a stain.
WORST = 0.8, 1.3
LEAST_MORE = 1.25  # factor [samples of a receiver]: it gets none where fewer would do

Lacking = tuple[np.ndarray, np.ndarray]  # numbers of points and of rays, (count,) float64 each


def lacking_in_mean(
    estimate: Estimate, goal: float, light: Lighting, neighborhoods: Sequence[Neighborhood]
) -> Lacking:
    """What receivers lack for a relative error ``goal`` in the mean over the surface.

    With variances v and areas A, the error A v / n summed over receivers is least for a number
    of rays when n is in proportion to sqrt(A v).
    """
    shares = DIRECT_SHARE, 1 - DIRECT_SHARE
    points, rays = (
        _more_in_mean(local, square / (share * goal**2), number, estimate.share)
        for (local, number), square, share in zip(_parts(estimate, light), estimate.squares(), shares)
    )
    # Shadow rays that agree may have missed what shows next to them.
    beside = dilate(neighborhoods, points > 0) & (points == 0)
    points[beside] = light.points[beside, 0]
    return points, rays


def lacking_at_worst(estimate: Estimate, goal: float, light: Lighting) -> Lacking:
    """What they lack for none to be off by more than WORST times the ``goal``, as far as is known; slivers, of
    which little is seen, may be."""
    seen = np.minimum(estimate.share * len(estimate.share), 1)
    points, rays = (
        _beyond(number * seen * np.maximum(local, 0) / (worst * goal) ** 2, number)
        for (local, number), worst in zip(_parts(estimate, light), WORST)
    )
    return points, rays


def _parts(
    estimate: Estimate, light: Lighting
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Of explicit and of gathered light: squared errors (count,) and numbers of samples (count,)."""
    points, rays = light.points[:, 0], light.rays[:, 0]
    return (estimate.direct_square, points), (estimate.gather_square, rays)


def _more_in_mean(
    local: np.ndarray, excess: float, number: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """(count,) samples to add to ``number`` (count,), where the squared error (count,) is
    ``excess`` times what it may be."""
    if excess <= 1:
        return np.zeros(len(number))
    part = np.maximum(share * local, 0).astype(float)
    root = np.sqrt(part * number)
    return _beyond(root * (root.sum() * excess / part.sum()), number)


def _beyond(best: np.ndarray, number: np.ndarray) -> np.ndarray:
    """(count,) what the ``best`` numbers are more than the ``number`` (count,) there is, by more than a little."""
    return np.where(best > LEAST_MORE * number, best - number, 0.0)
