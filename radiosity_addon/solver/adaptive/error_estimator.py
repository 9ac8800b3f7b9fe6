"""Error estimator: from two independent replicates to a result and its error.

The error is the local relative RMS error of ``relative_error``, over the surface: a receiver counts
by the area of its footprint, a color by that of the faces it is fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..filtering.neighborhood import Neighborhood, Sees
from ..filtering.smooth import smooth, smooth_map, widest
from ..gather.lighting import Lighting
from ..geometry.vectors import row_squares
from ..passes import Pass
from ..receivers import Projection
from ..sampling.sobol import uniform
from ..sampling.streams import Stream
from ..workers.parallel import map_chunks
from .estimate import Estimate, SmoothedLight, Surface, uncertainty_of
from .held_out import common_square, with_common
from .relative_error import MOST, area_shares, bounds_of, mean_over, scale_of

DOUBTFUL = 4.0  # ratio [of the replicates' brightness at a place]: above it, one of them may be all wrong
LEAST = 1e-20  # irradiance [of the brightest emission] that is taken as typical, at least
SIGN_DRAWS = 4  # number [draws of signs] by which noise is told from what neighborhoods have in common
# Factor [error that is enough]: rough colors may overstate the error so much, as where dark faces meet bright ones.
OVERSTATED = 2.0
PARTS = (np.arange(64) + 0.5) / 64  # shares [of the surface] whose bounds of the error are reported

Means = tuple[np.ndarray, np.ndarray, np.ndarray]  # see ``Lighting.means``


def _of_passes(shadows: SmoothedLight, gathered: SmoothedLight) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each replicate the direct light, what is gathered first-hand among it, and the indirect light."""
    channels = shadows.a.shape[1]
    return [
        (shadow + both[:, :channels], both[:, channels:])
        for shadow, both in ((shadows.a, gathered.a), (shadows.b, gathered.b))
    ]


