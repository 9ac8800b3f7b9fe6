"""The relative error: local, in the mean square over the surface (docs/theory.md, section 8).

A place is judged against its own brightness, or a quarter of the mean over the surface where it is
darker than that: two stops below the mean, which the eye still sees.
"""

from __future__ import annotations

import numpy as np

FLOOR = 0.25  # brightness [of the mean]: darker places are judged against it
MOST = 0.95  # share [of the surface] that ``error_95`` holds for


def area_shares(area: np.ndarray) -> np.ndarray:
    """(n,) float64 >= 0 that add up to 1, of areas (n,) in any unit; equal where none has any."""
    largest = area.max(initial=0.0)
    share = area / largest if largest > 0 else np.ones(len(area))
    return share / (share.sum() or 1.0)


def mean_over(share: np.ndarray, values: np.ndarray) -> float:
    """The mean over the surface, and over channels, of values (n,) or (n, c) of any precision;
    ``share`` (n,): of the surface. In float64."""
    values = values.reshape(len(share), -1)
    return float((share[:, None] * values).sum(axis=0).mean()) if values.size else 0.0


def scale_of(
    radiance: np.ndarray, share: np.ndarray, brightness: float | None = None
) -> np.ndarray:
    """(n, 1) what errors of radiances (n, c) are judged against, above 0: max(L, L̄/4), L the mean
    over channels and L̄ its mean over the surface, or the ``brightness`` of all of it where these
    are a part."""
    channels = radiance.shape[1]
    scale = radiance @ np.full((channels, 1), 1 / channels, radiance.dtype)
    if brightness is None:
        brightness = mean_over(share, scale)
    scale = np.maximum(scale, scale.dtype.type(FLOOR * brightness))
    return np.where(scale > 0, scale, scale.dtype.type(1))


def bound_of_most(share: np.ndarray, errors: np.ndarray) -> float:
    """The bound below which the errors (n, c) of 95 % of the surface stay, in every channel: the
    quantile of their sizes by ``share`` (n,) of the surface."""
    return float(bounds_of(share, errors, np.array([MOST]))[0])


def bounds_of(share: np.ndarray, errors: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """(k,) bounds below which the errors (n, c) of ``parts`` (k,) of the surface stay, in every
    channel: quantiles of their sizes by ``share`` (n,) of the surface."""
    if not len(errors):
        return np.zeros(len(parts))
    largest = np.abs(errors).max(axis=1)
    order = np.argsort(largest, kind="stable")
    reached = np.cumsum(share[order])
    return largest[order[np.minimum(np.searchsorted(reached, parts), len(order) - 1)]]
