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

from ..geometry.vectors import dot
from ..workers.parallel import map_chunks, ranges
from .border import LEVELS as BORDER_LEVELS
from .border import Border, find_border
from .neighborhood import Sees
from .walls import Walls

MANY = 400_000  # number [texels] from which an image is a fine one
BAND = 1 << 16  # number [texels] that are averaged together: their weights stay in the cache
LEVELS = 5  # number [levels]: kernels reach 1, 3, 7, 15, 31 texels
# Directions [rows, columns] to neighbors, and the weight of each.
DIRECTIONS = ((0, 1, 1 / 8), (1, 0, 1 / 8), (1, 1, 1 / 16), (1, -1, 1 / 16))
FLAT = 0.1  # distance [of the pair's] of a pair's middle from the texel: further, it does not count
ROUND = 0.3  # distance [of the pair's]: the same where faces are shaded smooth: edges up to 33° are
STRETCH = 2.0  # width [of what texels nearby have] of a pair: wider, it does not count


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

    def spread(
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


def build_lattices(
    grid: np.ndarray, position: np.ndarray, normal: np.ndarray, threads: int = 1,
    levels: int = LEVELS, walls: Walls | None = None, rounded: np.ndarray | None = None,
) -> list[Lattice]:
    """One lattice an image. ``grid`` (count, 3) image, row, column, image by image; ``position``
    (count, 3); ``normal`` (count, 3) unit, by which light counts; ``walls`` that part neighbors
    (see ``walls``); ``rounded`` (count,) bool where the normal is not the surface's own, which may
    then bend more between texels; None: nowhere."""
    flat = np.full(len(grid), FLAT**2, np.float32)
    if rounded is not None:
        flat[rounded] = ROUND**2
    lattices = []
    start = np.unique(grid[:, 0], return_index=True)[1]
    for first, end in zip(start, [*start[1:], len(grid)]):
        index = slice(first, end)
        axes = grid[index, 1], grid[index, 2]
        low, high = (np.array([f(axis) for axis in axes]) for f in (np.min, np.max))
        pad = 1 << (levels - 1)
        row, column = (axis.astype(np.intp) - least + pad for axis, least in zip(axes, low))
        shape = tuple((high - low + 1 + 2 * pad).tolist())
        lattice = Lattice(index, row * shape[1] + column, shape, pad, ())
        weights = _weights(lattice, position, normal, flat, levels, threads)
        blocked = _blocked(lattice, walls, levels)
        _cut_pairs(lattice, weights, blocked)
        lattice = replace(lattice, weights=weights)
        lattices.append(replace(lattice, borders=_borders(lattice, position, normal, blocked)))
    return lattices


def _blocked(lattice: Lattice, walls: Walls | None, levels: int) -> list[list] | None:
    """[level][direction]: (height · width,) bool, something stands between the texel and that one
    in the direction, 1, 2, 4, ... texels away; None where nothing stands anywhere.

    A line between neighbors runs through one of them or through a neighbor of both.
    """
    if walls is None or not walls.near[lattice.index].any():
        return None
    number = np.full(lattice.shape[0] * lattice.shape[1], -1)
    number[lattice.pixel] = np.arange(lattice.index.start, lattice.index.stop)
    close = lattice.beside(lattice.spread(walls.near[:, None])[0])
    center = lattice.pixel[lattice.read(close) > 0]
    result = [[] for _ in range(levels)]
    for dy, dx, _ in DIRECTIONS:
        step = dy * lattice.shape[1] + dx
        some = center[number[center + step] >= 0]
        found = np.zeros(len(number), bool)
        found[some] = walls.between(number[some], number[some + step])
        for level in range(levels):
            result[level].append(found)
            found = found | np.roll(found, -(step << level))
    return result


def _cut_pairs(lattice: Lattice, weights: tuple, blocked: list[list] | None) -> None:
    """Take the pairs out of ``weights`` of which one is ``blocked``."""
    for level in range(len(weights) if blocked else 0):
        for weight, found, (dy, dx, _) in zip(weights[level], blocked[level], DIRECTIONS):
            either = found | np.roll(found, dy * lattice.shape[1] + dx << level)
            weight[lattice.inner(either.reshape(lattice.shape), 0, 0)] = 0


def _borders(
    lattice: Lattice, position: np.ndarray, normal: np.ndarray, blocked: list[list] | None
) -> tuple[Border, ...]:
    position, normal = position[lattice.index], normal[lattice.index]
    number = np.full(lattice.shape[0] * lattice.shape[1], -1)
    number[lattice.pixel] = np.arange(len(lattice.pixel))
    inner = lattice.inner_pixel(lattice.pixel)
    borders = []
    for level in range(min(BORDER_LEVELS, lattice.levels)):
        missing = [
            (dy * lattice.shape[1] + dx, float(np.hypot(dy, dx)), share, weight.ravel()[inner] == 0)
            for (dy, dx, share), weight in zip(DIRECTIONS, lattice.weights[level])
        ]
        border = find_border(lattice.pixel, number, missing, position, normal, level)
        if blocked:
            border = border.take(~_is_blocked(border, missing, blocked[level], level))
        borders.append(border)
    return tuple(borders)


def _is_blocked(border: Border, missing: list, blocked: list, level: int) -> np.ndarray:
    """(k,) bool: something stands between a border's texels and their neighbors."""
    step, result = border.other - border.pixel, np.zeros(len(border.pixel), bool)
    for (offset, *_), found in zip(missing, blocked):
        for side, start in ((1, border.pixel), (-1, border.other)):
            some = step == side * (offset << level)
            result[some] = found[start[some]]
    return result


def _separated_border(border: Border, number: np.ndarray, dark: np.ndarray, sees: Sees) -> Border:
    one, other = number[border.pixel], number[border.other]
    kept = ~dark[one] | dark[other]
    some = np.flatnonzero(~kept)
    kept[some] = sees(one[some], other[some])
    return border.take(kept)


@dataclass(frozen=True)
class _Surface:
    """Pictures of a lattice's texels: positions and normals (3, height, width), the square of how far
    a pair's middle may lie from the texel, of its distance (height, width), and bool where texels
    are."""

    inner: np.ndarray
    facing: np.ndarray
    flat: np.ndarray
    covered: np.ndarray


def _weights(
    lattice: Lattice, position: np.ndarray, normal: np.ndarray, flat: np.ndarray, levels: int,
    threads: int,
) -> tuple:
    surface = _Surface(
        lattice.spread(position),
        lattice.spread(normal),
        lattice.spread(flat[:, None])[0],
        lattice.spread(np.ones((len(position), 1), bool))[0] > 0,
    )
    height, width = lattice.inner(surface.covered, 0, 0).shape
    weights = np.empty((levels, len(DIRECTIONS), height, width), np.float32)

    def weigh(rows: slice) -> None:
        pairs = [
            [_pairs(lattice, surface, dy << level, dx << level, rows) for dy, dx, _ in DIRECTIONS]
            for level in range(levels)
        ]
        # The usual width of a step, from the nearest pairs.
        usual = np.minimum.reduce([np.where(ok, step, np.float32(np.inf)) for ok, step in pairs[0]])
        usual *= STRETCH**2
        for level in range(levels):
            for k, (ok, step) in enumerate(pairs[level]):
                np.multiply(DIRECTIONS[k][2], ok & (step <= usual), out=weights[level, k, rows])

    map_chunks(weigh, ranges(height, max(BAND // width, 1)), threads, lambda fraction: None)
    return tuple(list(level) for level in weights)


def _pairs(
    lattice: Lattice, surface: _Surface, dy: int, dx: int, rows: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Where the texels (dy, dx) to both sides lie in one plane with this one, (rows, width) bool,
    and the square of how wide a step between them is; without the padding."""

    def three(picture: np.ndarray):
        sides = (0, 0), (dy, dx), (-dy, -dx)
        return (lattice.inner(picture, *side)[..., rows, :] for side in sides)

    center, one, other = three(surface.inner)
    across = one - other
    width = dot(across, across)
    bent = one + other
    bent -= 2 * center
    ok = dot(bent, bent) <= lattice.inner(surface.flat, 0, 0)[rows] * width
    for part in three(surface.covered):
        ok &= part
    normal, one, other = three(surface.facing)
    ok &= dot(one + other, normal) > np.float32(1.98)
    width *= np.float32(1 / (dy * dy + dx * dx))
    return ok, width
