"""Estimate: light at receivers, its error, and how much of the surface is how far off."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..geometry.vectors import row_squares
from .relative_error import area_shares, mean_over

# Factor [of the squared noise that the replicates' difference shows]: what it does not show, measured.
# Smoothing that trades bias for noise as well as it can leaves a squared bias of half the squared noise
# (h² against 1/h in two dimensions), and replicates come out more alike than they are, as levels are
# chosen by the same numbers (docs/theory.md).
BALANCE = 1.2
# Factor [of half of what the replicates' means over wide neighborhoods differ by]: the bias of their elements
# that their mean has. The bias falls as elements' area, of which one replicate has 1.35/0.6 = 2.25 times
# the other's: biases of 2.25 b and b have the mean 1.625 b and half the difference 0.625 b.
ALIKE = 2.6


@dataclass(frozen=True)
class Surface:
    """At receivers, (count, channels): diffuse reflectance, and emission as radiance; and the footprints'
    area (count,), in any unit."""

    diffuse: np.ndarray
    emission: np.ndarray
    area: np.ndarray

    @cached_property
    def share(self) -> np.ndarray:
        """(count,) float64 of the surface; they add up to 1."""
        return area_shares(self.area)


@dataclass(frozen=True)
class Estimate:
    """Irradiances (count, channels) in ``unit``, float32; the estimated relative error, the bound
    within which 95 % of the surface is; and the squared error expected at each receiver."""

    unit: float
    direct: np.ndarray
    indirect: np.ndarray
    error: float
    sampled: float  # the part of it that samples of light have; the rest is known and not corrected
    error_95: float
    bounds: np.ndarray  # (64,) the error stays within these on PARTS of the surface
    brightness: float  # mean radiance over the surface
    share: np.ndarray  # (count,) float64 of the surface; they add up to 1
    direct_square: np.ndarray  # (count,) relative, mean over channels
    gather_square: np.ndarray  # (count,)
    difference: np.ndarray  # (count, channels) relative: half the replicates' difference, as gathered
    uncertainty: tuple[float, float]  # of the squared errors of direct and of gathered light, see ``uncertainty_of``
    common: float = 0.0  # relative: error that wide neighborhoods share, which is that of elements

    def with_common(self, difference: float, share_of_elements: float) -> Estimate:
        """With the error that neighbors share, of half the ``difference`` of the replicates' means over
        wide neighborhoods. As much of that as rays of rows met elements is taken to be of their size:
        then it is alike in both replicates for the most part, and widens the error."""
        common = (1 + (ALIKE - 1) * share_of_elements) * difference
        error = np.sqrt(self.error**2 + common**2 - difference**2)
        return replace(self, error=float(error), common=float(common))

    def allowing_for_chance(self) -> Estimate:
        """With one standard deviation more of the squared error of samples. Rounds end where the estimate is
        small enough, and that of few receivers is so by chance, too."""
        more = np.hypot(*np.multiply(self.squares(), self.uncertainty))
        error, sampled = (float(np.sqrt(each**2 + more)) for each in (self.error, self.sampled))
        return replace(self, error=error, sampled=sampled)

    @property
    def not_sampled(self) -> float:
        """The part of the error that more samples do not lower."""
        return float(np.sqrt(max(self.error**2 - self.sampled**2, 0.0)))

    @property
    def square(self) -> np.ndarray:
        """(count,) the squared relative error expected at each receiver, mean over channels; its
        mean by ``share`` is ``error`` squared, but for colors fitted to the receivers."""
        return self.direct_square + self.gather_square

    def squares(self) -> tuple[float, float]:
        """The parts of the squared error that direct and gathered light have, as they count where
        colors end."""
        direct, gather = (
            max(mean_over(self.share, part), 0.0)
            for part in (self.direct_square, self.gather_square)
        )
        total = direct + gather
        share = self.sampled**2 / total if total > 0 else 1.0
        return share * direct, share * gather


def uncertainty_of(share: np.ndarray, difference: np.ndarray) -> float:
    """By what share of itself the square of a ``difference`` (count, channels) is uncertain, at most √2: that of n
    receivers that are alike by √(2/n), and fewer count where few have most of it. ``share`` (count,): of the surface."""
    part = share * row_squares(difference)
    total = part.sum()
    return float(np.sqrt(2 * (part**2).sum()) / total) if total > 0 else 0.0


@dataclass(frozen=True)
class SmoothedLight:
    """Smoothed replicates (count, k · channels) of k kinds of light; half their difference, summed over the
    kinds (count, channels); what the smoothing's error is more than noise, its square (count,), summed
    over channels; and (count,) whether it smoothed at all. All but the replicates are relative."""

    a: np.ndarray
    b: np.ndarray
    difference: np.ndarray
    bias: np.ndarray
    touched: np.ndarray

    def error(self, share: np.ndarray, factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A sample (count, channels) of the error, and its square (count,), mean over channels.
        ``factor`` (count, 1) takes errors from what they are relative to here to what the caller wants
        them relative to. The replicates' difference shows noise only: bias is assumed to be spread over
        the surface as noise is, and to be at least BALANCE of it where light was smoothed."""
        sample, channels = factor * self.difference, self.difference.shape[1]
        noise, bias = row_squares(sample), factor[:, 0] ** 2 * self.bias
        least = BALANCE * noise * self.touched
        if mean_over(share, bias) < mean_over(share, least):
            bias = least
        square = (noise + bias) / channels
        shown, total = mean_over(share, noise) / channels, mean_over(share, square)
        return sample * np.float32(np.sqrt(total / shown) if shown > 0 else 1.0), square
