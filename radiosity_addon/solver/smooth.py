"""Smooth: share sampled light among neighbours, as far as the light itself allows.

Depends on ``lattice`` or ``graph`` for what neighbours are, and on ``parallel``. Light varies slowly over most of a
surface, its sampling noise does not, so neighbours are averaged by kernels of growing width. How
far to go is chosen at every receiver by cross-validation: two independent halves a, b of the
samples give E[(f_a − b)²] = MSE(f_a) + var(b), bias included, so the level of least error shows,
and so does the error that is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from .parallel import map_chunks

WINDOW = 33  # receivers
LARGEST = 1e9  # in pictures: they are float32, which holds fourth powers up to here
MARGIN = 0.2  # of the noise that a wider kernel takes away must not come back as blur


@dataclass(frozen=True)
class Smoothed:
    """Two smoothed halves (count, c) and the squared error (count, c) expected of one of them."""

    a: np.ndarray
    b: np.ndarray
    square_error: np.ndarray
    touched: np.ndarray  # (count,) bool: neighbours had a share


def smooth(lattices: list, a: np.ndarray, b: np.ndarray, weight: np.ndarray, threads=1) -> Smoothed:
    """Smooth two independent halves a, b (count, c) alike.

    ``weight`` (count, c) takes them to relative errors, by which levels are chosen. Columns
    without light cost nothing.
    """
    lit = np.flatnonzero(a.any(axis=0) | b.any(axis=0))
    out_a, out_b, error = a.copy(), b.copy(), np.zeros(a.shape)
    touched = np.zeros(len(a), bool)
    if len(lit) == 0:
        return Smoothed(out_a, out_b, error, touched)
    error[:, lit] = (a[:, lit] - b[:, lit]) ** 2 / 2
    peak = max(a.max(), -a.min(), b.max(), -b.min())
    scale = float(min(weight[:, lit].max() or 1.0, LARGEST / (peak or 1.0)))

    def pictures(lattice):
        halves = [lattice.spread(half, lit, scale) for half in (a, b)]
        square = lattice.spread(weight, lit, 1 / scale)
        np.minimum(square, LARGEST, out=square)
        square *= square
        return _smooth_picture(lattice, *halves, square)

    for lattice, (one, two, gain, shared) in zip(
        lattices, map_chunks(pictures, lattices, threads, lambda fraction: None)
    ):
        for column, channel in enumerate(lit):
            out_a[lattice.index, channel] = lattice.read(one[column]) * (1 / scale)
            out_b[lattice.index, channel] = lattice.read(two[column]) * (1 / scale)
            error[lattice.index, channel] += lattice.read(gain[column]) * (1 / scale**2)
        touched[lattice.index] = lattice.read(shared)
    return Smoothed(out_a, out_b, error, touched)


def smooth_map(lattices: list, values: np.ndarray, levels: int = 3) -> np.ndarray:
    """(count,) values averaged over the texels around, or, where there is no lattice, over
    receivers of near numbers: those of a face and its neighbours."""
    if not lattices:
        return uniform_filter1d(values, min(WINDOW, len(values)), mode="nearest")
    result = values.copy()
    for lattice in lattices:
        (picture,) = lattice.spread(values[:, None])
        for level in range(levels):
            picture = lattice.step(picture, level)
        result[lattice.index] = lattice.read(picture)
    return result


def dilate(lattices: list, chosen: np.ndarray) -> np.ndarray:
    """(count,) bool: ``chosen`` (count,) bool and those beside them."""
    result = chosen.copy()
    for lattice in lattices:
        picture = lattice.beside(lattice.spread(chosen[:, None])[0])
        result[lattice.index] = lattice.read(picture) > 0
    return result


def widest(lattices: list, values: np.ndarray) -> np.ndarray:
    """(count, c) values averaged as widely as the kernels reach; their mean without neighbours."""
    if not lattices:
        return np.broadcast_to(values.mean(axis=0), values.shape)
    result = np.empty_like(values)
    for lattice in lattices:
        for channel, picture in enumerate(lattice.spread(values)):
            for level in range(lattice.levels):
                picture = lattice.step(picture, level)
            result[lattice.index, channel] = lattice.read(picture)
    return result


def _smooth_picture(lattice, raw_a, raw_b, square):
    """Pictures (c, ...) of the halves smoothed, of the squared error that this saved, and (...) bool
    where neighbours had a share.

    Each level is weighed against the one chosen so far, the change of the squared error averaged
    over a window that is wider than the kernel, and is taken where enough of what it should take
    away of the noise is gone: what is missing is blur.
    """
    halves = [(raw_a, raw_b), (raw_b, raw_a)]
    noise, left = _noise(raw_a, raw_b, square), np.ones(raw_a.shape[1:], np.float32)
    now, best = [raw_a, raw_b], [raw_a.copy(), raw_b.copy()]
    gain, total = np.zeros_like(raw_a), np.zeros_like(raw_a)
    averaged = 0
    for level in range(lattice.levels):
        change = np.zeros(noise.shape, np.float32)
        after = [np.empty_like(raw_a), np.empty_like(raw_b)]
        for channel in range(len(raw_a)):  # one stays in the cache, all may not
            for new, old, (_, other) in zip(after, now, halves):
                new[channel] = lattice.step(old[channel], level)
                total[channel] += _saved(new[channel], old[channel], other[channel])
            change += (total[channel] - gain[channel]) * square[channel]
        change *= 1 / len(raw_a)
        for k in range(lattice.around(level)):
            change = lattice.step(change, k)
        while averaged < lattice.around(level):
            noise, averaged = lattice.step(noise, averaged), averaged + 1
        remains = np.float32(lattice.left(level))
        better = change < MARGIN * noise * (remains - left)
        for channel in range(len(raw_a)):
            for chosen, new in zip(best, after):
                np.copyto(chosen[channel], new[channel], where=better)
            np.copyto(gain[channel], total[channel], where=better)
        np.copyto(left, remains, where=better)
        now = after
    return *best, gain, left < 1


def _noise(a: np.ndarray, b: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(...) the halves' squared relative noise, mean of pictures (c, ...)."""
    noise = np.zeros(a.shape[1:], np.float32)
    for one, two, weight in zip(a, b, square):
        apart = one - two
        apart *= apart
        apart *= weight
        noise += apart
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
