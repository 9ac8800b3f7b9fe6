"""Footprints: receivers placed in space. Depends on ``geometry``, ``receivers``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import OFFSET, Geometry
from .receivers import Receivers


@dataclass(frozen=True)
class Footprints:
    """Cells in space: origin + a·u + b·v. Cell ``start[i]:start[i+1]`` belong to footprint i."""

    origin: np.ndarray  # (n_cells, 3) float32 normalised, lifted off the surface
    u: np.ndarray  # (n_cells, 3)
    v: np.ndarray  # (n_cells, 3)
    normal: np.ndarray  # (n_cells, 3) float32 unit
    triangle: np.ndarray  # (n_cells,) int32
    corners: np.ndarray  # (n_cells, 3, 2) float32 barycentric: origin, step along u, along v
    square: np.ndarray  # (n_cells,) bool
    start: np.ndarray  # (count + 1,) int64
    cumulative: np.ndarray  # (n_cells + 1,) float64: areas of the cells before

    @property
    def count(self) -> int:
        return len(self.start) - 1

    @property
    def area(self) -> np.ndarray:
        """(count,) float64 normalised."""
        return np.diff(self.cumulative[self.start])

    def mean_of_cells(self, values: np.ndarray) -> np.ndarray:
        """(count, 3) means over each footprint, by area, of values (n_cells, 3) of its cells."""
        if self.count == len(values):
            return values
        weight = np.diff(self.cumulative)
        sums = np.add.reduceat(weight[:, None] * values, self.start[:-1], axis=0)
        return sums / self.area[:, None]

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """(count, 3) mean position and (count, 3) mean normal (not unit) over each footprint."""
        half = np.where(self.square, 0.5, 1 / 3)[:, None]
        center = self.origin + half * (self.u + self.v)
        return self.mean_of_cells(center), self.mean_of_cells(self.normal)


def build_footprints(geometry: Geometry, receivers: Receivers) -> Footprints:
    """Place receivers in space."""
    triangle = receivers.triangle
    shrink = geometry.shrink[triangle][:, None, None]
    corners = receivers.corners * (1 - shrink) + shrink / 3
    e1, e2 = geometry.e1[triangle], geometry.e2[triangle]
    edge_u, edge_v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = geometry.normal[triangle]
    share = np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0])
    area = share * geometry.area[triangle] * np.where(receivers.square, 2.0, 1.0)
    start = np.searchsorted(receivers.receiver, np.arange(receivers.count + 1))
    return Footprints(
        origin=(geometry.at(triangle, corners[:, 0]) + OFFSET * normal).astype(np.float32),
        u=(edge_u[:, :1] * e1 + edge_u[:, 1:] * e2).astype(np.float32),
        v=(edge_v[:, :1] * e1 + edge_v[:, 1:] * e2).astype(np.float32),
        normal=normal.astype(np.float32),
        triangle=triangle,
        corners=np.stack([corners[:, 0], edge_u, edge_v], 1).astype(np.float32),
        square=receivers.square,
        start=start,
        cumulative=np.concatenate([[0.0], np.cumsum(area)]),
    )
