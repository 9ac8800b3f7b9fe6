"""Correction: from paths along the residual to what gathered light lacks, region by region.

A path's sum is the bias of the gathered light at its receiver in the mean, with much noise. Regions
are nested: all receivers, then cubes of half the size at each level, by facing. A region's mean is
drawn toward that of the region around it as far as its noise asks for: the spread of the true means
is what remains of the spread of the measured ones (James and Stein 1961; Efron and Morris 1973,
"Stein's estimation rule and its competitors").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..gather.residual import Residuals
from ..geometry.clusters import facings, labels, octants
from ..geometry.footprints import Footprints
from ..geometry.vectors import unit_rows
from .relative_error import FLOOR

LEVELS = 6  # number [levels of regions], each half as wide as the one around it
PER_REGION = 64  # number [paths in a region, on average]: levels with fewer are not used
POOLED = 8  # weight [paths] of all regions' variance beside a region's own
SIGNIFICANT = 2.5  # bias [standard errors]: smaller ones are taken for noise
WILD = 0.5  # deviation [relative] of paths: above it, elements of which rare large values come may be divided
MOST_OF_SQUARE = 0.8  # share [of the variance of paths] that has to come from few elements for them to be divided
FEW = 0.05  # share [of elements' sides], at most, that are such few: if it comes from more, they are noisy, not biased
MOST_OF_BIAS = 0.9  # share [of the bias]: elements that bring the rest are not divided
LARGEST = 3.0  # factor [gathered light]: a larger correction is reported, not added


@dataclass(frozen=True)
class Correction:
    """What receivers' gathered light lacks, by region, for n regions and R receivers.

    ``lack`` (n, channels) float64 irradiance; ``uncorrected`` (n,) its expected square, relative, that
    noise kept from being found; ``scale`` (n,) the irradiance that this is relative to.
    """

    region: np.ndarray  # (R,) int
    lack: np.ndarray
    uncorrected: np.ndarray
    scale: np.ndarray
    found: float  # root mean square over the surface of what is lacked, relative, noise taken off

    def share(self, gathered: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(R, channels) float32: what to add to each receiver's ``gathered`` (R, channels) mean
        irradiance, in proportion to it: what is dark stays dark. And (R,) float32: the squared relative
        bias that is not corrected, with what would have to be added where too little is gathered."""
        light = _mean_light(self.region, gathered, area)
        share = np.divide(self.lack, light, out=np.zeros_like(self.lack), where=light > 0)
        np.clip(share, -1, LARGEST, out=share)
        left = (self.lack - share * light).mean(axis=1) / self.scale
        square = (self.uncorrected + left**2).astype(np.float32)
        return (gathered * share[self.region]).astype(np.float32), square[self.region]


def regions_of(footprints: Footprints) -> list[np.ndarray]:
    """Numbers (R,) int of the regions that receivers lie in, coarse to fine, nested."""
    position, normal = footprints.middle()
    facing = facings(unit_rows(normal))
    corner = position.min(axis=0) if len(position) else np.zeros(3)
    extent = float((position - corner).max(initial=0)) * (1 + 1e-6) or 1.0
    levels = [np.zeros(len(position), np.int64)]
    for level in range(LEVELS):
        cube = np.minimum((position - corner) * (2**level / extent), 2**level - 1).astype(np.int64)
        levels.append(labels(cube, facing))
    return levels


def usable_levels(levels: list[np.ndarray], paths: int) -> list[np.ndarray]:
    """Those of the ``levels`` of regions that ``paths`` can tell of, at least the coarsest."""
    regions = [int(numbers.max(initial=0)) + 1 for numbers in levels]
    few = [number * PER_REGION <= paths for number in regions[1:]]
    return levels[: 1 + (few + [False]).index(False)]


def find_correction(
    residuals: Residuals, levels: list[np.ndarray], gathered: np.ndarray, area: np.ndarray
) -> Correction:
    """The correction that paths tell of, for receivers of ``area`` (R,) in regions (R,), coarse to fine. A
    region lacks what that around it does in proportion to the irradiance ``gathered`` (R, channels): else
    more would be taken from dark ones than they have."""
    lack = residuals.paths.lack.astype(float)
    of_region = irradiance_of_regions(residuals, levels)
    scale = of_region[levels[-1][residuals.paths.owner]]
    relative = lack.mean(axis=1) / scale
    outer = np.zeros(len(levels[0]), np.int64)
    # What all regions are drawn toward first: nothing.
    parent, light = np.zeros((1, lack.shape[1])), _mean_light(outer, gathered, area)
    found, uncorrected = 0.0, np.zeros(1)
    for region in levels:
        count = int(region.max(initial=0)) + 1
        inside = np.zeros(count, np.int64)
        inside[region] = outer  # the region around each
        mine = region[residuals.paths.owner]
        number = np.bincount(mine, minlength=count)
        own = _mean_light(region, gathered, area)
        around = light[inside]
        base = parent[inside] * np.divide(own, around, out=np.zeros_like(own), where=around > 0)
        variance, error = _level(relative, mine, number, base, scale)
        shrink = np.where(error < np.inf, variance / np.maximum(variance + error, 1e-300), 0.0)
        sums = np.stack([np.bincount(mine, column, count) for column in lack.T], 1)
        mean = sums / np.maximum(number, 1)[:, None]
        parent = base + np.where(number > 0, shrink, 0.0)[:, None] * (mean - base)
        unfound = np.maximum(variance, error) if region is levels[0] else variance
        found, uncorrected = found + variance, uncorrected[inside] + unfound * (1 - shrink) ** 2
        outer, light = region, own
    return Correction(outer, parent, uncorrected, of_region, float(np.sqrt(found)))


