"""Grids: triangles cut into cells of equal shape, and the cell that a place lies in.

A grid of n cells along each edge has n² of them: row i holds 2(n−i)−1, upright
and inverted ones in turn. Places are barycentric (u, v).
"""

from __future__ import annotations

import numpy as np


def cell_in_grid(
    n: np.ndarray, u: np.ndarray, v: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Index of the cell at (u, v) in a grid of n cells along each edge, whether it is inverted, and
    (u, v) from the corner of the pair of cells."""
    size = n.astype(np.float32)
    x, y = u * size, v * size
    left = n - 1
    i = within(x, left)
    left -= i
    j = within(y, left)
    x -= i.astype(np.float32)  # integers would take the long way by float64
    y -= j.astype(np.float32)
    inverted = x + y > 1
    inverted &= j < left
    index = 2 * n
    index -= i
    index *= i
    j *= 2
    index += j
    index += inverted
    return index, inverted, x, y


def quarter_at(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index of the cell at (u, v) in a grid of 2 cells along each edge, and (u, v) inside it."""
    x, y = 2 * u, 2 * v
    first, second = x >= 1, y >= 1
    second &= ~first
    inverted = x + y > 1
    inverted &= ~(first | second)
    index = 3 * first.view(np.int8)
    index += 2 * second.view(np.int8)
    index += inverted
    x -= first
    y -= second
    return index, *inside(inverted, x, y)


def inside(inverted: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(u, v) inside cells, from the corners of their pairs."""
    flip = inverted.astype(np.float32)
    return np.abs(flip - x), np.abs(flip - y)


def within(coordinate: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(n,) int32 of places in [0, last]; thin triangles may give others."""
    found = coordinate.astype(np.int32)
    np.minimum(found, last, out=found)
    return np.maximum(found, 0, out=found)


def grid_cells(n: int, dtype: np.typing.DTypeLike = np.float32) -> np.ndarray:
    """(n², 3, 2) corners of a grid's cells in [0, 1]², in the order of their indices: where u = v = 0, u = 1 and
    v = 1 in the cell."""
    cells = []
    for i in range(n):
        j = np.arange(n - i)
        i0, i1, j1 = np.full(n - i, i), np.full(n - i, i + 1), j + 1
        upright = np.stack([np.stack([i0, j], 1), np.stack([i1, j], 1), np.stack([i0, j1], 1)], 1)
        inverted = np.stack([np.stack([i1, j1], 1), np.stack([i0, j1], 1), np.stack([i1, j], 1)], 1)
        cells.append(np.stack([upright, inverted], 1).reshape(-1, 3, 2)[: 2 * (n - i) - 1])
    return (np.concatenate(cells) / n).astype(dtype)


def quarters(corners: np.ndarray) -> np.ndarray:
    """(4 k, 3, 2) corners of the four cells inside each of k cells (k, 3, 2), of their precision."""
    origin, steps = corners[:, 0], corners[:, 1:] - corners[:, :1]
    inner = grid_cells(2)
    placed = origin[:, None, None] + np.einsum("qcs,ksd->kqcd", inner, steps)
    return placed.reshape(-1, 3, 2).astype(corners.dtype)
