"""Lattice: the texels of an image as neighbours of each other on the surface.

Depends on NumPy only. An à-trous kernel (Holschneider et al. 1989) averages texels at distances
1, 2, 4, ...; neighbours are used in opposite pairs only, f(x+d) + f(x−d) − 2 f(x), so that light
that varies linearly stays as it is, at the edge of a wall too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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

    @property
    def levels(self) -> int:
        """How many kernels there are, each twice as wide as the one before."""
        return len(self.weights)

    def step(self, picture: np.ndarray, level: int) -> np.ndarray:
        """One à-trous kernel applied to a picture."""
        result = picture.copy()
        for (dy, dx, _), weight in zip(DIRECTIONS, self.weights[level]):
            dy, dx = dy << level, dx << level
            pair = _shifted(picture, dy, dx)
            pair += _shifted(picture, -dy, -dx)
            pair -= 2 * picture
            pair *= weight
            result += pair
        return result


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
