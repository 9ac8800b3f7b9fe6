"""Smoothing: share sampled light among neighbors, as far as the light itself allows.

Light varies slowly over most of a surface, its sampling noise does not, so neighbors are averaged
by kernels of growing width. How far to go is chosen at every receiver by cross-validation: two
independent replicates a, b give E[(f_a − b)²] = MSE(f_a) + var(b), bias included, so the
level of least error shows, and so does the error that is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import row_squares
from ..workers.parallel import map_chunks, ranges
from .neighborhood import Neighborhood

WINDOW = 33  # width [receivers] of the mean over receivers of near numbers, where there is no neighborhood
MAP_LEVELS = 3  # number [levels] of kernels that such a mean takes where there is one
BAND = 1 << 16  # number [values] at a time: they stay in the cache
LARGEST = 1e9  # value [of a picture], at most: float32 still holds its fourth power
MARGIN = 0.2  # share [of the noise that a wider kernel should remove] by which the error must fall, at least


@dataclass(frozen=True)
class Smoothed:
    """Two smoothed replicates (count, c), and the squared relative error (count,) expected of one of
    them, summed over columns."""

    a: np.ndarray
    b: np.ndarray
    square: np.ndarray
    touched: np.ndarray  # (count,) bool: neighbors had a share


def smooth(
    neighborhoods: Sequence[Neighborhood], a: np.ndarray, b: np.ndarray, weight: np.ndarray,
    threads: int = 1,
) -> Smoothed:
    """Smooth two independent replicates a, b (count, c) alike.

    ``weight`` (count, c) takes them to relative errors, by which levels are chosen. Columns
    without light cost nothing.
    """
    lit = [channel for channel in range(a.shape[1]) if a[:, channel].any() or b[:, channel].any()]
    out_a, out_b = a.copy(), b.copy()
    touched = np.zeros(len(a), bool)
    square = row_squares(weight * (a - b)) / 2
    if len(lit) == 0:
        return Smoothed(out_a, out_b, square, touched)
    peak = float(max(a.max(), -a.min(), b.max(), -b.min()))
    scale = min(float(weight[:, lit].max()) or 1.0, LARGEST / peak)

    def pictures(
        neighborhood: Neighborhood
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        replicates = [neighborhood.as_pictures(each, lit, scale) for each in (a, b)]
        relative = neighborhood.as_pictures(weight, lit, 1 / scale)
        np.minimum(relative, LARGEST, out=relative)
        relative *= relative
        return _smooth_picture(neighborhood, *replicates, relative)

    for neighborhood, (one, two, saved, shared) in zip(
        neighborhoods, map_chunks(pictures, neighborhoods, threads)
    ):
        for column, channel in enumerate(lit):
            out_a[neighborhood.index, channel] = neighborhood.read(one[column]) / scale
            out_b[neighborhood.index, channel] = neighborhood.read(two[column]) / scale
        square[neighborhood.index] += neighborhood.read(saved)
        touched[neighborhood.index] = neighborhood.read(shared)
    return Smoothed(out_a, out_b, square, touched)


def smooth_map(neighborhoods: Sequence[Neighborhood], values: np.ndarray) -> np.ndarray:
    """(count,) values averaged over the texels around, or, where there is no neighborhood, over
    receivers of near numbers: those of a face and its neighbors."""
    if not neighborhoods:
        from scipy.ndimage import uniform_filter1d  # which takes a sixth of a second to import

        return uniform_filter1d(values, min(WINDOW, len(values)), mode="nearest")
    result = values.copy()
    for neighborhood in neighborhoods:
        (picture,) = neighborhood.as_pictures(values[:, None])
        for level in range(MAP_LEVELS):
            (picture,) = neighborhood.step(picture, level=level)
        result[neighborhood.index] = neighborhood.read(picture)
    return result


def dilate(neighborhoods: Sequence[Neighborhood], chosen: np.ndarray) -> np.ndarray:
    """(count,) bool: ``chosen`` (count,) bool and those beside them."""
    result = chosen.copy()
    for neighborhood in neighborhoods:
        picture = neighborhood.beside(neighborhood.as_pictures(chosen[:, None])[0])
        result[neighborhood.index] = neighborhood.read(picture) > 0
    return result


def widest(neighborhoods: Sequence[Neighborhood], values: np.ndarray) -> np.ndarray:
    """(count, c) values averaged as widely as the kernels reach; their mean without neighbors."""
    if not neighborhoods:
        return np.broadcast_to(values.mean(axis=0), values.shape)
    result = np.empty_like(values)
    for neighborhood in neighborhoods:
        pictures = neighborhood.as_pictures(values)
        for level in range(neighborhood.levels):
            pictures = neighborhood.step(*pictures, level=level)
        for channel, picture in enumerate(pictures):
            result[neighborhood.index, channel] = neighborhood.read(picture)
    return result


def _smooth_picture(
    neighborhood: Neighborhood, raw_a: np.ndarray, raw_b: np.ndarray, square: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pictures (c, ...) of both replicates smoothed, the change (...) of the squared relative error by that, summed
    over channels, and (...) bool where neighbors had a share. ``square`` (c, ...) makes errors relative.

    Each level is compared with the level chosen so far, by the change of the squared error, averaged over a window
    that is wider than the kernel. It is taken where the error fell by MARGIN of the noise that it should remove, at
    least: if it fell by less, the kernel blurs. As a window of few texels may show that by chance, any fall suffices
    where a window twice as wide shows enough of one.
    """
    count, shape = len(raw_a), raw_a.shape[1:]
    now, other = [*raw_a, *raw_b], [*raw_b, *raw_a]
    best = [picture.copy() for picture in now]
    noise, kept = _noise(raw_a, raw_b, square), np.ones(shape, np.float32)
    gain, total, change, *two = np.zeros((5, *shape), np.float32)
    # Fresh memory costs more than what is done in it: what was ``now`` is written anew.
    spare, averaged = [np.zeros_like(picture) for picture in (*now, noise)], 0
    for level in range(neighborhood.levels):
        after = []
        for k, (old, opposite) in enumerate(zip(now, other)):
            after += neighborhood.step(old, level=level, into=[spare.pop()])
            for rows in ranges(len(kept), max(BAND * len(kept) // kept.size, 1)):
                saved = _saved(after[k][rows], old[rows], opposite[rows])
                saved *= square[k % count][rows]
                total[rows] += saved
            if level:
                spare.append(old)
        np.subtract(total, gain, out=change)
        change *= 1 / count
        mean = change
        for k in range(neighborhood.averaging_levels(level)):
            (mean,) = neighborhood.step(mean, level=k, into=[two[k % 2]])
        while averaged < neighborhood.averaging_levels(level):
            (noise,), averaged = neighborhood.step(noise, level=averaged), averaged + 1
        remains = np.float32(neighborhood.variance_kept(level))
        top = min(averaged, neighborhood.levels - 1)
        wide, wide_noise = neighborhood.step(mean, noise, level=top)
        removed = MARGIN * (remains - kept)
        better = (mean < noise * removed) | ((mean < 0) & (wide < wide_noise * removed))
        for chosen, new in zip([*best, gain], [*after, total]):
            np.copyto(chosen, new, where=better)
        np.copyto(kept, remains, where=better)
        now = after
    return best[:count], best[count:], gain, kept < 1


def _noise(a: np.ndarray, b: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(...) squared relative noise of one of two replicates (c, ...), mean over channels."""
    noise = np.zeros(a.shape[1:], np.float32)
    for one, two, weight in zip(a, b, square):
        difference = one - two
        difference *= difference
        difference *= weight
        noise += difference
    noise *= 0.5 / len(a)
    return noise


def _saved(after: np.ndarray, before: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(...) half the change of (f − other)², when f goes from ``before`` to ``after``: other is
    independent of both, so that its noise cancels in the mean."""
    result = after + before
    result -= 2 * other
    result *= after - before
    result *= 0.5
    return result
