"""Footprints: receivers and elements in space, and sample points spread over them.

Depends on ``geometry``, ``receivers``, ``sampling``. A footprint's points are stratified over its
area; all light, direct and gathered, is averaged over them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import OFFSET, Geometry
from .receivers import Receivers
from .sampling import GROUPS, sobol, tangent_frames, uniform

# Points keep this share of a triangle away from its edges, so that rounding to float32 never puts
# a ray's origin behind the neighbouring wall.
SHRINK = 1e-5


@dataclass(frozen=True)
class Footprints:
    """Cells in space: origin + a·u + b·v. Cell ``start[i]:start[i+1]`` belong to footprint i."""

    origin: np.ndarray  # (n_cells, 3) float64 normalised
    u: np.ndarray  # (n_cells, 3)
    v: np.ndarray  # (n_cells, 3)
    normal: np.ndarray  # (n_cells, 3) float64 unit, on the side that is lit
    triangle: np.ndarray  # (n_cells,) int32
    corners: np.ndarray  # (n_cells, 3, 2) barycentric origin, +U, +V
    square: np.ndarray  # (n_cells,) bool
    start: np.ndarray  # (count + 1,) int64
    cumulative: np.ndarray  # (n_cells + 1,) float64: areas of the cells before
    turn: np.ndarray  # (count, 3) float32: random shift of positions and turn of directions

    @property
    def count(self) -> int:
        return len(self.start) - 1

    @property
    def area(self) -> np.ndarray:
        """(count,) float64 normalised."""
        return np.diff(self.cumulative[self.start])

    def subset(self, keep: np.ndarray) -> Footprints:
        """The footprints of indices ``keep``, in that order."""
        sizes = self.start[keep + 1] - self.start[keep]
        start = np.concatenate([[0], np.cumsum(sizes)])
        cells = np.repeat(self.start[keep] - start[:-1], sizes) + np.arange(start[-1])
        areas = np.diff(self.cumulative)[cells]
        return Footprints(
            *(getattr(self, name)[cells] for name in _CELL_ARRAYS),
            start=start,
            cumulative=np.concatenate([[0.0], np.cumsum(areas)]),
            turn=self.turn[keep],
        )


_CELL_ARRAYS = ("origin", "u", "v", "normal", "triangle", "corners", "square")


def build_footprints(
    geometry: Geometry, receivers: Receivers, seed: int, stream: int, back: np.ndarray | None = None
) -> Footprints:
    """Place receivers in space. ``back`` (count,) bool: those lit from the triangle's back."""
    corners = receivers.corners * (1 - SHRINK) + SHRINK / 3
    triangle = receivers.triangle
    e1, e2 = geometry.e1[triangle], geometry.e2[triangle]
    edge_u, edge_v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = geometry.normal[triangle]
    if back is not None:
        normal = np.where(back[receivers.receiver][:, None], -normal, normal)
    share = np.abs(edge_u[:, 0] * edge_v[:, 1] - edge_u[:, 1] * edge_v[:, 0])
    area = share * geometry.area[triangle] * np.where(receivers.square, 2.0, 1.0)
    start = np.searchsorted(receivers.receiver, np.arange(receivers.count + 1))
    return Footprints(
        origin=geometry.at(triangle, corners[:, 0]) + OFFSET * normal,
        u=edge_u[:, :1] * e1 + edge_u[:, 1:] * e2,
        v=edge_v[:, :1] * e1 + edge_v[:, 1:] * e2,
        normal=normal,
        triangle=triangle,
        corners=corners,
        square=receivers.square,
        start=start,
        cumulative=np.concatenate([[0.0], np.cumsum(area)]),
        turn=uniform((receivers.count, 3), seed, stream),
    )


@dataclass(frozen=True)
class Points:
    """``per`` points on each of R footprints, point-major so that rays stay coherent."""

    position: np.ndarray  # (per, R, 3) float32, lifted off the surface
    normal: np.ndarray  # (per, R, 3) float32
    cell: np.ndarray  # (per, R) int64
    place: np.ndarray  # (per, R, 2) float32: where in the cell


def sample_points(footprints: Footprints, chosen: np.ndarray, per: int, *key: int) -> Points:
    """``per`` points, stratified by area, on each of the ``chosen`` footprints (R,) int."""
    table = sobol(per, 3, *key).astype(np.float32)
    shift = footprints.turn[chosen, :2]
    place = (table[:, None, :2] + shift[None]) % 1.0
    first, last = footprints.start[chosen], footprints.start[chosen + 1]
    cell = np.broadcast_to(first, (per, len(chosen)))
    several = np.flatnonzero(last - first > 1)
    if len(several):
        cell = cell.copy()
        low = footprints.cumulative[first[several]]
        high = footprints.cumulative[last[several]]
        level = (table[:, 2:] + footprints.turn[chosen[several], 2]) % 1.0
        found = np.searchsorted(footprints.cumulative, low + level * (high - low), "right") - 1
        cell[:, several] = np.clip(found, first[several], last[several] - 1)
    fold = ~footprints.square[cell] & (place.sum(axis=2) > 1)
    place = np.where(fold[..., None], 1 - place, place)
    position = (
        footprints.origin[cell]
        + place[..., :1] * footprints.u[cell]
        + place[..., 1:] * footprints.v[cell]
    )
    return Points(position.astype(np.float32), footprints.normal[cell].astype(np.float32), cell, place)


def point_frames(points: Points, turn: np.ndarray) -> np.ndarray:
    """(per, R, 3, 3) float32 tangent frames; each footprint's are turned by ``turn`` (R,)."""
    return tangent_frames(points.normal, np.broadcast_to(turn, points.normal.shape[:2]))


def grouped_chunks(count: int, size: int) -> list[tuple[int, np.ndarray]]:
    """(group, indices) pairs that cover ``range(count)``; neighbours fall into different groups.

    Each group uses a Sobol set of its own, each chunk has at most ``size`` footprints.
    """
    chunks = []
    for group in range(GROUPS):
        indices = np.arange(group, count, GROUPS)
        chunks += [(group, indices[i : i + size]) for i in range(0, len(indices), size)]
    return chunks
