"""Smooth: share gathered light among neighbouring texels, as far as the light itself allows.

Depends on NumPy and SciPy. Indirect light varies slowly over a flat wall, its sampling noise
does not. An à-trous kernel (Holschneider et al. 1989) averages texels at distances 1, 2, 4, ...;
neighbours are used in opposite pairs only, f(x+d) + f(x−d) − 2 f(x), so that light that varies
linearly stays as it is, at the edge of a wall too. How far to go is chosen at every texel by
cross-validation: two independent halves a, b of the rays give E[(f_a − b)²] = MSE(f_a) + var(b),
bias included, so the level of least error shows, and so does the error that is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

WINDOW = 33  # receivers
LEVELS = 5  # kernels reach 1, 3, 7, 15, 31 texels
DIRECTIONS = ((0, 1, 1 / 8), (1, 0, 1 / 8), (1, 1, 1 / 16), (1, -1, 1 / 16))  # row, column, weight
FLAT = 0.1  # a pair counts where its middle is this near the texel [of its distance]
STRETCH = 2.0  # and where it is not this much wider than the texels nearby say


@dataclass(frozen=True)
class Lattice:
    """The texels of one image inside a padded rectangle, and which pairs are neighbours."""

    index: np.ndarray  # (n,) receivers
    row: np.ndarray  # (n,) in the padded rectangle
    column: np.ndarray
    shape: tuple[int, int]
    weights: tuple  # [level][direction]: (height, width, 1) float32; None where all are 0

    def spread(self, values: np.ndarray) -> np.ndarray:
        """(height, width, c) float32 picture of receivers' values (count, c)."""
        picture = np.zeros(self.shape + values.shape[1:], np.float32)
        picture[self.row, self.column] = values[self.index]
        return picture

    def read(self, picture: np.ndarray) -> np.ndarray:
        """(n, c) values of the texels in a picture."""
        return picture[self.row, self.column]


def build_lattices(grid, position, normal, levels: int = LEVELS) -> list[Lattice]:
    """One lattice an image. ``grid`` (count, 3) image, row, column; ``position`` (count, 3);
    ``normal`` (count, 3) unit."""
    lattices = []
    for image in np.unique(grid[:, 0]):
        index = np.flatnonzero(grid[:, 0] == image)
        low = grid[index, 1:].min(axis=0)
        high = grid[index, 1:].max(axis=0)
        pad = 1 << (levels - 1)
        row, column = (grid[index, 1:] - low + pad).T
        shape = tuple((high - low + 1 + 2 * pad).tolist())
        lattice = Lattice(index, row, column, shape, ())
        lattices.append(_with_weights(lattice, position, normal, levels))
    return lattices


def _with_weights(lattice: Lattice, position, normal, levels: int) -> Lattice:
    place = lattice.spread(position)
    facing = lattice.spread(normal)
    covered = np.zeros(lattice.shape, bool)
    covered[lattice.row, lattice.column] = True
    weights = []
    span = None
    for level in range(levels):
        row = []
        for dy, dx, weight in DIRECTIONS:
            dy, dx = dy << level, dx << level
            plus, minus = _shifted(place, dy, dx), _shifted(place, -dy, -dx)
            both = covered & _shifted(covered, dy, dx) & _shifted(covered, -dy, -dx)
            width = np.linalg.norm(plus - minus, axis=2)
            flat = np.linalg.norm(plus + minus - 2 * place, axis=2) <= FLAT * width
            bend = _shifted(facing, dy, dx) + _shifted(facing, -dy, -dx)
            flat &= np.einsum("ijk,ijk->ij", bend, facing) > 1.98
            row.append((both & flat, width / np.hypot(dy, dx)))
        if span is None:  # the usual width of a step, from the nearest pairs
            steps = np.stack([np.where(ok, width, np.inf) for ok, width in row])
            span = steps.min(axis=0)
        weights.append(
            [
                (weight * (ok & (width <= STRETCH * span)))[..., None].astype(np.float32)
                for (ok, width), (_, _, weight) in zip(row, DIRECTIONS)
            ]
        )
    return Lattice(lattice.index, lattice.row, lattice.column, lattice.shape, tuple(weights))


def _shifted(picture: np.ndarray, dy: int, dx: int) -> np.ndarray:
    """The picture moved so that (y, x) shows what was at (y + dy, x + dx); edges wrap into the
    padding, which is empty."""
    return np.roll(picture, (-dy, -dx), axis=(0, 1))


def _step(picture: np.ndarray, weights, level: int) -> np.ndarray:
    """One à-trous kernel."""
    result = picture.copy()
    for (dy, dx, _), weight in zip(DIRECTIONS, weights[level]):
        dy, dx = dy << level, dx << level
        pair = _shifted(picture, dy, dx)
        pair += _shifted(picture, -dy, -dx)
        pair -= 2 * picture
        pair *= weight
        result += pair
    return result


@dataclass(frozen=True)
class Smoothed:
    """Two smoothed halves (count, c) and the squared error (count, c) expected of one of them."""

    a: np.ndarray
    b: np.ndarray
    square_error: np.ndarray
    touched: np.ndarray  # (count,) bool: neighbours had a share


def smooth(lattices: list[Lattice], a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> Smoothed:
    """Smooth two independent halves a, b (count, c) alike.

    ``weight`` (count, c) takes them to relative errors, by which levels are chosen.
    """
    out_a, out_b = a.copy(), b.copy()
    error = (a - b) ** 2 / 2
    touched = np.zeros(len(a), bool)
    for lattice in lattices:
        one, two, gain, level = _smooth_picture(lattice, a, b, weight)
        out_a[lattice.index] = lattice.read(one)
        out_b[lattice.index] = lattice.read(two)
        error[lattice.index] += lattice.read(gain)
        touched[lattice.index] = lattice.read(level)[:, 0]
    return Smoothed(out_a, out_b, error, touched)


def smooth_map(lattices: list[Lattice], values: np.ndarray, levels: int = 3) -> np.ndarray:
    """(count,) values averaged over the texels around, or, where there is no lattice, over
    receivers of near numbers: those of a face and its neighbours."""
    if not lattices:
        return uniform_filter1d(values, min(WINDOW, len(values)), mode="nearest")
    result = values.copy()
    for lattice in lattices:
        picture = lattice.spread(values[:, None])
        for level in range(levels):
            picture = _step(picture, lattice.weights, level)
        result[lattice.index] = lattice.read(picture)[:, 0]
    return result


def _smooth_picture(lattice: Lattice, a, b, weight):
    raw = lattice.spread(a), lattice.spread(b)
    square = lattice.spread(weight) ** 2
    now, best = raw, raw
    best_change = np.zeros(lattice.shape + (1,), np.float32)  # of the squared error
    gain, total = np.zeros_like(raw[0]), np.zeros_like(raw[0])
    for level in range(len(lattice.weights)):
        after = tuple(_step(picture, lattice.weights, level) for picture in now)
        total = total + 0.5 * (
            (after[0] - now[0]) * (after[0] + now[0] - 2 * raw[1])
            + (after[1] - now[1]) * (after[1] + now[1] - 2 * raw[0])
        )
        local = (total * square).mean(axis=2, keepdims=True)
        for k in range(min(level + 2, len(lattice.weights))):
            local = _step(local, lattice.weights, k)
        better = local < best_change
        best_change = np.where(better, local, best_change)
        best = tuple(np.where(better, new, old) for new, old in zip(after, best))
        gain = np.where(better, total, gain)
        now = after
    return best[0], best[1], gain, best_change < 0
