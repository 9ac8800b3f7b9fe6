"""Shared colors: modifiers such as Array, Mirror and Solidify show a color of the user's mesh in several places. Where the
light of these differs it shows none of them, and a warning says so. NumPy only."""

from __future__ import annotations

import numpy as np

from ..figures import percent
from ..solver.adaptive.relative_error import FLOOR
from ..solver.geometry.planar import cell_areas
from ..solver.receivers import Receivers
from .exported_object import CornerMap, ExportedObject
from .faces import triangle_areas

CONTRAST = 2.0  # ratio [of light at two places]: one color for both would be far from one of them
NOTABLE = 0.01  # share [of the surface]: where more shows such colors, a warning says so


def mixtures(corners: CornerMap, unknown: np.ndarray) -> np.ndarray:
    """(n, 3) float64: a number of the mixture of colors that each triangle corner shows, alike for alike ones; 0 where it
    has none. ``unknown`` (n_loops,) numbers the loops' colors."""
    code = np.random.default_rng(0).random(int(unknown.max(initial=-1)) + 1)  # sums of which are alike by design only
    rows = len(corners.start) - 1
    row = np.repeat(np.arange(rows), np.diff(corners.start))
    return np.bincount(row, corners.weights * code[unknown[corners.loops]], rows).reshape(-1, 3)


def shared_share(
    corner: np.ndarray, points: np.ndarray, light: np.ndarray, seen: np.ndarray, area: np.ndarray
) -> float:
    """Share of the surface of n triangles that shows colors whose places have light that differs by CONTRAST: a third of a
    triangle for each ``corner`` (n, 3), the number of its color, 0 where it has none.

    ``points`` (n, 3, 3) are the corners' positions; ``light`` (n,) is the mean over the area ``seen`` (n,) of a
    triangle, and ``area`` (n,) all of it. Light below a quarter of the mean counts as that.
    """
    total = float(seen.sum())
    if total == 0:
        return 0.0
    some = (corner != 0) & (seen > 0)[:, None]
    triangle = np.nonzero(some)[0]
    position = points[some] @ np.random.default_rng(1).random(3)  # one number for each, as complex ones sort fast
    shown, number = np.unique(corner[some] + 1j * position, return_inverse=True)
    level = np.bincount(number, (light * seen)[triangle]) / np.bincount(number, seen[triangle])
    level = np.maximum(level, FLOOR * float(light @ seen) / total)
    color, number = np.unique(shown.real, return_inverse=True)
    low, high = np.full(len(color), np.inf), np.zeros(len(color))
    np.minimum.at(low, number, level)
    np.maximum.at(high, number, level)
    differing = np.isin(corner, color[high > CONTRAST * low])
    return float(differing.mean(axis=1) @ area) / float(area.sum())


def shared_warning(
    target: ExportedObject, unknown: np.ndarray, receivers: Receivers, light: np.ndarray, points: np.ndarray
) -> str:
    """One sentence on the colors that the modifiers of ``target`` show in differing lights; "" for next to none.

    ``unknown`` (n_loops,) numbers the loops' colors, ``light`` (count, 3) is that at its ``receivers``, and ``points``
    (n, 3, 3) are the corners of its triangles.
    """
    count = len(points)
    area = triangle_areas(points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    triangle = receivers.triangle - target.start
    cells = cell_areas(receivers.corners, receivers.square) * area[triangle]
    seen = np.bincount(triangle, cells, count)
    level = np.bincount(triangle, cells * light.mean(axis=1)[receivers.receiver], count)
    level /= np.where(seen > 0, seen, 1)
    share = shared_share(mixtures(target.corner_map, unknown), points, level, seen, area)
    if share <= NOTABLE:
        return ""
    return (
        f"{target.name!r}: {percent(share)} of its surface shows vertex colors that its modifiers "
        f"({', '.join(target.modifiers)}) repeat at other places, whose light is another, and shows it far too dark or too "
        "bright: apply the modifiers and bake again"
    )
