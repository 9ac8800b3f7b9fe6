"""Corner equations: the normal equations of the fit of vertex colors. See ``corner_fit``.

``sampling`` is (count, 3 n): what linear colors at the corners of n triangles show at count receivers.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags

from ..solver.geometry.planar import cell_areas, cell_middles
from ..solver.receivers import Receivers

# Stiffnesses ε [of 1] of triangles with fewer than, and at least, three receivers.
STIFFNESS = (0.03, 1e-10)
# Light [of the mean, or of that around]: what is darker counts as this. At a quarter, to which errors are judged, what lies
# under things would make the vertices around it dark, little as it is seen.
DARKEST = 0.35


@dataclass(frozen=True)
class SurfaceLight:
    """Where the receivers are: a matrix and counts on the object's n triangles."""

    sampling: csr_matrix  # (count, 3 n): light at a receiver from that at triangle corners
    triangle: np.ndarray  # (count,) the triangle of the receiver's first cell
    area: np.ndarray  # (n,) area with light known on it
    cuts: np.ndarray  # (n,) float64: square root of the number of receivers with weight


def surface_light(
    receivers: Receivers, weights: np.ndarray, start: int, triangles: int
) -> SurfaceLight:
    """Of receivers on ``triangles`` triangles from number ``start`` on, which stand for the areas
    ``weights`` (count,): sampled at their centroids, the area means over their cells."""
    u, v = cell_middles(receivers.corners, receivers.square).T
    cell_triangle = receivers.triangle - start
    area = cell_areas(receivers.corners, receivers.square)
    total = np.bincount(receivers.receiver, area, receivers.count)
    share = area / total[receivers.receiver]
    entries = np.stack([1 - u - v, u, v], 1) * share[:, None]
    columns = 3 * cell_triangle[:, None] + np.arange(3)
    rows = np.repeat(receivers.receiver, 3)
    sampling = csr_matrix(
        (entries.ravel(), (rows, columns.ravel())), shape=(receivers.count, 3 * triangles)
    )
    first = np.searchsorted(receivers.receiver, np.arange(receivers.count))
    triangle = cell_triangle[first] if receivers.count else np.zeros(0, int)
    known = np.bincount(triangle, weights > 0, triangles)
    return SurfaceLight(sampling, triangle, np.bincount(triangle, weights, triangles), np.sqrt(known))


def shares_of(sampling: csr_matrix) -> tuple[csr_matrix, np.ndarray]:
    """How much of each color a place shows, (count, colors) >= 0, and (count,) the sums of that; 1 where it shows none."""
    shares = abs(sampling)
    total = np.asarray(shares.sum(axis=1)).ravel()
    return shares, np.where(total > 0, total, 1)


def importance(values: np.ndarray, areas: np.ndarray, sampling: csr_matrix) -> np.ndarray:
    """(count,) (L̄ / max(L, DARKEST · max(L̄, l)))² of light ``values`` (count, 3), L their mean over channels, L̄ that
    over ``areas`` (count,), l that around the colors which ``sampling`` (count, colors) shows at the place; 1 where all is dark."""
    level = values.mean(axis=1)
    total = areas.sum()
    mean = float(level @ areas / total) if total > 0 else 0.0
    if not mean > 0:
        return np.ones(len(level))
    level = level / mean
    return 1 / np.maximum(level, DARKEST * np.maximum(_around(level, areas, sampling), 1)) ** 2


def _around(level: np.ndarray, areas: np.ndarray, sampling: csr_matrix) -> np.ndarray:
    """(count,) means of the colors that ``sampling`` (count, colors) shows at each place, each the mean of the ``level`` (count,)
    over the ``areas`` (count,) where it is shown."""
    shares, total = shares_of(sampling)
    shown = shares.T @ (areas / total)
    means = (shares.T @ (areas / total * level)) / np.where(shown > 0, shown, 1)
    return (shares @ means) / total


def normal_equations(
    sampling: csr_matrix, corners: csr_matrix, light: SurfaceLight, weights: np.ndarray
) -> csr_matrix:
    """(unknowns, unknowns) for receivers that count by ``weights`` (count,)."""
    area = np.bincount(light.triangle, weights, len(light.area))
    stiff = _stiffness(corners, replace(light, area=area))
    return (sampling.T @ diags(weights) @ sampling + stiff).tocsr()


def _stiffness(corners: csr_matrix, light: SurfaceLight) -> csr_matrix:
    """Differences between a triangle's corners, times its area and ε."""
    epsilon = np.where(light.cuts**2 < 2.5, *STIFFNESS) * light.area / 3
    n = len(epsilon)
    first = 3 * np.arange(n)
    signs = np.tile([1.0, -1.0], (n, 1))
    total = None
    for a, b in ((0, 1), (1, 2), (2, 0)):
        rows = np.repeat(np.arange(n), 2)
        columns = np.stack([first + a, first + b], 1).ravel()
        edge = coo_matrix((signs.ravel(), (rows, columns)), shape=(n, 3 * n)).tocsr() @ corners
        term = edge.T @ diags(epsilon) @ edge
        total = term if total is None else total + term
    return total
