"""Lattice: the texels of an image as neighbors of each other on the surface.

An à-trous kernel (Holschneider et al. 1989) averages texels at distances 1, 2, 4, ...; neighbors
are used in opposite pairs, f(x+d) + f(x−d) − 2 f(x), so that light that varies linearly stays as it
is, at the edge of a wall too. Only the nearest are used where there is no pair.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ..workers.parallel import ranges
from .border import Border
from .neighborhood import Sees

MANY = 400_000  # number [texels] of an image: one with more averages more widely before it decides on a level
BAND = 1 << 16  # number [texels] at a time: their weights stay in the cache
# Directions [rows, columns] to neighbors, and the weight of each.
DIRECTIONS = ((0, 1, 1 / 8), (1, 0, 1 / 8), (1, 1, 1 / 16), (1, -1, 1 / 16))


@dataclass(frozen=True)
class Lattice:
    """The texels of one image inside a padded rectangle, and which pairs are neighbors. A
    Neighborhood."""

    index: slice  # of its n receivers, which follow each other
    pixel: np.ndarray  # (n,) in the padded rectangle, row by row
    shape: tuple[int, int]
    pad: int  # empty rows and columns around
    weights: tuple  # [level][direction]: (height, width) float32 without the padding
    borders: tuple = ()  # [level] of Border, of the first levels

    def as_pictures(
        self, values: np.ndarray, chosen: list[int] | None = None, factor: float = 1.0
    ) -> np.ndarray:
        """(c, height, width) float32 pictures of ``factor`` times receivers' values (count, c), or
        of the ``chosen`` channels (c,) of them."""
        chosen = range(values.shape[1]) if chosen is None else chosen
        pictures = np.zeros((len(chosen), self.shape[0] * self.shape[1]), np.float32)
        for picture, channel in zip(pictures, chosen):
            picture[self.pixel] = values[self.index, channel] * factor
        return pictures.reshape(-1, *self.shape)

    def read(self, picture: np.ndarray) -> np.ndarray:
        """(n,) values of the texels in a picture (height, width)."""
        return picture.ravel()[self.pixel]

    @property
    def levels(self) -> int:
        """How many kernels there are, each twice as wide as the one before."""
        return len(self.weights)

    @cached_property
    def own(self) -> list[np.ndarray]:
        """[level]: (height, width) the share that a texel keeps, without the padding."""
        return [1 - 2 * sum(level) for level in self.weights]

    def step(self, *pictures: np.ndarray, level: int, into: list | None = None) -> list[np.ndarray]:
        """One à-trous kernel applied to pictures (height, width). They are 0 in the padding, as
        what they are put ``into`` is."""
        results = [np.zeros_like(picture) for picture in pictures] if into is None else into
        height, width = (size - 2 * self.pad for size in self.shape)
        for rows in ranges(height, max(BAND // max(width, 1), 1)):  # weights stay in the cache
            own, weights = self.own[level][rows], [w[rows] for w in self.weights[level]]
            for before, after in zip(pictures, results):
                center = self.inner(before, 0, 0)[rows] * own
                for (dy, dx, _), weight in zip(DIRECTIONS, weights):
                    dy, dx = dy << level, dx << level
                    pair = self.inner(before, dy, dx)[rows] + self.inner(before, -dy, -dx)[rows]
                    pair *= weight
                    center += pair
                self.inner(after, 0, 0)[rows] = center
        if level < len(self.borders):
            pixels, change = self._prepared[level]
            for before, after in zip(pictures, results):
                after.reshape(-1)[pixels] += change @ before.reshape(-1)
        return results

    @cached_property
    def _prepared(self) -> list:
        return [border.prepared(self.shape[0] * self.shape[1]) for border in self.borders]

    def variance_kept(self, level: int) -> float:
        """The share of independent noise's variance that kernels up to ``level`` leave: together
        they are triangles 2m wide along both axes."""
        m = 2 << level
        return ((2 * m * m + 1) / (3 * m**3)) ** 2

    def averaging_levels(self, level: int) -> int:
        """Levels of kernels that average what decides whether to go to ``level``. The finer an
        image, the fewer rays a texel has, and the more often a few of them mislead."""
        return min(max(level, len(self.pixel) > MANY) + 2, self.levels)

    def beside(self, picture: np.ndarray) -> np.ndarray:
        """Of (height, width) >= 0, the largest of each texel and the eight around it."""
        from scipy.ndimage import maximum_filter

        return maximum_filter(picture, 3)

    def separated(self, dark: np.ndarray, sees: Sees) -> Lattice:
        """Without the pairs by which receivers that are ``dark`` (count,) bool would get light from
        others that are not and that they do not see: ``sees(one, other)`` (k,) bool."""
        number = np.full(self.shape[0] * self.shape[1], -1)
        number[self.pixel] = np.arange(self.index.start, self.index.stop)
        chosen = np.flatnonzero(dark[self.index])
        center = self.pixel[chosen]
        inner = self.inner_pixel(center)
        pairs = []
        for level, side in product(range(self.levels), (1, -1)):
            for k, (dy, dx, _) in enumerate(DIRECTIONS):
                other = number[center + side * (dy * self.shape[1] + dx << level)]
                used = self.weights[level][k].ravel()[inner] > 0
                some = np.flatnonzero(used & (other >= 0) & ~dark[other])
                pairs.append((level, k, some, other[some]))
        some, other = (np.concatenate(part) for part in list(zip(*pairs))[2:])
        hidden = ~sees(self.index.start + chosen[some], other)
        weights = [list(level) for level in self.weights]
        ends = np.cumsum([len(some) for _, _, some, _ in pairs])[:-1]
        for (level, k, some, _), cut in zip(pairs, np.split(hidden, ends)):
            if cut.any():
                if weights[level][k] is self.weights[level][k]:
                    weights[level][k] = weights[level][k].copy()
                weights[level][k].ravel()[inner[some[cut]]] = 0
        borders = tuple(_separated_border(each, number, dark, sees) for each in self.borders)
        return replace(self, weights=tuple(weights), borders=borders)

    def inner(self, picture: np.ndarray, dy: int, dx: int) -> np.ndarray:
        """A view of (..., height, width) without the padding, moved by (dy, dx)."""
        (height, width), pad = self.shape, self.pad
        return picture[..., pad + dy : height - pad + dy, pad + dx : width - pad + dx]

    def inner_pixel(self, pixel: np.ndarray) -> np.ndarray:
        """Pixels (k,) of the padded rectangle in the rectangle without the padding."""
        row, column = np.divmod(pixel, self.shape[1])
        return (row - self.pad) * (self.shape[1] - 2 * self.pad) + column - self.pad


def _separated_border(border: Border, number: np.ndarray, dark: np.ndarray, sees: Sees) -> Border:
    one, other = number[border.pixel], number[border.other]
    kept = ~dark[one] | dark[other]
    some = np.flatnonzero(~kept)
    kept[some] = sees(one[some], other[some])
    return border.take(kept)
