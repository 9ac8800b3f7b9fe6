"""Lattice weights: which texels of images are neighbors on the surface, and how much they count.

Opposite pairs count where both lie in one plane with the texel, are no further off than texels nearby
are, and nothing stands between. At borders, where there are none, the nearest ones stand in.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.vectors import dot
from ..workers.parallel import map_chunks, ranges
from .border import FACING, Border, find_border
from .border import LEVELS as BORDER_LEVELS
from .lattice import BAND, DIRECTIONS, Lattice
from .pack_texels import pack_texels
from .walls import Walls

LEVELS = 5  # number [levels]: kernels reach 1, 3, 7, 15, 31 texels
FLAT = 0.1  # distance [of that between the two] of a pair's middle from the texel: a pair that bends more does not count
ROUND = 0.3  # distance [as above] where faces are shaded smooth, over edges of up to 33°
STRETCH = 2.0  # distance [of that of the nearest pairs, per texel] between the two of a pair: a wider pair does not count
MOST = 2.0  # factor [of a pair's weight] by which it replaces missing pairs, at most
MOST_GIVEN = 2 * sum(weight for *_, weight in DIRECTIONS)  # share [of the kernel] of a texel's neighbors, at most


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
        pad = 1 << (levels - 1)
        row, column = (grid[index, axis].astype(np.intp) for axis in (1, 2))
        row, column = pack_texels(row - row.min(), column - column.min(), pad)
        height, width = (int(axis.max()) + 1 + 2 * pad for axis in (row, column))
        lattice = Lattice(index, (row + pad) * width + column + pad, (height, width), pad, ())
        weights = _weights(lattice, position, normal, flat, levels, threads)
        blocked = _blocked(lattice, walls, levels)
        _cut_pairs(lattice, weights, blocked)
        _share_out(weights)
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
    close = lattice.beside(lattice.as_pictures(walls.near[:, None])[0])
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


def _share_out(weights: tuple) -> None:
    """Let the pairs that there are take the weight of those that are missing: along an island's straight
    edge the kernel becomes (1, 2, 1) / 4, that of a line, and not (1, 6, 1) / 8."""
    total = np.float32(sum(weight for *_, weight in DIRECTIONS))
    for level in weights:
        found = np.sum(level, axis=0)
        factor = np.minimum(total / np.maximum(found, np.float32(1e-6)), np.float32(MOST))
        for weight in level:
            weight *= factor


def _borders(
    lattice: Lattice, position: np.ndarray, normal: np.ndarray, blocked: list[list] | None
) -> tuple[Border, ...]:
    """The borders of each of the first levels. ``position`` and ``normal`` (count, 3); ``blocked``: see
    ``_blocked``."""
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
        given = 2 * sum(lattice.weights[level]).ravel()
        borders.append(border.within(MOST_GIVEN - given[lattice.inner_pixel(border.pixel)]))
    return tuple(borders)


def _is_blocked(border: Border, missing: list, blocked: list, level: int) -> np.ndarray:
    """(k,) bool: something stands between a border's texels and their neighbors."""
    step, result = border.other - border.pixel, np.zeros(len(border.pixel), bool)
    for (offset, *_), found in zip(missing, blocked):
        for side, start in ((1, border.pixel), (-1, border.other)):
            some = step == side * (offset << level)
            result[some] = found[start[some]]
    return result


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
) -> tuple[list[np.ndarray], ...]:
    """[level][direction]: (height, width) float32, without the padding, of the texels' ``position`` and
    ``normal`` (n, 3); ``flat`` (n,): see ``_Surface``."""
    surface = _Surface(
        lattice.as_pictures(position),
        lattice.as_pictures(normal),
        lattice.as_pictures(flat[:, None])[0],
        lattice.as_pictures(np.ones((len(position), 1), bool))[0] > 0,
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

    map_chunks(weigh, ranges(height, max(BAND // width, 1)), threads)
    return tuple(list(level) for level in weights)


def _pairs(
    lattice: Lattice, surface: _Surface, dy: int, dx: int, rows: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Where the texels (dy, dx) to both sides lie in one plane with this one, (rows, width) bool,
    and the square of how wide a step between them is; without the padding."""

    def three(picture: np.ndarray) -> Iterator[np.ndarray]:
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
    ok &= dot(one + other, normal) > np.float32(2 * FACING)
    width *= np.float32(1 / (dy * dy + dx * dx))
    return ok, width
