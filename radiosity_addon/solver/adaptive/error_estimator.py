"""Error estimator: from two independent replicates to a result, its error, what to add.

The error is the local relative RMS error of ``relative_error``, over the surface: a receiver counts
by the area of its footprint, a colour by that of the faces it is fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..filtering.neighborhood import Neighborhood, Sees
from ..filtering.smooth import dilate, smooth, smooth_map, widest
from ..gather.lighting import Lighting
from ..geometry.vectors import row_squares
from ..passes import Pass
from ..receivers import Projection
from ..sampling.sobol import uniform
from ..workers.parallel import map_chunks
from .relative_error import MOST, area_shares, bounds_of, level_of, mean_over

# Smoothing that trades bias for noise as well as it can leaves a squared bias of half the squared
# noise (h² against 1/h in two dimensions), and halves that come out more alike than they are, as
# levels are chosen by the same numbers: measured, what their difference does not show is one and a
# half times what it does (docs/theory.md).
BALANCE = 1.5
DOUBTFUL = 4.0  # ratio of the halves' brightness above which one of them may be all wrong
LEAST = 1e-20  # of the brightest emission: a typical irradiance is taken to be that much at least
SIGN_DRAWS = 4  # draws of signs that tell what neighborhoods share from noise
LEAST_MORE = 1.25  # times the samples of a receiver: it gets none if fewer would do
DIRECT_SHARE = 0.4  # of the squared error that is allowed; the rest is for gathered light
PARTS = (np.arange(64) + 0.5) / 64  # of the surface, whose bounds are told


@dataclass(frozen=True)
class Surface:
    """At receivers, (count, channels): reflectance, and emission as radiance; and the footprints'
    area (count,), in any unit."""

    reflectance: np.ndarray
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
    apart: np.ndarray  # (count, channels) relative: half the halves' difference, as gathered

    @property
    def square(self) -> np.ndarray:
        """(count,) the squared relative error expected at each receiver, mean over channels; its
        mean by ``share`` is ``error`` squared, but for colours fitted to the receivers."""
        return self.direct_square + self.gather_square

    def squares(self) -> tuple[float, float]:
        """The parts of the squared error that direct and gathered light have, as they count where
        colours end."""
        direct, gather = (
            max(mean_over(self.share, part), 0.0)
            for part in (self.direct_square, self.gather_square)
        )
        total = direct + gather
        share = self.sampled**2 / total if total > 0 else 1.0
        return share * direct, share * gather


@dataclass(frozen=True)
class _Part:
    """Smoothed halves (count, k · channels) of k kinds of light; half their difference, summed over the
    kinds (count, channels); what the smoothing's error is more than noise, its square (count,), summed
    over channels; and (count,) whether it smoothed at all. All but the halves are relative."""

    a: np.ndarray
    b: np.ndarray
    apart: np.ndarray
    bias: np.ndarray
    touched: np.ndarray

    def error(self, share: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A sample (count, channels) of the error, and its square (count,), mean over channels, relative
        to what ``level`` (count, 1) times it was. What the halves' difference does not show is taken
        to be spread over the surface as what it does, and to be no less."""
        sample, channels = level * self.apart, self.apart.shape[1]
        noise, bias = row_squares(sample), level[:, 0] ** 2 * self.bias
        least = BALANCE * noise * self.touched
        if mean_over(share, bias) < mean_over(share, least):
            bias = least
        square = (noise + bias) / channels
        shown, whole = mean_over(share, noise) / channels, mean_over(share, square)
        return sample * np.float32(np.sqrt(whole / shown) if shown > 0 else 1.0), square