@dataclass(frozen=True)
class ErrorEstimator:
    """The surface and settings by which light and its error are estimated. ``project``: see ``sequence.solve``."""

    surface: Surface
    neighborhoods: Sequence[Neighborhood]
    passes: tuple[Pass, ...]
    threads: int
    sees: Sees  # whether one receiver sees all of the other
    project: Projection | None = None
    brightness: float | None = None  # mean radiance of all, where these are a part; None: all
    held_out: np.ndarray | None = None  # (k,) int: receivers of which light is held out
    enough: float = np.inf  # relative error: below it colors are judged as they will be shown

    def weigh(
        self, replicates: list[Lighting], uncorrected: Sequence[np.ndarray | None] = (None, None),
        held_out: list[Lighting] | None = None,
    ) -> Estimate:
        """Combine the replicates. ``uncorrected`` are the squared relative biases (count,) that each replicate
        knows of and could not correct; None: of none."""
        unit = self._typical(replicates)
        one, two = (replicate.means(unit) for replicate in replicates)
        direct, indirect, first = (a + b for a, b in zip(one, two))
        direct += first
        rough = self._radiance(direct / 2, indirect / 2, unit)
        brightness = None if self.brightness is None else self.brightness / unit
        scale = scale_of(rough, self.surface.share, brightness)
        weight = self._gain / scale  # from irradiance to relative error
        weights = [weight * np.float32(name in self.passes) for name in (Pass.DIRECT, Pass.INDIRECT)]
        neighborhoods = self._neighbors(direct, indirect)
        parts = self._smoothed_parts(neighborhoods, one, two, weights)
        light = _of_passes(*parts)
        radiance = [self._radiance(*replicate, unit) for replicate in light]
        scale /= self._scale(radiance, brightness)
        samples, found = zip(*(part.error(self.surface.share, scale) for part in parts))
        squares = tuple(map_chunks(lambda square: self._pooled(neighborhoods, square), found, self.threads))
        factor = self._factor(radiance, held_out, unit)
        squares = with_common(squares, self.surface.share, replicates[0], factor)
        squares, sampled, (error_95, *bounds) = self._judged(squares, samples, radiance, factor)
        lacking = sum(mean_over(self.surface.share, each) for each in uncorrected if each is not None)
        direct, indirect = ((a + b) / 2 for a, b in zip(*light))
        return Estimate(
            unit=unit,
            direct=direct,
            indirect=indirect,
            error=float(np.sqrt(max(sampled + lacking / len(uncorrected), 0.0))),
            sampled=float(np.sqrt(max(sampled, 0.0))),
            error_95=float(error_95),
            bounds=np.array(bounds),
            brightness=unit * mean_over(self.surface.share, rough),
            share=self.surface.share,
            direct_square=squares[0],
            gather_square=squares[1],
            difference=weights[1] * (one[1] - two[1]) / 2,
            uncertainty=self._uncertainty(one, two, weights),
        )

    def _uncertainty(self, one: Means, two: Means, weights: list[np.ndarray]) -> tuple[float, float]:
        """Of the squared errors of explicit and of gathered light: see ``uncertainty_of``."""
        direct, bounced, first = (
            uncertainty_of(self.surface.share, weight * (a - b))
            for weight, a, b in zip((weights[0], weights[1], weights[0]), one, two)
        )
        return direct, max(bounced, first)  # noise of many, which smoothing lowers most, does not hide that of few

    def _smoothed_parts(
        self, neighborhoods: Sequence[Neighborhood], one: Means, two: Means, weights: list[np.ndarray]
    ) -> list[SmoothedLight]:
        """Explicit and gathered light of both replicates, smoothed. ``weights``, (count, channels) each,
        of direct and of indirect light: from irradiance to relative error."""
        (direct_a, bounced_a, first_a), (direct_b, bounced_b, first_b) = one, two
        gathered = [np.hstack(replicate) for replicate in ((first_a, bounced_a), (first_b, bounced_b))]
        return list(map_chunks(
            lambda part: self._smoothed(neighborhoods, *part),
            [(direct_a, direct_b, weights[0]), (*gathered, np.hstack(weights))],
            self.threads,
        ))  # fmt: skip

    def _judged(
        self, squares: tuple[np.ndarray, np.ndarray], samples: tuple[np.ndarray, np.ndarray],
        radiance: list[np.ndarray], factor: float,
    ) -> tuple[tuple[np.ndarray, np.ndarray], float, np.ndarray]:
        """Where colors end: the mean squared error, of ``squares`` (count,) and ``samples`` (count,
        channels) of the errors of explicit and of gathered light, or of colors fitted to the replicates' ``radiance``,
        times ``factor``; and the bounds for MOST of the surface and for PARTS.
        Before these the squares again, as colors have them."""
        share = self.surface.share
        if self.project is None:
            square = mean_over(share, squares[0]) + mean_over(share, squares[1])
            sample = sum(samples)
        else:
            share, sample = self._projected(radiance, factor)
            square = mean_over(share, sample**2)
            squares = self._as_colors(squares, share * (sample**2).mean(axis=1))
        return squares, square, bounds_of(share, sample, np.append(MOST, PARTS))

    def _as_colors(
        self, squares: tuple[np.ndarray, np.ndarray], errors: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Receivers' ``squares`` (count,) each, so that they add up to the squared ``errors`` (m,) of the colors made of them:
        half of these all over the surface, half around each color, as replicates of one color may agree by chance."""
        own = self.surface.share * (squares[0] + squares[1])
        everywhere = errors.sum() / max(own.sum(), LEAST)
        factor = (everywhere + self.project.receiver_factors(errors, own)) / 2
        return squares[0] * factor, squares[1] * factor

    def _factor(self, radiance: list[np.ndarray], held_out: list[Lighting] | None, unit: float) -> float:
        """By how much the error of the mean of the replicates' ``radiance`` (count, channels) is larger than half of
        their difference: see ``held_out``; 1 where nothing is held out."""
        if held_out is None:
            return 1.0
        share, chosen, scale = self.surface.share, self.held_out, self._scale(radiance, None)
        shown = mean_over(share, ((radiance[0] - radiance[1]) / (2 * scale)) ** 2)
        found = [
            self._radiance(direct + first, bounced, unit, chosen)
            for direct, bounced, first in (each.means(unit) for each in held_out)
        ]
        scale = np.maximum(scale[chosen], sum(found).mean(axis=1, keepdims=True) / 2)
        weight = np.maximum(share[chosen], 1 / len(chosen))  # over the chance to be chosen
        common = common_square([each[chosen] for each in radiance], found, weight, scale)
        return float(np.sqrt(1 + common / shown)) if shown > 0 else 1.0

    def _neighbors(self, *light: np.ndarray) -> Sequence[Neighborhood]:
        """The neighborhoods, given all light (count, c) so far: receivers without any, as in a sealed room
        beside the sun, are no neighbors of lit ones behind a wall."""
        dark = np.ones(len(light[0]), bool)
        for part, channel in product(light, range(light[0].shape[1])):
            dark &= part[:, channel] == 0
        if dark.all() or not dark.any():
            return self.neighborhoods
        return [each.separated(dark, self.sees) for each in self.neighborhoods]

    def common(self, estimate: Estimate) -> float:
        """Relative error that wide neighborhoods share: that of the elements.

        Averaged widely, the replicates' differences have lost nearly all of each receiver's own noise.
        What it leaves is measured by giving every difference a sign at random, several times: where
        one of these leaves as much, nothing is shared (a sign test); else their mean is taken off.
        """
        difference = estimate.difference
        shared, *own = (
            mean_over(estimate.share, widest(self.neighborhoods, signs * difference) ** 2)
            for signs in (np.float32(1), *(_signs(len(difference), draw) for draw in range(SIGN_DRAWS)))
        )
        return float(np.sqrt(max(shared - 2 * np.mean(own), 0.0))) if shared > max(own) else 0.0

    def _smoothed(
        self, neighborhoods: Sequence[Neighborhood], a: np.ndarray, b: np.ndarray, weight: np.ndarray
    ) -> SmoothedLight:
        """Replicates (count, k · channels) of k parts smoothed alike. ``weight`` (count, k · channels):
        from light to relative error."""
        smoothed = smooth(neighborhoods, a, b, weight, self.threads)
        difference = weight * (smoothed.a - smoothed.b) / 2
        bias = smoothed.square - 2 * row_squares(difference)  # error less noise
        channels = self.surface.diffuse.shape[1]
        both = sum(difference[:, k : k + channels] for k in range(0, difference.shape[1], channels))
        return SmoothedLight(smoothed.a, smoothed.b, both, bias, smoothed.touched)  # parts share rays

    def _pooled(self, neighborhoods: Sequence[Neighborhood], square: np.ndarray) -> np.ndarray:
        """(count,) squared errors averaged with those around, by area, as two replicates of one
        receiver may agree by chance; their mean over the surface stays."""
        share = self.surface.share
        area = (share * len(share)).astype(np.float32)
        around = smooth_map(neighborhoods, area)
        pooled = smooth_map(neighborhoods, area * square) / np.where(around > 0, around, 1)
        found, mean = mean_over(share, pooled), mean_over(share, square)
        return pooled * (mean / found) if found > 0 and mean > 0 else square

    def _scale(self, replicates: list[np.ndarray], brightness: float | None) -> np.ndarray:
        """(count, 1) what errors are judged against, from smoothed radiances (count, channels): noise
        of the light before smoothing is none of it. Where the replicates are far apart they are judged
        against either alone: a ray that brings much too much to one of them raises their mean's
        brightness, too, but not the other's."""
        share = self.surface.share
        scale = scale_of((replicates[0] + replicates[1]) / 2, share, brightness)
        one, other = (scale_of(replicate, share, brightness) for replicate in replicates)
        doubtful = np.maximum(one, other) > DOUBTFUL * np.minimum(one, other)
        least = np.minimum(one, other)  # the sum of inverse squares, without what overflows
        either = least * np.sqrt(2 / (1 + (least / np.maximum(one, other)) ** 2))
        return np.where(doubtful, either, scale)

    @cached_property
    def _gain(self) -> np.ndarray:
        """(count, channels) float32 radiance per irradiance."""
        color = self.surface.diffuse
        color = color if Pass.COLOR in self.passes else np.ones_like(color)
        return (color / np.pi).astype(np.float32)

    def _radiance(
        self, direct: np.ndarray, indirect: np.ndarray, unit: float, chosen: np.ndarray | slice = slice(None)
    ) -> np.ndarray:
        """(k, channels) float32 what is baked, in ``unit``, at the receivers ``chosen`` (k,) int."""
        light = direct * np.float32(Pass.DIRECT in self.passes)
        light += indirect * np.float32(Pass.INDIRECT in self.passes)
        light *= self._gain[chosen]
        if Pass.EMIT in self.passes and self.surface.emission.any():
            light += (self.surface.emission[chosen] / unit).astype(np.float32)
        return light

    def _typical(self, replicates: list[Lighting]) -> float:
        """About the mean irradiance, above 0: all light is divided by it, so that float32 can hold squares."""
        irradiance = float(np.mean([replicate.typical() for replicate in replicates]))
        least = LEAST * float(self.surface.emission.max(initial=0))
        return max(irradiance, least) or 1.0

    def _projected(self, radiance: list[np.ndarray], factor: float) -> tuple[np.ndarray, np.ndarray]:
        """The error of fitted colors: shares (m,) of the surface, and a sample (m, channels) of the relative
        error of the colors made of the replicates' mean. The sample is half of the difference of the two
        replicates' colors, times ``factor`` for what both have in common. These are rough colors, moved into the
        limits that users' colors are kept within: where a few receivers determine a corner badly, a linear fit goes a
        hundred times beyond. Where the error may be small enough, they are the colors that users will see."""
        share = area_shares(self.project.area)
        fields = np.split(self.project.apply(np.hstack(radiance).astype(float)), 2, axis=1)
        colors = [np.clip(each, *self.project.limits(mine)) for each, mine in zip(fields, radiance)]
        sample, noise = _noise_of(share, *colors)
        if factor**2 * noise <= (OVERSTATED * self.enough) ** 2:
            sample, _ = _noise_of(share, *(self.project.show(each.astype(float)) for each in radiance))
        return share, factor * sample


def _noise_of(share: np.ndarray, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, float]:
    """A sample (m, c) of the relative error of the mean of two replicates' colors (m, c), and its mean square."""
    sample = (a - b) / (2 * scale_of((a + b) / 2, share))
    return sample, mean_over(share, sample**2)


def _signs(count: int, draw: int) -> np.ndarray:
    """(count, 1) float32 of 1 and -1, at random; alike for all seeds, as no light is sampled by them."""
    heads = uniform((count,), 0, Stream.SIGNS, draw) < 0.5
    return np.where(heads, np.float32(-1), np.float32(1))[:, None]
