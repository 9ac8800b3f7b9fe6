"""Line of sight: whether one place on the surface sees another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.footprints import Footprints
from ..geometry.segments import Segments
from ..geometry.triangles import OFFSET
from ..geometry.vectors import unit_rows
from ..lights.context import Context

LIFT = 4 * OFFSET  # height [unit box] above the surface at which lines of sight begin and end
RISE = 0.5  # height [of the distance between two places] that a path over what stands between them may rise to


def is_path_clear(
    context: Context, start: np.ndarray, start_up: np.ndarray, end: np.ndarray, end_up: np.ndarray
) -> np.ndarray:
    """(k,) bool: from ``start`` (k, 3) a path to ``end`` (k, 3) is clear: a straight one, or, as a surface may be
    curved, one through places above the two. ``start_up`` and ``end_up`` (k, 3) are the unit normals there, on
    the side of the path."""
    low, goal = start + LIFT * start_up, end + LIFT * end_up
    free = is_clear(context, low, goal)
    some = np.flatnonzero(~free)
    way = RISE * np.linalg.norm(start[some] - end[some], axis=1)[:, None]
    high, above = low[some] + way * start_up[some], goal[some] + way * end_up[some]
    over = is_clear(context, high, above)
    for one, other in ((low[some], high), (goal[some], above)):
        over[over] = is_clear(context, one[over], other[over])
    free[some] = over
    return free


def are_free(context: Context, segments: Segments) -> np.ndarray:
    """(k,) bool: the paths along the segments are clear: see ``is_path_clear``."""
    starts, ends = map(context.geometry.normalized, (segments.starts, segments.ends))
    return is_path_clear(context, starts, segments.start_up, ends, segments.end_up)


def is_clear(context: Context, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(k,) bool: nothing lies between places (k, 3)."""
    shadow = context.blockers[0].shadow
    return shadow.clear(start.astype(np.float32), (end - start).astype(np.float32))


@dataclass(frozen=True)
class LineOfSight:
    """What receivers see of each other."""

    context: Context
    footprints: Footprints
    position: np.ndarray  # (count, 3) their middles, and
    normal: np.ndarray  # (count, 3) normals there, not unit

    def sees_all_of(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """(k,) bool: from the middle of the receivers ``one`` (k,) int the paths to all corners of the footprints
        ``other`` (k,) int are clear."""
        sees = np.ones(len(one), bool)
        if len(one) == 0:
            return sees
        footprints = self.footprints
        pair, cell = footprints.cells_of(other)
        for u, v in ((0, 0), (1, 0), (0, 1), (1, 1)):
            left = np.flatnonzero(sees[pair] & ((u + v < 2) | footprints.square[cell]))
            start, end = one[pair[left]], cell[left]
            corner = footprints.origin[end] + u * footprints.u[end] + v * footprints.v[end]
            up = unit_rows(self.normal[start])
            free = is_path_clear(
                self.context, self.position[start], up, corner, footprints.normal[end]
            )
            sees[pair[left[~free]]] = False
        return sees
