"""Pieces of faces: the receivers behind vertex colors. NumPy only.

Each triangle is cut into n² equal triangles, one receiver each. n follows the triangle's share of
the area, so that a large face carries the light's variation and a fine mesh costs one receiver a
triangle.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..solver.geometry.grids import grid_cells
from ..solver.geometry.planar import cell_areas
from ..solver.receivers import Receivers

SAMPLES = 20_000  # number [receivers], aimed at, over all objects of a bake
FINEST = 16  # number [cuts of a triangle's edge], at most
COARSE_MESH = 50_000  # number [triangles]: up to here every triangle has at least four receivers


def receiver_budget(areas: np.ndarray, samples: int = SAMPLES) -> float:
    """Area [squared length] per receiver, for triangles of ``areas`` (n,), those of all objects of a
    bake."""
    return float(areas.sum()) / samples


def most_receivers(triangles: list[int]) -> int:
    """The largest number of receivers that objects of so many triangles may get. A triangle of which the budget wants
    x pieces, more than the least number, is cut into at most (√x + 1)² < 4 x."""
    return 4 * SAMPLES + sum(count * _fewest_cuts(count) ** 2 for count in triangles)


def _fewest_cuts(triangles: int) -> int:
    return 2 if triangles <= COARSE_MESH else 1


def face_receivers(
    vertices: np.ndarray, triangles: np.ndarray, triangle: np.ndarray, budget: float,
    least: int | None = None,
) -> Receivers:
    """Receivers of one object.

    ``vertices`` (v, 3), ``triangles`` (n, 3) and their scene numbers ``triangle`` (n,);
    ``budget`` as from ``receiver_budget``; ``least`` is the smallest n, None: 2, or 1 above
    ``COARSE_MESH`` triangles. Triangles without area get no receiver.
    """
    area = triangle_areas(vertices, triangles)
    least = _fewest_cuts(len(triangles)) if least is None else least
    wanted = np.sqrt(area / budget) if budget > 0 else np.zeros(len(area))
    cuts = np.clip(np.ceil(wanted), least, FINEST).astype(int)
    cuts[~(area > 0)] = 0
    count = cuts**2
    owner = np.repeat(np.arange(len(triangles)), count)
    corners = np.empty((len(owner), 3, 2))
    for n in np.unique(cuts[cuts > 0]):
        corners[cuts[owner] == n] = np.tile(_subdivision(int(n)), ((cuts == n).sum(), 1, 1))
    return Receivers(
        count=len(owner),
        receiver=np.arange(len(owner), dtype=np.int32),
        triangle=np.asarray(triangle)[owner].astype(np.int32),
        corners=corners,
        square=np.zeros(len(owner), bool),
    )


@lru_cache(maxsize=FINEST)
def _subdivision(n: int) -> np.ndarray:
    """(n², 3, 2) float64 barycentric corners of the equal triangles of an n-fold cut, the inverted ones last."""
    cells = grid_cells(n, np.float64)
    return cells[np.argsort(cells[:, 1, 0] < cells[:, 0, 0], kind="stable")]


def triangle_areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) float64 areas of ``triangles`` (n, 3) int of ``vertices`` (v, 3); 0 where one is not finite."""
    p = np.asarray(vertices, float)[triangles]
    with np.errstate(invalid="ignore", over="ignore"):
        area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return np.where(np.isfinite(area), area, 0.0)


def receiver_areas(
    vertices: np.ndarray, triangles: np.ndarray, receivers: Receivers
) -> np.ndarray:
    """(count,) float64 surface area of each receiver [squared length of ``vertices`` (v, 3)];
    ``triangles`` (n, 3) are all of the scene's."""
    share = cell_areas(receivers.corners, receivers.square)
    area = share * triangle_areas(vertices, triangles[receivers.triangle])
    return np.bincount(receivers.receiver, area, receivers.count)
