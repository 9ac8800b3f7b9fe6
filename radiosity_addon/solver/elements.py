"""Elements: the pieces of surface on which radiosity is constant, and the map from hits to them.

Depends on ``geometry``. Each triangle carries a uniform barycentric grid of
*cells*; an element is a group of cells. A large triangle has many cells, each an element of its
own; tiny triangles have one cell each and share an element. So elements follow area, not
tessellation, and a hit (triangle, u, v) finds its element by one table lookup.

Every element has two sides: side index 2·element for the front, 2·element + 1 for the back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import Geometry

MAX_GRID = 256  # cells along a triangle's edge


@dataclass(frozen=True)
class Elements:
    """The table: ``element[base[t] + cell]`` for cell of triangle t."""

    grid: np.ndarray  # (n_triangles,) int32: cells along each edge
    base: np.ndarray  # (n_triangles + 1,) int64: first cell of each triangle
    element: np.ndarray  # (n_cells,) int32
    count: int

    @property
    def miss(self) -> int:
        """The cell side that stands for nothing hit."""
        return 2 * len(self.element)

    def sides_of(self, cell_sides: np.ndarray) -> np.ndarray:
        """Element sides of cell sides, none of which may be the miss."""
        return 2 * self.element[cell_sides >> 1].astype(np.int64) + (cell_sides & 1)

    def cells_at(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Cells (n,) int64 at barycentric (u, v) of triangles; triangle must be >= 0."""
        grid = self.grid[triangle]
        cells = self.base[triangle]
        split = np.flatnonzero(grid > 1)
        if len(split) == len(grid):
            return cells + _cell_in_grid(grid, u, v)
        cells[split] += _cell_in_grid(grid[split], u[split], v[split])
        return cells


def _cell_in_grid(n: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Index of the cell at (u, v) in a grid of n cells along each edge, row by row.

    Row i holds 2(n−i)−1 cells, upright and inverted ones in turn.
    """
    nf = n.astype(np.float32)
    x, y = u * nf, v * nf
    i = np.clip(x.astype(np.int32), 0, n - 1)
    j = np.clip(y.astype(np.int32), 0, n - 1 - i)
    inverted = ((x - i) + (y - j) > 1) & (j < n - 1 - i)
    return i * (2 * n - i) + 2 * j + inverted


def build_elements(geometry: Geometry, group: np.ndarray, target: int) -> Elements:
    """About ``target`` elements of equal area; ``group`` (n_triangles,) int32 are not mixed.

    Triangles above the mean element area are cut into 4^k cells. Smaller ones are joined with
    others of the same group whose centroids share a cube of that size and whose normals share
    an octant-like direction class.
    """
    total = geometry.area.sum()
    size = np.sqrt(total / max(target, 1)) if total > 0 else 1.0
    level = np.ceil(np.log2(np.maximum(np.sqrt(geometry.area) / size, 1e-9)))
    grid = np.clip(2.0**level, 1, MAX_GRID).astype(np.int32)
    base = np.concatenate([[0], np.cumsum(grid.astype(np.int64) ** 2)])
    element = np.empty(base[-1], np.int32)
    whole = np.repeat(grid > 1, grid.astype(np.int64) ** 2)
    element[whole] = np.arange(whole.sum())
    small = np.flatnonzero(grid == 1)
    labels, clusters = _clusters(geometry, small, group[small], size)
    element[base[small]] = labels + whole.sum()
    return Elements(grid, base, element, int(whole.sum()) + clusters)


def _clusters(geometry: Geometry, small: np.ndarray, group: np.ndarray, size: float):
    """Labels (len(small),) int and their number: by group, cube of centroid, and normal."""
    if len(small) == 0:
        return np.zeros(0, np.int32), 0
    centroid = geometry.p0[small] + (geometry.e1[small] + geometry.e2[small]) / 3
    cube = np.floor((centroid + 0.5) / size).astype(np.int64)
    direction = np.rint(geometry.normal[small] * 1.5).astype(np.int64) + 2
    span = int(np.ceil(1 / size)) + 2
    key = group.astype(np.int64)
    for column, base in ((cube, span), (direction, 5)):
        for axis in range(3):
            key = key * base + column[:, axis]
    _, labels = np.unique(key, return_inverse=True)
    return labels.reshape(-1).astype(np.int32), int(labels.max()) + 1
