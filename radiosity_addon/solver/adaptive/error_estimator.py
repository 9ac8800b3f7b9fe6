"""Judge: from two independent halves of the light to a result, its error, and what to add.

The error is the local relative RMS error of docs/theory.md: each receiver is judged against its own
brightness or the mean brightness, whichever is larger.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ..filtering.smooth import dilate, smooth, smooth_map, widest
from ..gather.lighting import Lighting
from ..geometry.vectors import row_squares
from ..sampling.sobol import uniform
from ..workers.parallel import map_chunks

# Smoothing that trades bias for noise as well as it can leaves a squared bias of half the squared
# noise (h² against 1/h in two dimensions), and halves that come out more alike than they are, as
# levels are chosen by the same numbers: measured, what their difference does not show is one and a
# half times what it does (docs/theory.md).
BALANCE = 1.5
LEAST = 1e-20  # of the brightest emission: a typical irradiance is taken to be that much at least
DIRECT_SHARE = 0.4  # of the squared error that is allowed; the rest is for gathered light


@dataclass(frozen=True)
class Surface:
    """At receivers, (count, channels): reflectance, and emission as radiance."""

    reflectance: np.ndarray
    emission: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """Irradiances (count, channels) in ``unit``, the estimated relative error, and its square at
    each receiver; float32."""

    unit: float
    direct: np.ndarray
    indirect: np.ndarray
    error: float
    direct_square: np.ndarray  # (count,)
    gather_square: np.ndarray  # (count,)
    apart: np.ndarray  # (count, channels) relative: half the halves' difference, as gathered

    def squares(self) -> tuple[float, float]:
        """The parts of the squared error that direct and gathered light have, as they count where
        colours end."""
        direct, gather = (max(_mean(part), 0.0) for part in (self.direct_square, self.gather_square))
        total = direct + gather
        share = self.error**2 / total if total > 0 else 1.0
        return share * direct, share * gather


@dataclass(frozen=True)
class _Part:
    a: np.ndarray
    b: np.ndarray
    square: np.ndarray


@dataclass(frozen=True)
class ErrorEstimator:
    """What the error is measured on. ``project``: see ``sequence.solve``."""

    surface: Surface
    lattices: list  # of Lattice or Graph: who is whose neighbour
    passes: tuple[str, ...]
    threads: int
    sees: Callable  # (k,) bool of receivers (k,), (k,): whether one sees all of the other
    project: object = None

    def weigh(self, halves: list[Lighting]) -> Estimate:
        """Combine the halves."""
        unit = self._typical(halves)
        (direct_a, bounced_a, first_a), (direct_b, bounced_b, first_b) = (
            half.means(unit) for half in halves
        )
        channels = direct_a.shape[1]
        direct, indirect = direct_a + direct_b + first_a + first_b, bounced_a + bounced_b
        rough = self._radiance(direct / 2, indirect / 2, unit)
        weight = self._gain / _level(rough)  # from irradiance to relative error
        lit, bounced = (weight * np.float32(name in self.passes) for name in ("direct", "indirect"))
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
        if self.project is None:
            square = _mean(gathered.square) + _mean(shadows.square)
        else:
            square = self._projected([self._radiance(*half, unit) for half in light])
        return Estimate(
            unit=unit,
            direct=(one_direct + two_direct) / 2,
            indirect=(one_indirect + two_indirect) / 2,
            error=float(np.sqrt(max(square, 0.0))),
            direct_square=shadows.square,
            gather_square=gathered.square,
            apart=bounced * (bounced_a - bounced_b) / 2,
        )

    def mark(self, verdict: Estimate, goal: float) -> tuple:
        """Receivers to add to, and by what factor the squared error must fall, for direct and for
        gathered light: ((owners, factor), (owners, factor))."""
        result = []
        for local, square, share, spread in zip(
            (verdict.direct_square, verdict.gather_square),
            verdict.squares(),
            (DIRECT_SHARE, 1 - DIRECT_SHARE),
            # Shadow rays that agree may have missed what shows next to them.
            (lambda chosen: dilate(self.lattices, chosen), lambda chosen: chosen),
        ):
            excess = square / (share * goal**2)
            if excess <= 1:
                result.append((np.zeros(0, int), 1.0))
                continue
            chosen = local > 0.3 * _mean(local) / excess
            result.append((np.flatnonzero(spread(chosen)), excess))
        return tuple(result)

    def _neighbors(self, *light: np.ndarray) -> list:
        """Who is whose neighbour, given all light (count, c) so far: what is dark, as a sealed room
        beside the sun, stays so behind a wall."""
        dark = np.ones(len(light[0]), bool)
        for part, channel in product(light, range(light[0].shape[1])):
            dark &= part[:, channel] == 0
        if dark.all() or not dark.any():
            return self.lattices
        return [lattice.parted(dark, self.sees) for lattice in self.lattices]

    def common(self, verdict: Estimate) -> float:
        """Relative error that wide neighbourhoods share: that of the elements.

        Averaged widely, the halves' differences have lost nearly all of each receiver's own noise.
        What it leaves is measured by giving every difference a sign at random, and taken off.
        """
        apart = verdict.apart
        heads = uniform(apart.shape[:1], len(apart)) < 0.5
        signs = np.where(heads, np.float32(-1), np.float32(1))[:, None]
        shared = _mean(widest(self.lattices, apart) ** 2)
        own = _mean(widest(self.lattices, signs * apart) ** 2)
        return float(np.sqrt(max(shared - 2 * own, 0.0)))

    def _smoothed(self, lattices, a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> _Part:
        """Halves (count, k · channels) of k parts smoothed alike, and the mean's squared relative
        error (count,) of the parts' sum.

        Two halves of one receiver may agree by chance, so its error is taken from those around
        it too.
        """
        smoothed = smooth(lattices, a, b, weight, self.threads)
        apart = weight * (smoothed.a - smoothed.b) / 2
        bias = smoothed.square - 2 * row_squares(apart)  # error less noise
        channels = self.surface.reflectance.shape[1]
        parts = (apart[:, k : k + channels] for k in range(0, apart.shape[1], channels))
        noise = row_squares(sum(parts))  # parts share rays
        least = BALANCE * noise * smoothed.touched
        if _mean(bias) < _mean(least):
            bias = least
        square = smooth_map(lattices, (noise + bias) / channels)
        return _Part(smoothed.a, smoothed.b, square)

    @cached_property
    def _gain(self) -> np.ndarray:
        """(count, channels) float32 radiance per irradiance."""
        color = self.surface.reflectance
        color = color if "color" in self.passes else np.ones_like(color)
        return (color / np.pi).astype(np.float32)

    def _radiance(self, direct: np.ndarray, indirect: np.ndarray, unit: float) -> np.ndarray:
        """(count, channels) float32 what is baked, in ``unit``."""
        light = direct * np.float32("direct" in self.passes)
        light += indirect * np.float32("indirect" in self.passes)
        light *= self._gain
        if "emit" in self.passes and self.surface.emission.any():
            light += (self.surface.emission / unit).astype(np.float32)
        return light

    def _typical(self, halves: list[Lighting]) -> float:
        """An irradiance such as there is, above 0, by which all is divided: it makes float32 do."""
        irradiance = float(np.mean([half.typical() for half in halves]))
        least = LEAST * float(self.surface.emission.max(initial=0))
        return max(irradiance, least) or 1.0

    def _projected(self, halves: list[np.ndarray]) -> float:
        """Mean squared relative error of the halves' mean, where colours end."""
        a, b = (half.astype(float) for half in halves)
        level = _level(self.project((a + b) / 2))
        return _mean((self.project(a - b) / (2 * level)) ** 2)


def _level(radiance: np.ndarray) -> np.ndarray:
    """(n, 1) what errors of radiances (n, c) are judged against, above 0: a receiver's own mean
    brightness or that of all, whichever is larger."""
    channels = radiance.shape[1]
    level = radiance @ np.full((channels, 1), 1 / channels, radiance.dtype)
    level = np.maximum(level, level.dtype.type(_mean(level)))
    return np.where(level > 0, level, level.dtype.type(1))


def _mean(values: np.ndarray) -> float:
    """The mean of values of any precision, in float64."""
    return float(values.mean(dtype=float))
