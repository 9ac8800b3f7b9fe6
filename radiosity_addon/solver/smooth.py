"""Smooth: share sampled light among neighbours, as far as the light itself allows.

Depends on ``lattice`` or ``graph`` for what neighbours are. Light varies slowly over most of a
surface, its sampling noise does not, so neighbours are averaged by kernels of growing width. How
far to go is chosen at every receiver by cross-validation: two independent halves a, b of the
samples give E[(f_a − b)²] = MSE(f_a) + var(b), bias included, so the level of least error shows,
and so does the error that is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

WINDOW = 33  # receivers
LARGEST = 1e9  # in pictures: they are float32, which holds fourth powers up to here
MARGIN = 0.65  # of a receiver's own variance: the gain from which on neighbours have a share


@dataclass(frozen=True)
class Smoothed:
    """Two smoothed halves (count, c) and the squared error (count, c) expected of one of them."""

    a: np.ndarray
    b: np.ndarray
    square_error: np.ndarray
    touched: np.ndarray  # (count,) bool: neighbours had a share


def smooth(lattices: list, a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> Smoothed:
    """Smooth two independent halves a, b (count, c) alike.

    ``weight`` (count, c) takes them to relative errors, by which levels are chosen. Columns
    without light cost nothing.
    """
    lit = a.any(axis=0) | b.any(axis=0)
    if not lit.all():
        found = smooth(lattices, a[:, lit], b[:, lit], weight[:, lit]) if lit.any() else None
        arrays = [np.zeros(a.shape) for _ in range(3)]
        if found is not None:
            for array, some in zip(arrays, (found.a, found.b, found.square_error)):
                array[:, lit] = some
        return Smoothed(*arrays, np.zeros(len(a), bool) if found is None else found.touched)
    out_a, out_b = a.copy(), b.copy()
    error = (a - b) ** 2 / 2
    touched = np.zeros(len(a), bool)
    peak = max(np.abs(a).max(initial=0), np.abs(b).max(initial=0))
    scale = float(min(weight.max(initial=0) or 1.0, LARGEST / (peak or 1.0)))
    weight = np.minimum(weight / scale, LARGEST)
    for lattice in lattices:
        one, two, gain, level = _smooth_picture(lattice, a * scale, b * scale, weight)
        out_a[lattice.index] = lattice.read(one).astype(float) / scale
        out_b[lattice.index] = lattice.read(two).astype(float) / scale
        error[lattice.index] += lattice.read(gain).astype(float) / scale**2
        touched[lattice.index] = lattice.read(level)[:, 0]
    return Smoothed(out_a, out_b, error, touched)


def smooth_map(lattices: list, values: np.ndarray, levels: int = 3) -> np.ndarray:
    """(count,) values averaged over the texels around, or, where there is no lattice, over
    receivers of near numbers: those of a face and its neighbours."""
    if not lattices:
        return uniform_filter1d(values, min(WINDOW, len(values)), mode="nearest")
    result = values.copy()
    for lattice in lattices:
        picture = lattice.spread(values[:, None])
        for level in range(levels):
            picture = lattice.step(picture, level)
        result[lattice.index] = lattice.read(picture)[:, 0]
    return result


def dilate(lattices: list, chosen: np.ndarray) -> np.ndarray:
    """(count,) bool: ``chosen`` (count,) bool and those beside them."""
    result = chosen.copy()
    for lattice in lattices:
        picture = lattice.beside(lattice.spread(chosen[:, None]))
        result[lattice.index] = lattice.read(picture)[:, 0] > 0
    return result


def widest(lattices: list, values: np.ndarray) -> np.ndarray:
    """(count, c) values averaged as widely as the kernels reach; their mean without neighbours."""
    if not lattices:
        return np.broadcast_to(values.mean(axis=0), values.shape)
    result = np.empty_like(values)
    for lattice in lattices:
        picture = lattice.spread(values)
        for level in range(lattice.levels):
            picture = lattice.step(picture, level)
        result[lattice.index] = lattice.read(picture)
    return result


def _smooth_picture(lattice, a, b, weight):
    raw = lattice.spread(a), lattice.spread(b)
    square = lattice.spread(weight) ** 2
    noise = (0.5 * (raw[0] - raw[1]) ** 2 * square).mean(axis=0)
    now, best = raw, raw
    best_change = np.zeros_like(raw[0][:1])  # of the squared error
    gain, total = np.zeros_like(raw[0]), np.zeros_like(raw[0])
    least, reach = np.broadcast_to(-MARGIN * noise, best_change.shape), 0
    for level in range(lattice.levels):
        after = tuple(lattice.step(picture, level) for picture in now)
        total = total + 0.5 * (
            (after[0] - now[0]) * (after[0] + now[0] - 2 * raw[1])
            + (after[1] - now[1]) * (after[1] + now[1] - 2 * raw[0])
        )
        local = (total * square).mean(axis=0, keepdims=True)
        for k in range(lattice.around(level)):
            local = lattice.step(local, k)
        while reach < lattice.around(level):
            least, reach = lattice.step(least, reach), reach + 1
        better = (local < best_change) & (local < least)
        best_change = np.where(better, local, best_change)
        best = tuple(np.where(better, new, old) for new, old in zip(after, best))
        gain = np.where(better, total, gain)
        now = after
    return best[0], best[1], gain, best_change < 0
