"""Footprints: receivers placed in space."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..ragged import ragged_ranges
from ..receivers import Receivers
from ..workers.parallel import ranges
from .cell_shading import CellShading, build_cell_shading
from .planar import cell_areas
from .triangles import OFFSET, Geometry
from .vectors import unit_rows

BAND = 1 << 15  # number [cells] at a time: bounds the memory of their float64 arrays


@dataclass(frozen=True)
class Footprints:
    """Cells in space: origin + a·u + b·v. Cell ``start[i]:start[i+1]`` belong to footprint i."""

    origin: np.ndarray  # (n_cells, 3) float32 normalized, lifted off the surface
    u: np.ndarray  # (n_cells, 3)
    v: np.ndarray  # (n_cells, 3)
    normal: np.ndarray  # (n_cells, 3) float32 unit
    triangle: np.ndarray  # (n_cells,) int32
    corners: np.ndarray  # (n_cells, 3, 2) float32 barycentric: origin, step along u, along v
    square: np.ndarray  # (n_cells,) bool
    start: np.ndarray  # (count + 1,) int64
    cumulative: np.ndarray  # (n_cells + 1,) float64: areas of the cells before
    shading: CellShading | None = None  # None: light counts by ``normal``

    @property
    def count(self) -> int:
        return len(self.start) - 1

    @property
    def area(self) -> np.ndarray:
        """(count,) float64 normalized."""
        return np.diff(self.cumulative[self.start])

    def mean_of_cells(self, values: np.ndarray) -> np.ndarray:
        """(count, c) means over each footprint, by area, of values (n_cells, c) of its cells."""
        if self.count == len(values):
            return values
        number = np.diff(self.start)
        result = values[self.start[:-1]]
        several = np.flatnonzero(number > 1)
        cells = np.flatnonzero(np.repeat(number > 1, number))
        starts = np.cumsum(number[several]) - number[several]
        weight = np.diff(self.cumulative)[cells]
        sums = np.add.reduceat(weight[:, None] * values[cells], starts, axis=0)
        result[several] = sums / np.add.reduceat(weight, starts)[:, None]
        return result

    def cells_of(self, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(pair, cell), (m,) int each: all cells of the footprints ``chosen`` (k,) int, and of each the number among
        the k of the footprint that it belongs to."""
        pair, offset = ragged_ranges(np.diff(self.start)[chosen])
        return pair, self.start[chosen][pair] + offset

    def grouped(self, group: np.ndarray) -> Footprints:
        """Footprints 0, 1, ... of the cells with these numbers in ``group`` (n_cells,) int, without those below 0, and
        without shading."""
        cells = np.argsort(group, kind="stable")
        cells = cells[np.searchsorted(group[cells], 0) :]
        start = np.searchsorted(group[cells], np.arange(int(group.max(initial=-1)) + 2))
        return replace(self, shading=None)._of(cells, start)

    def take(self, chosen: np.ndarray) -> Footprints:
        """The footprints ``chosen`` (k,) int, in that order."""
        start = np.concatenate([[0], np.cumsum(np.diff(self.start)[chosen])])
        return self._of(self.cells_of(chosen)[1], start)

    def _of(self, cells: np.ndarray, start: np.ndarray) -> Footprints:
        """Footprints of these ``cells`` (m,) int, of which ``start[i]:start[i+1]`` belong to footprint i."""
        area = np.diff(self.cumulative)[cells]
        return Footprints(
            self.origin[cells], self.u[cells], self.v[cells], self.normal[cells],
            self.triangle[cells], self.corners[cells], self.square[cells], start,
            np.concatenate([[0.0], np.cumsum(area)]), self.shading and self.shading.take(cells),
        )  # fmt: skip

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """(count, 3) mean position and (count, 3) mean normal (not unit) over each footprint;
        float32."""
        half = np.where(self.square, np.float32(0.5), np.float32(1 / 3))[:, None]
        center = self.origin + half * (self.u + self.v)
        return self.mean_of_cells(center), self.mean_of_cells(self.normal)

    def facing(self) -> tuple[np.ndarray, np.ndarray | None]:
        """(count, 3) float32 mean normal by which light counts, and (count,) bool where it is not
        the triangles'; None where there is no shading."""
        if self.shading is None:
            return self.middle()[1], None
        return unit_rows(self.mean_of_cells(self.shading.normal)), self.turned()

    def turned(self) -> np.ndarray | None:
        """(count,) bool: light counts by a normal that is not the triangles'; None where there is no
        shading."""
        if self.shading is None:
            return None
        return np.add.reduceat(self.shading.turned, self.start[:-1]) > 0


def build_footprints(geometry: Geometry, receivers: Receivers) -> Footprints:
    """Place receivers in space."""
    n = len(receivers.triangle)
    origin, u, v, normal = (np.empty((n, 3), np.float32) for _ in range(4))
    corners, area = np.empty((n, 3, 2), np.float32), np.empty(n)
    for band in ranges(n, BAND):  # in float64, which of all together would be a lot
        triangle, barycentric = receivers.triangle[band], receivers.corners[band]
        shrink = geometry.shrink[triangle][:, None, None]
        barycentric = barycentric * (1 - shrink) + shrink / 3
        e1, e2 = geometry.e1[triangle], geometry.e2[triangle]
        first, edge_u, edge_v = barycentric[:, 0], barycentric[:, 1] - barycentric[:, 0], barycentric[:, 2] - barycentric[:, 0]
        normal[band] = up = geometry.normal[triangle]
        origin[band] = geometry.at(triangle, first) + OFFSET * up
        u[band] = edge_u[:, :1] * e1 + edge_u[:, 1:] * e2
        v[band] = edge_v[:, :1] * e1 + edge_v[:, 1:] * e2
        corners[band] = np.stack([first, edge_u, edge_v], 1)
        area[band] = cell_areas(barycentric, receivers.square[band]) * geometry.area[triangle]
    start = np.searchsorted(receivers.receiver, np.arange(receivers.count + 1))
    cumulative = np.concatenate([[0.0], np.cumsum(area)])
    return Footprints(
        origin, u, v, normal, receivers.triangle, corners, receivers.square, start, cumulative,
        build_cell_shading(geometry, receivers),
    )
