"""Elements: the pieces of surface on which radiosity is constant, and the map from hits to them.

Each triangle carries a barycentric grid of *cells*, and a cell may carry a finer grid in turn. A
cell without one belongs to an element; a large triangle has many cells, each an element of its own,
while tiny triangles have one cell each and share an element. So elements follow area and light, not
tessellation, and a hit (triangle, u, v) finds its element by table lookups.

Every element has two sides: 2·element for the front, 2·element + 1 for the back; cells likewise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.clusters import cubes, facings, labels, octants
from ..geometry.grids import cell_in_grid, grid_cells, inside, quarter_at, quarters
from ..geometry.planar import cell_areas
from ..geometry.triangles import OFFSET, Geometry

MAX_GRID = 128  # number [cells along a triangle's edge] before refinement, at most
LONG = 4.0  # length [of an element's size]: a small triangle that is longer is a sliver
MAX_SLIVER_GRID = 32  # number [cells along a sliver], at most
SLIVER_CELLS = 500_000  # number [cells of all slivers], about, at most: of more slivers the grids are coarser
BAND = OFFSET  # distance [unit box] from a cut: nearer to it, the side of a hit is unknown
INSIDE = -1  # code [``Elements.element``]: -1 - k tells that grid k divides the cell further


@dataclass(frozen=True)
class Elements:
    """Grids of cells; grid t < n_triangles covers triangle t, later ones divide single cells."""

    grid: np.ndarray  # (n_grids,) int32: cells along each edge
    base: np.ndarray  # (n_grids,) int32: first cell of each grid
    element: np.ndarray  # (n_cells,) int32: the cell's element, or INSIDE - grid
    triangle: np.ndarray  # (n_cells,) int32: the triangle it lies in
    corners: np.ndarray  # (n_cells, 3, 2) float32 barycentric, in the triangle
    count: int
    depth: int  # grids a lookup may go through
    divided: bool  # some triangle has more than one cell in its own grid
    cut: np.ndarray  # (n_grids - n_triangles, 3) float32: of those of n = 0, see ``cut_cells``
    has_cuts: bool

    def areas(self, geometry: Geometry, cell: np.ndarray) -> np.ndarray:
        """(k,) float64 normalized areas of cells (k,); of pieces, of what they were cut from."""
        corners = self.corners[cell].astype(float)
        return cell_areas(corners, False) * geometry.area[self.triangle[cell]]

    def lengths(self, geometry: Geometry) -> np.ndarray:
        """(count,) float32 edges of squares as large as the elements [unit box]."""
        some = np.flatnonzero(self.element >= 0)
        total = np.bincount(self.element[some], self.areas(geometry, some), self.count)
        return np.sqrt(total).astype(np.float32)

    def sides_of(self, cell_sides: np.ndarray) -> np.ndarray:
        """(n,) int64 sides of elements, 2·element + back, of sides (n,) int of cells, 2·cell + back."""
        return 2 * self.element[cell_sides >> 1].astype(np.int64) + (cell_sides & 1)

    def shared(self) -> np.ndarray:
        """(n_cells,) bool: the cell belongs to an element of several cells."""
        leaf = np.flatnonzero(self.element >= 0)
        owner = self.element[leaf]
        result = np.zeros(len(self.element), bool)
        result[leaf] = np.bincount(owner, minlength=1)[owner] > 1
        return result

    def pieces(self) -> np.ndarray:
        """(n_cells,) bool: the cell is one side of a cut, and its corners are those of the cell that was cut."""
        first = self.base[self.grid == 0]
        result = np.zeros(len(self.element), bool)
        result[first] = result[first + 1] = True
        return result

    def cells_at(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Undivided cells (n,) int32 at barycentric (u, v) of triangles; -1 counts as 0. The number of
        cells stands for a place within BAND of a cut, on neither side of it."""
        triangle = triangle.astype(np.intp)
        cells = np.take(self.base, triangle, mode="clip")
        n = np.take(self.grid, triangle, mode="clip")
        if self.divided:
            offset, inverted, u, v = cell_in_grid(n, u, v)
            cells += offset
        if self.depth == 1:
            return cells
        inner = np.take(self.element, cells)
        some = np.flatnonzero(inner <= INSIDE)
        inner, u, v = inner[some], u[some], v[some]
        if self.divided:
            u, v = inside(inverted[some], u, v)
        while len(some):
            finer = np.subtract(INSIDE, inner, dtype=np.intp)
            offset, x, y = quarter_at(u, v)
            found = np.take(self.base, finer)
            found += offset
            if self.has_cuts:
                self._choose_side(finer, u, v, found, x, y)
            cells[some] = found
            inner = np.take(self.element, found, mode="clip")
            below = inner <= INSIDE
            if self.has_cuts:
                below &= found < len(self.element)
            below = np.flatnonzero(below)
            some, inner, u, v = some[below], inner[below], x[below], y[below]
        return cells

    def _choose_side(
        self, finer: np.ndarray, u: np.ndarray, v: np.ndarray, found: np.ndarray, x: np.ndarray,
        y: np.ndarray,
    ) -> None:
        """Where grids are cuts, set ``found`` to the cell on the side of (u, v), which are also
        its own (x, y)."""
        some = np.flatnonzero(np.take(self.grid, finer) == 0)
        u, v, grid = u[some], v[some], finer[some]
        line = np.take(self.cut, grid - (len(self.grid) - len(self.cut)), axis=0)
        height = line[:, 0] + u * line[:, 1] + v * line[:, 2]
        found[some] = self.base[grid] + (height > 0)
        found[some[np.abs(height) < BAND]] = len(self.element)
        x[some], y[some] = u, v

    def values_of_cells(self, values: np.ndarray, nothing: bool | float) -> np.ndarray:
        """(2 n_cells, ...) from values of element sides (2 n_elements, ...), for lookups by cell
        side; ``nothing`` for divided cells."""
        owner = np.where(self.element >= 0, self.element, 0)
        pairs = values.reshape((-1, 2) + values.shape[1:])[owner]
        pairs[self.element < 0] = nothing
        return pairs.reshape((-1,) + values.shape[1:])


