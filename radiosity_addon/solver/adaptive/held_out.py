"""Held-out light: some receivers are lit once more, to find the error that both replicates have in common.

Replicates come out more alike than they are: the kernels of smoothing are chosen by what brings them together, and
receivers that agree by chance get no more samples. Neither was chosen by samples that are held out. With their light h_a,
h_b and that of the replicates a, b, E[(a − h_a)(b − h_b)] is the covariance of the errors of a and b: what half of their
difference lacks of the error of their mean (cross-validation; Stone 1974, "Cross-validatory choice and assessment of
statistical predictions"). What the radiosities are off by is in a and in h_a alike: it counts in the difference alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..direct.beams import Split
from ..filtering.graph import LEAST
from ..gather.lighting import Aim, Lighting, Samples, add_direct, add_gathered, no_light
from ..geometry.footprints import Footprints
from ..transport.radiosity import Radiosity
from .allocation import alike_samples
from .relative_error import mean_over

SHARE, MOST = 1 / 8, 4096  # share and number [of receivers] that are held out, at most
SAMPLES = 1.5  # factor [samples that such a receiver has]: its held-out samples
LEAST_MORE = 4  # number [samples of a receiver]: fewer are not added
STEP_OFFSET = 1 << 16  # offset [of a word of a random key]: the keys of held-out samples have it, plus the round


@dataclass(frozen=True)
class HeldOut:
    """Receivers ``chosen`` (k,) int, and the points and rays that these numbers from 0 to k - 1 get in addition."""

    chosen: np.ndarray
    points: Samples
    rays: Samples


@dataclass
class HeldOutLight:
    """Of a replicate: ``light`` at the receivers ``chosen`` (k,) int, whose ``footprints`` these are."""

    chosen: np.ndarray
    footprints: Footprints
    light: Lighting

    def add(self, split: Split, radiosity: Radiosity, more: HeldOut, *key: int) -> Radiosity:
        """Add samples, and return the radiosity with that of all that the rays met. ``key``: of the round and replicate."""
        key = (STEP_OFFSET + key[0], *key[1:])
        for part in more.points:
            add_direct(split, self.footprints, self.light, *part, *key)
        radiosity, _ = add_gathered(split, self.footprints, self.light, radiosity, more.rays, *key, aim=Aim())
        return radiosity

    def forget_gathered(self, receivers: np.ndarray) -> None:
        """See ``Lighting.forget_gathered``; ``receivers`` (n,) int are numbers among all."""
        self.light.forget_gathered(np.flatnonzero(np.isin(self.chosen, receivers)))

    def corrected(self, light: Lighting) -> Lighting:
        """With the correction that ``light`` of all receivers has here, in proportion to what is bounced."""
        theirs, rays = light.bounced[self.chosen], light.rays[self.chosen]
        share = np.divide(light.correction[self.chosen] * rays, theirs, out=np.zeros_like(theirs), where=theirs > 0)
        mean = self.light.bounced / np.maximum(self.light.rays, 1)
        return replace(self.light, correction=(share * mean).astype(np.float32))


def no_held_out_light(footprints: Footprints, chosen: np.ndarray, channels: int) -> HeldOutLight:
    """Nothing of the ``chosen`` (k,) int yet."""
    return HeldOutLight(chosen, footprints.take(chosen), no_light(len(chosen), channels))


def held_out_receivers(share: np.ndarray) -> np.ndarray | None:
    """(k,) int: some of the receivers, at equal steps of their ``share`` (count,) of the surface; None where they are few."""
    if len(share) < LEAST:  # they are not smoothed either
        return None
    count = int(min(SHARE * len(share), MOST))
    places = (np.arange(count) + 0.5) / count
    return np.unique(np.minimum(np.searchsorted(np.cumsum(share), places), len(share) - 1))


def lacking_held_out(chosen: np.ndarray, light: Lighting, held: Lighting | None) -> HeldOut:
    """What the ``chosen`` (k,) int lack of SAMPLES, where they have ``light`` (of all receivers), and ``held`` so far."""
    points, rays = SAMPLES * light.points[chosen, 0], SAMPLES * light.rays[chosen, 0]
    if held is not None:
        points, rays = points - held.points[:, 0], rays - held.rays[:, 0]
    return HeldOut(chosen, alike_samples(points, LEAST_MORE), alike_samples(rays, LEAST_MORE))


def common_square(
    replicates: list[np.ndarray], held: list[np.ndarray], share: np.ndarray, scale: np.ndarray
) -> float:
    """The covariance of the relative errors of two ``replicates`` (k, channels), by their ``held`` out light (k, channels), a
    mean by ``share`` (k,) of the surface, and one standard deviation of that mean more: where few receivers have most of it, it is
    too small more often than not. At least 0. ``scale`` (k, 1): what errors are relative to."""
    one, two = ((a - h) / scale for a, h in zip(replicates, held))
    product, share = (one * two).mean(axis=1), share / share.sum()
    mean = share @ product
    return float(max(mean + np.sqrt(share**2 @ (product - mean) ** 2), 0.0))


def with_common(
    squares: tuple[np.ndarray, np.ndarray], share: np.ndarray, light: Lighting, factor: float
) -> tuple[np.ndarray, np.ndarray]:
    """Squared errors (count,) of explicit and of gathered ``light``, with what both replicates have in common, so that
    their means by ``share`` (count,) grow by the square of ``factor``: as much for each sample, as nothing tells where
    it is. Receivers that agree by chance get more samples for it."""
    if factor == 1:
        return squares
    result = []
    for square, number in zip(squares, (light.points[:, 0], light.rays[:, 0])):
        each = 1 / np.maximum(number, 1)
        more = (factor**2 - 1) * mean_over(share, square) / mean_over(share, each)
        result.append(square + more * each)
    return tuple(result)