def _mean_light(region: np.ndarray, gathered: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(n, channels) means over regions (R,) of what is ``gathered`` (R, channels), by ``area`` (R,)."""
    total = np.maximum(np.bincount(region, area, 1), 1e-300)
    return np.stack([np.bincount(region, area * each) for each in gathered.T], 1) / total[:, None]


def irradiance_scale(residuals: Residuals, levels: list[np.ndarray]) -> np.ndarray:
    """(n,) what lacks of paths are relative to: ``irradiance_of_regions``."""
    return irradiance_of_regions(residuals, levels)[levels[-1][residuals.paths.owner]]


def irradiance_of_regions(residuals: Residuals, levels: list[np.ndarray]) -> np.ndarray:
    """(n,) the mean irradiance of each of the finest regions, with what it lacks where that makes more
    of it, or a quarter of that of all, where that is more; above 0."""
    known = residuals.paths.irradiance.mean(axis=1, dtype=float)
    light = np.stack([known, known + residuals.paths.lack.mean(axis=1, dtype=float)], 1)
    mine, count = levels[-1][residuals.paths.owner], int(levels[-1].max(initial=0)) + 1
    number = np.maximum(np.bincount(mine, minlength=count), 1)
    mean = np.stack([np.bincount(mine, each, count) / number for each in light.T], 1)
    floor = FLOOR * light.mean(axis=0).max() if len(light) else 0.0
    return np.maximum(np.maximum(mean.max(axis=1), floor), 1e-300)


def _level(
    relative: np.ndarray, mine: np.ndarray, number: np.ndarray, base: np.ndarray, scale: np.ndarray
) -> tuple[float, np.ndarray]:
    """Mean squared distance of the true means of regions from those around them, and the squared
    standard error (count,) of each measured mean; relative."""
    count = len(number)
    mean = np.bincount(mine, relative, count) / np.maximum(number, 1)
    outer_mean = base.mean(axis=1)[mine] / scale
    square = np.bincount(mine, (relative - mean[mine]) ** 2, count)
    pooled = square.sum() / max(len(relative) - count, 1)
    some = number > 0
    weight = number / max(number.sum(), 1)
    halves = [
        np.bincount(mine[half::2], (relative - outer_mean)[half::2], count)
        / np.maximum(np.bincount(mine[half::2], minlength=count), 1)
        for half in (0, 1)
    ]
    surplus = (weight * halves[0] * halves[1]).sum()  # two independent means: no noise in the mean of it
    variance = (square + POOLED * pooled) / np.maximum(number + POOLED - 1, 1)
    error = np.where(some, variance / np.maximum(number, 1), np.inf)
    # Where nothing is lacked, a product of two means of half the paths scatters by twice the error.
    chance = np.sqrt(((2 * weight * np.where(some, error, 0)) ** 2).sum())
    variance = surplus if surplus > SIGNIFICANT * chance else 0.0
    return float(variance), error


def biased_elements(
    residuals: Residuals, scale: np.ndarray, side: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, float]:
    """Elements (k,) int worth dividing: through them comes most of a bias that noise does not
    explain; and that bias, relative: the sum over their parts of its absolute value.

    ``scale`` (n_paths,) is what lacks are relative to; ``side`` and ``position`` (n_visits, 3) are
    the visits' element sides, below 0 for what is no element, and where they are. Parts are octants
    around the mean of the visits to a side.
    """
    some = np.flatnonzero(side >= 0)
    if len(some) == 0:
        return np.zeros(0, np.int64), 0.0
    value = residuals.visits.value[some].mean(axis=1, dtype=float) / scale[residuals.visits.path[some]]
    side, position = side[some], position[some]
    sides, mine = np.unique(side, return_inverse=True)
    mine = mine.reshape(-1)
    part = octants(position, mine)
    total = np.bincount(part, value, 8 * len(sides))
    noise = np.sqrt(np.bincount(part, value * value, 8 * len(sides)))
    excess = np.abs(total) * (np.abs(total) > SIGNIFICANT * noise)
    excess = excess.reshape(-1, 8).sum(axis=1)
    rare = _rare(noise.reshape(-1, 8), len(scale))
    bias = np.maximum(excess, rare) / len(scale)
    element, first = np.unique(sides // 2, return_inverse=True)
    bias = np.bincount(first.reshape(-1), bias)
    order = np.argsort(-bias, kind="stable")
    reached = np.cumsum(bias[order])
    most = int(np.searchsorted(reached, MOST_OF_BIAS * reached[-1])) + 1
    return element[order[:most]][bias[order[:most]] > 0], float(bias.sum())


def _rare(noise: np.ndarray, paths: int) -> np.ndarray:
    """(n_sides,) the sums of rare, large values where a few sides bring most of the variance of paths; 0 elsewhere.
    ``noise`` (n_sides, parts): roots of sums of squares."""
    square = (noise**2).sum(axis=1)
    if square.sum() / paths < WILD**2:
        return np.zeros(len(square))
    order = np.argsort(-square, kind="stable")
    behind = np.searchsorted(np.cumsum(square[order]), MOST_OF_SQUARE * square.sum()) + 1
    if behind > max(FEW * len(square), 1):
        return np.zeros(len(square))
    result = np.zeros(len(square))
    result[order[:behind]] = np.sqrt(square[order[:behind]])
    return result
