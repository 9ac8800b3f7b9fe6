"""Points: where rays start. On footprints, stratified by area; on elements, where rays met them.

Depends on ``geometry``, ``footprints``, ``sampling``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .footprints import SHRINK, Footprints
from .geometry import OFFSET, Geometry
from .sampling import GROUPS, sobol, tangent_frames


@dataclass(frozen=True)
class Points:
    """``per`` points for each of R owners, point-major so that rays stay coherent."""

    position: np.ndarray  # (per, R, 3) float32, lifted off the surface
    normal: np.ndarray  # (per, R, 3) float32, on the side that is lit
    triangle: np.ndarray  # (per, R) int32
    turn: np.ndarray  # (R, 3) float32: the owners' random shifts

    def frames(self) -> np.ndarray:
        """(per, R, 3, 3) float32 tangent frames, an owner's all turned alike."""
        return tangent_frames(self.normal, self.turn[:, 2])


def footprint_points(footprints: Footprints, chosen: np.ndarray, per: int, *key: int) -> Points:
    """``per`` points, stratified by area, on each of the ``chosen`` footprints (R,) int."""
    table = sobol(per, 3, *key).astype(np.float32)
    turn = footprints.turn[chosen]
    place = (table[:, None, :2] + turn[:, :2]) % 1.0
    cell = _choose_cells(footprints, chosen, table[:, 2:])
    fold = ~footprints.square[cell] & (place.sum(axis=2) > 1)
    place = np.where(fold[..., None], 1 - place, place)
    position = (
        footprints.origin[cell]
        + place[..., :1] * footprints.u[cell]
        + place[..., 1:] * footprints.v[cell]
    )
    return Points(
        position.astype(np.float32), footprints.normal[cell], footprints.triangle[cell], turn
    )


def _choose_cells(footprints: Footprints, chosen: np.ndarray, level: np.ndarray) -> np.ndarray:
    """(per, R) int: a cell of each footprint for each ``level`` (per, 1), by area."""
    first, last = footprints.start[chosen], footprints.start[chosen + 1]
    cell = np.broadcast_to(first, (len(level), len(chosen)))
    several = np.flatnonzero(last - first > 1)
    if len(several) == 0:
        return cell
    cell = cell.copy()
    low = footprints.cumulative[first[several]]
    high = footprints.cumulative[last[several]]
    level = (level + footprints.turn[chosen[several], 2]) % 1.0
    found = np.searchsorted(footprints.cumulative, low + level * (high - low), "right") - 1
    cell[:, several] = np.clip(found, first[several], last[several] - 1)
    return cell


def points_on(geometry: Geometry, triangle, u, v, front, turn) -> Points:
    """Points at barycentric (u, v) of triangles, (per, R) each, on the side ``front`` tells."""
    uv = np.stack([u, v], -1).astype(float) * (1 - SHRINK) + SHRINK / 3
    normal = np.where(front[..., None], 1.0, -1.0) * geometry.normal[triangle]
    position = geometry.at(triangle, uv) + OFFSET * normal
    return Points(position.astype(np.float32), normal.astype(np.float32), triangle, turn)


def grouped_chunks(count: int, size: int) -> list[tuple[int, np.ndarray]]:
    """(group, indices) pairs that cover ``range(count)``; neighbours fall into different groups.

    Each group uses a Sobol set of its own, each chunk has at most ``size`` owners.
    """
    chunks = []
    for group in range(GROUPS):
        indices = np.arange(group, count, GROUPS)
        chunks += [(group, indices[i : i + size]) for i in range(0, len(indices), size)]
    return chunks