def build_elements(geometry: Geometry, group: np.ndarray, target: int) -> Elements:
    """About ``target`` elements of equal area; ``group`` (n_triangles,) int32 are not mixed.

    Triangles above the mean element area are cut into n² cells. Smaller ones are joined with
    others of the same group whose centroids share a cube of that size and whose normals point
    alike. Of small but long ones (slivers) the cells are joined so.
    """
    total = geometry.area.sum()
    size = np.sqrt(total / max(target, 1)) if total > 0 else 1.0
    grid = np.clip(np.rint(np.sqrt(geometry.area) / size), 1, MAX_GRID).astype(np.int32)
    large = grid > 1
    grid = np.maximum(grid, _along_slivers(geometry, ~large, size))
    cells = grid.astype(np.int64) ** 2
    base = (np.cumsum(cells) - cells).astype(np.int32)
    triangle = np.repeat(np.arange(len(grid), dtype=np.int32), cells)
    corners = np.empty((len(triangle), 3, 2), np.float32)
    for n in np.unique(grid):
        some = np.flatnonzero(grid == n)
        corners[base[some][:, None] + np.arange(int(n) ** 2)] = grid_cells(int(n))
    large_cells = large[triangle]
    element = np.empty(len(large_cells), np.int32)
    element[large_cells] = np.arange(large_cells.sum())
    small = np.flatnonzero(~large_cells)
    center = _centers(geometry, triangle[small], corners[small])
    number, clusters = _clusters(geometry, triangle[small], center, group[triangle[small]], size)
    element[small] = number + large_cells.sum()
    count = int(large_cells.sum()) + clusters
    none = np.zeros((0, 3), np.float32)
    divided = bool((grid > 1).any())
    return Elements(grid, base, element, triangle, corners, count, 1, divided, none, False)


def _along_slivers(geometry: Geometry, small: np.ndarray, size: float) -> np.ndarray:
    """(n_triangles,) int32: cells along the edges of ``small`` triangles much longer than ``size``,
    so that cells are not; 1 elsewhere. Fewer where there are very many."""
    third = geometry.e2 - geometry.e1
    edges = np.stack([np.einsum("ij,ij->i", e, e) for e in (geometry.e1, geometry.e2, third)])
    length = np.sqrt(edges.max(axis=0, initial=0))
    long = small & (length > LONG * size)
    most = np.clip(np.sqrt(SLIVER_CELLS / max(long.sum(), 1)), 1, MAX_SLIVER_GRID)
    return np.where(long, np.minimum(np.ceil(length / size), np.floor(most)), 1).astype(np.int32)