@dataclass(frozen=True)
class ErrorEstimator:
    """What the error is measured on. ``project``: see ``sequence.solve``."""

    surface: Surface
    lattices: Sequence[Neighborhood]
    passes: tuple[str, ...]
    threads: int
    sees: Sees  # whether one receiver sees all of the other
    project: Projection | None = None
    brightness: float | None = None  # mean radiance of all, where these are a part; None: all

    def weigh(
        self, halves: list[Lighting], left: Sequence[np.ndarray | None] = (None, None)
    ) -> Estimate:
        """Combine the halves. ``left`` are the squared relative biases (count,) that each half
        knows of and could not correct; None: of none."""
        unit = self._typical(halves)
        (direct_a, bounced_a, first_a), (direct_b, bounced_b, first_b) = (
            half.means(unit) for half in halves
        )
        channels = direct_a.shape[1]
        direct, indirect = direct_a + direct_b + first_a + first_b, bounced_a + bounced_b
        rough = self._radiance(direct / 2, indirect / 2, unit)
        brightness = None if self.brightness is None else self.brightness / unit
        level = level_of(rough, self.surface.share, brightness)
        weight = self._gain / level  # from irradiance to relative error
        lit, bounced = (weight * np.float32(name in self.passes) for name in (Pass.DIRECT, Pass.INDIRECT))
        lattices = self._neighbors(direct, indirect)
        gathered = [np.hstack(half) for half in ((first_a, bounced_a), (first_b, bounced_b))]
        shadows, gathered = map_chunks(
            lambda part: self._smoothed(lattices, *part),
            [(direct_a, direct_b, lit), (*gathered, np.hstack([lit, bounced]))],
            self.threads,
            lambda fraction: None,
        )
        light = [
            (shadow + half[:, :channels], half[:, channels:])
            for shadow, half in ((shadows.a, gathered.a), (shadows.b, gathered.b))
        ]
        (one_direct, one_indirect), (two_direct, two_indirect) = light
        level /= self._level([self._radiance(*half, unit) for half in light], brightness)
        share = self.surface.share
        samples, found = zip(*(part.error(share, level) for part in (shadows, gathered)))
        shadow_square, gather_square = map_chunks(
            lambda square: self._pooled(lattices, square), found, self.threads,
            lambda fraction: None,
        )  # fmt: skip
        if self.project is None:
            square = mean_over(share, shadow_square) + mean_over(share, gather_square)
            sample = sum(samples)
        else:
            share, sample = self._projected([self._radiance(*half, unit) for half in light])
            square = mean_over(share, sample**2)
        error_95, *bounds = bounds_of(share, sample, np.append(MOST, PARTS))
        lacking = sum(mean_over(self.surface.share, each) for each in left if each is not None)
        sampled, square = square, square + lacking / len(left)
        return Estimate(
            unit=unit,
            direct=(one_direct + two_direct) / 2,
            indirect=(one_indirect + two_indirect) / 2,
            error=float(np.sqrt(max(square, 0.0))),
            sampled=float(np.sqrt(max(sampled, 0.0))),
            error_95=float(error_95),
            bounds=np.array(bounds),
            brightness=unit * mean_over(self.surface.share, rough),
            share=self.surface.share,
            direct_square=shadow_square,
            gather_square=gather_square,
            apart=bounced * (bounced_a - bounced_b) / 2,
        )

    def lacking(self, estimate: Estimate, goal: float, light: Lighting):
        """How many points and rays receivers lack for a relative error ``goal``: (count,) float64
        each.

        With variances v and areas A, the error A v / n summed over receivers is least for a number
        of rays when n is in proportion to sqrt(A v).
        """
        points, rays = (
            self._more(local, square / (share * goal**2), number[:, 0], estimate.share)
            for local, square, share, number in zip(
                (estimate.direct_square, estimate.gather_square),
                estimate.squares(),
                (DIRECT_SHARE, 1 - DIRECT_SHARE),
                (light.points, light.rays),
            )
        )
        # Shadow rays that agree may have missed what shows next to them.
        beside = dilate(self.lattices, points > 0) & (points == 0)
        points[beside] = light.points[beside, 0]
        return points, rays

    @staticmethod
    def _more(
        local: np.ndarray, excess: float, number: np.ndarray, share: np.ndarray
    ) -> np.ndarray:
        """(count,) samples to add to ``number`` (count,), where the squared error (count,) is
        ``excess`` times what it may be."""
        if excess <= 1:
            return np.zeros(len(number))
        part = np.maximum(share * local, 0).astype(float)
        root = np.sqrt(part * number)
        best = root * (root.sum() * excess / part.sum())
        return np.where(best > LEAST_MORE * number, best - number, 0.0)

    def _neighbors(self, *light: np.ndarray) -> Sequence[Neighborhood]:
        """Who is whose neighbour, given all light (count, c) so far: what is dark, as a sealed room
        beside the sun, stays so behind a wall."""
        dark = np.ones(len(light[0]), bool)
        for part, channel in product(light, range(light[0].shape[1])):
            dark &= part[:, channel] == 0
        if dark.all() or not dark.any():
            return self.lattices
        return [lattice.parted(dark, self.sees) for lattice in self.lattices]

    def common(self, estimate: Estimate) -> float:
        """Relative error that wide neighbourhoods share: that of the elements.

        Averaged widely, the halves' differences have lost nearly all of each receiver's own noise.
        What it leaves is measured by giving every difference a sign at random, several times: where
        one of these leaves as much, nothing is shared (a sign test); else their mean is taken off.
        """
        apart = estimate.apart
        shared, *own = (
            mean_over(estimate.share, widest(self.lattices, signs * apart) ** 2)
            for signs in (np.float32(1), *(_signs(len(apart), draw) for draw in range(SIGN_DRAWS)))
        )
        return float(np.sqrt(max(shared - 2 * np.mean(own), 0.0))) if shared > max(own) else 0.0

    def _smoothed(
        self, lattices: Sequence[Neighborhood], a: np.ndarray, b: np.ndarray, weight: np.ndarray
    ) -> _Part:
        """Halves (count, k · channels) of k parts smoothed alike. ``weight`` (count, k · channels):
        from light to relative error."""
        smoothed = smooth(lattices, a, b, weight, self.threads)
        apart = weight * (smoothed.a - smoothed.b) / 2
        bias = smoothed.square - 2 * row_squares(apart)  # error less noise
        channels = self.surface.reflectance.shape[1]
        both = sum(apart[:, k : k + channels] for k in range(0, apart.shape[1], channels))
        return _Part(smoothed.a, smoothed.b, both, bias, smoothed.touched)  # parts share rays

    def _pooled(self, lattices: Sequence[Neighborhood], square: np.ndarray) -> np.ndarray:
        """(count,) squared errors averaged with those around, by area, as two halves of one
        receiver may agree by chance; their mean over the surface stays."""
        share = self.surface.share
        area = (share * len(share)).astype(np.float32)
        around = smooth_map(lattices, area)
        pooled = smooth_map(lattices, area * square) / np.where(around > 0, around, 1)
        found, mean = mean_over(share, pooled), mean_over(share, square)
        return pooled * (mean / found) if found > 0 and mean > 0 else square

    def _level(self, halves: list[np.ndarray], brightness: float | None) -> np.ndarray:
        """(count, 1) what errors are judged against, from smoothed radiances (count, channels): noise
        of the light before smoothing is none of it. Where the halves are far apart they are judged
        against either alone: a ray that brings much too much to one of them raises their mean's
        brightness, too, but not the other's."""
        share = self.surface.share
        level = level_of((halves[0] + halves[1]) / 2, share, brightness)
        one, other = (level_of(half, share, brightness) for half in halves)
        doubtful = np.maximum(one, other) > DOUBTFUL * np.minimum(one, other)
        least = np.minimum(one, other)  # the sum of inverse squares, without what overflows
        either = least * np.sqrt(2 / (1 + (least / np.maximum(one, other)) ** 2))
        return np.where(doubtful, either, level)

    @cached_property
    def _gain(self) -> np.ndarray:
        """(count, channels) float32 radiance per irradiance."""
        color = self.surface.reflectance
        color = color if Pass.COLOR in self.passes else np.ones_like(color)
        return (color / np.pi).astype(np.float32)

    def _radiance(self, direct: np.ndarray, indirect: np.ndarray, unit: float) -> np.ndarray:
        """(count, channels) float32 what is baked, in ``unit``."""
        light = direct * np.float32(Pass.DIRECT in self.passes)
        light += indirect * np.float32(Pass.INDIRECT in self.passes)
        light *= self._gain
        if Pass.EMIT in self.passes and self.surface.emission.any():
            light += (self.surface.emission / unit).astype(np.float32)
        return light

    def _typical(self, halves: list[Lighting]) -> float:
        """An irradiance such as there is, above 0, by which all is divided: it makes float32 do."""
        irradiance = float(np.mean([half.typical() for half in halves]))
        least = LEAST * float(self.surface.emission.max(initial=0))
        return max(irradiance, least) or 1.0

    def _projected(self, halves: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Where colours end: shares (m,) of the surface, and a sample (m, channels) of the relative
        error of the halves' mean."""
        a, b = (half.astype(float) for half in halves)
        share = area_shares(self.project.area)
        level = level_of(self.project.apply((a + b) / 2), share)
        return share, self.project.apply(a - b) / (2 * level)


def _signs(count: int, draw: int) -> np.ndarray:
    """(count, 1) float32 of 1 and -1, at random."""
    heads = uniform((count,), count, draw) < 0.5
    return np.where(heads, np.float32(-1), np.float32(1))[:, None]
