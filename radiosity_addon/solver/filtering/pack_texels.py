"""Pack texels: an object's texels in one small rectangle, wherever in an image they lie.

In an atlas the islands of one object lie among those of all others, and the rectangle around them is about the whole
image. Pictures of such rectangles, one for each object, would hold next to nothing.
"""

from __future__ import annotations

import numpy as np

BLOCK = 8  # edge [texels] of blocks: islands in blocks that touch stay beside each other
FULL = 0.5  # share [of the rectangle] with texels: from it on they stay where they are


def pack_texels(row: np.ndarray, column: np.ndarray, gap: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (n,) int >= 0 of texels, moved so that few are empty in the rectangle from (0, 0) around them. Texels of
    blocks that touch, at their corners too, move alike; others have a ``gap`` [texels] between them."""
    shape = row.max() + 1, column.max() + 1
    if len(row) >= FULL * shape[0] * shape[1]:
        return row, column
    piece = _pieces(row // BLOCK, column // BLOCK)
    corners, sizes = zip(*(_extents(axis, piece) for axis in (row, column)))
    shelved = _on_shelves(*(size + gap for size in sizes))
    moved = tuple(
        axis + (new - old)[piece] for axis, old, new in zip((row, column), corners, shelved)
    )
    smaller = np.prod([axis.max() + 1.0 for axis in moved]) < np.prod(shape, dtype=float)
    return moved if smaller else (row, column)


def _pieces(row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """(n,) int from 0 on: the piece of each, of blocks at ``row`` and ``column`` (n,) that touch."""
    from scipy.ndimage import label  # which takes a sixth of a second to import

    picture = np.zeros((row.max() + 1, column.max() + 1), bool)
    picture[row, column] = True
    return label(picture, np.ones((3, 3)))[0][row, column] - 1


def _extents(axis: np.ndarray, piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least coordinate (k,) of each piece along an ``axis`` (n,), and its size (k,)."""
    low = np.full(piece.max() + 1, axis.max())
    high = np.zeros_like(low)
    np.minimum.at(low, piece, axis)
    np.maximum.at(high, piece, axis)
    return low, high - low + 1


def _on_shelves(height: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (k,) of rectangles beside each other, the tallest first, on shelves one over the other (next-fit
    decreasing height: Coffman et al. 1980)."""
    length = max(int(np.sqrt(height @ width)), int(width.max()))
    row, column = np.zeros((2, len(height)), int)
    low = left = tallest = 0
    for k in np.argsort(-height, kind="stable"):
        if left + width[k] > length:
            low, left, tallest = low + tallest, 0, 0
        row[k], column[k] = low, left
        left, tallest = left + width[k], max(tallest, height[k])
    return row, column