def _centers(geometry: Geometry, triangle: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(n, 3) positions of the middles of cells (n, 3, 2) of triangles (n,)."""
    return geometry.at(triangle, corners.mean(axis=1, dtype=float))


def _clusters(
    geometry: Geometry, triangle: np.ndarray, centroid: np.ndarray, group: np.ndarray, size: float
) -> tuple[np.ndarray, int]:
    """Labels (n,) int and their number for cells of triangles (n,): by group (n,), cube of
    ``centroid`` (n, 3), and normal."""
    found = labels(group, cubes(centroid, size, -0.5), facings(geometry.normal[triangle]))
    return found.astype(np.int32), int(found.max(initial=-1)) + 1


def refine(geometry: Geometry, elements: Elements, chosen: np.ndarray) -> Elements:
    """Divide the elements ``chosen`` (k,) int: a single cell into four, several cells (a cluster
    of small triangles) by the octants around their mean. The numbers of divided elements are not
    used again."""
    divided = np.zeros(elements.count, bool)
    divided[chosen] = True
    leaf = np.flatnonzero(elements.element >= 0)
    leaf = leaf[divided[elements.element[leaf]]]
    owner = elements.element[leaf]
    several = np.bincount(owner, minlength=1)[owner] > 1
    element = elements.element.copy()
    joined = leaf[several]
    center = _centers(geometry, elements.triangle[joined], elements.corners[joined])
    parts = labels(octants(center, owner[several]))
    element[joined] = elements.count + parts
    count = elements.count + int(parts.max(initial=-1)) + 1
    leaf = leaf[~several]
    fresh = np.arange(len(leaf))
    element[leaf] = INSIDE - (len(elements.grid) + fresh)
    parts = count + np.arange(4 * len(leaf))
    return Elements(
        grid=np.concatenate([elements.grid, np.full(len(leaf), 2, np.int32)]),
        base=np.concatenate([elements.base, len(element) + 4 * fresh]).astype(np.int32),
        element=np.concatenate([element, parts]).astype(np.int32),
        triangle=np.concatenate([elements.triangle, np.repeat(elements.triangle[leaf], 4)]),
        corners=np.concatenate([elements.corners, quarters(elements.corners[leaf])]),
        count=count + 4 * len(leaf),
        depth=elements.depth + 1,
        divided=elements.divided,
        cut=np.concatenate([elements.cut, np.zeros((len(leaf), 3), np.float32)]),
        has_cuts=elements.has_cuts,
    )


def cut_cells(elements: Elements, cells: np.ndarray, height: np.ndarray) -> Elements:
    """Divide different, undivided ``cells`` (k,) int by lines: cell k into n + 2k where ``height``
    is below 0 and n + 2k + 1 where it is above, n cells before. ``height`` (k, 3) are the values
    at the cell's corners, linear between. Parts of a cell that was an element of its own are
    elements of their own; others stay in theirs. Within BAND of a line lies nowhere."""
    fresh, start = np.arange(len(cells)), len(elements.element)
    line = np.stack([height[:, 0], height[:, 1] - height[:, 0], height[:, 2] - height[:, 0]], 1)
    number = np.bincount(elements.element[elements.element >= 0], minlength=elements.count)
    owner = np.repeat(elements.element[cells], 2)
    alone = np.flatnonzero(number[owner] == 1)
    owner[alone] = elements.count + np.arange(len(alone))
    element = elements.element.copy()
    element[cells] = INSIDE - (len(elements.grid) + fresh)
    return replace(
        elements,
        grid=np.concatenate([elements.grid, np.zeros(len(cells), np.int32)]),
        base=np.concatenate([elements.base, start + 2 * fresh]).astype(np.int32),
        element=np.concatenate([element, owner]).astype(np.int32),
        triangle=np.concatenate([elements.triangle, np.repeat(elements.triangle[cells], 2)]),
        corners=np.concatenate([elements.corners, np.repeat(elements.corners[cells], 2, axis=0)]),
        count=elements.count + len(alone),
        depth=elements.depth + 1,
        cut=np.concatenate([elements.cut, line.astype(np.float32)]),
        has_cuts=True,
    )
