"""Squares: a square of its own in one picture for every triangle, where Cycles bakes what its material shows.

Each triangle gets a square whose edge is a power of two. Sorted by falling size and laid
along the Z curve (Morton 1966) they fill a larger one without gaps or overlap.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.expected import Refused

LARGEST = 4096  # edge [texels] of a picture, at most
SMALLEST_SQUARE, LARGEST_SQUARE = 1, 11  # edges [powers of two, texels] of squares
INSET = 1.45  # distance [texels] between a square's border and its triangle's corners
MOST_TEXELS = LARGEST**2 // 4  # number [texels] of all squares, at most, but for the smallest ones
FIRST_TEXELS = 512**2  # number [texels] that a mesh of few triangles gets at first
PER_TRIANGLE = 32  # number [texels] that each of many triangles gets at first, on average


@dataclass(frozen=True)
class Squares:
    """``bake``: where Cycles writes; ``lookup``: where to read; both (n, 3, 2) float64 in [0, 1].

    A square of two texels holds one color, read from the center of its first texel.
    """

    size: int
    bake: np.ndarray
    lookup: np.ndarray


def first_texels(triangles: int) -> int:
    """Number of texels of a picture of so many ``triangles``, at first."""
    return min(max(FIRST_TEXELS, PER_TRIANGLE * triangles), MOST_TEXELS)


def make_squares(area: np.ndarray, texels: int) -> Squares:
    """Squares of about so many ``texels`` for triangles of these areas ``area`` (n,), larger ones for larger
    triangles. Raises Refused where they do not fit into an image of LARGEST texels."""
    share = area / max(float(area.sum()), 1e-300)
    power = np.floor(0.5 * np.log2(np.maximum(share * texels, 1e-9)))
    power = np.clip(power, SMALLEST_SQUARE, LARGEST_SQUARE).astype(np.int64)
    while _side(power) > LARGEST and power.max() > SMALLEST_SQUARE:
        power = np.maximum(power - 1, SMALLEST_SQUARE)
    size = _side(power)
    if size > LARGEST:
        raise Refused(
            f"{len(area)} triangles with a material that Cycles has to evaluate need an image of "
            f"{size} texels, above {LARGEST}; simplify the material or the mesh"
        )
    order = np.argsort(-power, kind="stable")
    texels = 4 ** power[order]
    origin = np.empty((len(area), 2))
    origin[order] = _unweave(np.concatenate([[0], np.cumsum(texels)[:-1]]))
    edge = (2.0**power)[:, None, None]
    low = np.where(edge > 2.0, INSET, 0.3)
    high = np.where(edge > 2.0, edge - INSET, 1.4)
    corner = np.array(((0, 0), (1, 0), (0, 1)))[None]
    bake = origin[:, None] + np.where(corner, high, low)
    lookup = np.where(edge > 2.0, bake, origin[:, None] + 0.5)
    return Squares(size, bake / size, lookup / size)


def _side(power: np.ndarray) -> int:
    """The smallest power of two whose square holds all squares."""
    total = int(np.sum(4**power))
    return max(4, 1 << int(np.ceil(np.log2(max(total, 1)) / 2.0)))


def _unweave(code: np.ndarray) -> np.ndarray:
    """(n, 2) column and row of places along the Z curve."""
    result = np.zeros((len(code), 2), np.int64)
    for bit in range(16):
        result[:, 0] |= ((code >> (2 * bit)) & 1) << bit
        result[:, 1] |= ((code >> (2 * bit + 1)) & 1) << bit
    return result


def texels_in(squares: Squares, which: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Rows and columns of texels well inside the triangles ``which`` (n,) bool, a pair of arrays for each
    size of square."""
    corner = np.floor(squares.bake[which, 0] * squares.size + 1e-6).astype(np.int64)
    edge = np.rint((squares.bake[which, 1, 0] - squares.bake[which, 0, 0]) * squares.size + 2 * INSET)
    edge = edge.astype(np.int64)
    result = []
    for size in np.unique(edge):
        first = corner[edge == size]
        if size <= 4:
            result.append((first[:, 1], first[:, 0]))
            continue
        column, row = np.meshgrid(np.arange(size), np.arange(size))
        inside = column + row <= size - 2 * INSET - 2
        result.append((first[:, 1:] + row[inside], first[:, :1] + column[inside]))
    return result
