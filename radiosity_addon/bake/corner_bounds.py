"""Corner bounds: what vertex colors may be, by the light on the faces around. See ``corner_fit``."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from .corner_equations import SurfaceLight


def color_bounds(
    corners: csr_matrix, light: SurfaceLight, values: np.ndarray, weights: np.ndarray,
    loop_vertex: np.ndarray, group: np.ndarray, hidden: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A first guess, the lowest and the highest color allowed of each unknown, (unknowns, 3) float64
    each, for light ``values`` (count, 3) at receivers that stand for the areas ``weights`` (count,).

    ``corners`` (3 n, unknowns) makes colors at triangles' corners of the unknowns; ``loop_vertex`` and
    ``group`` (n_loops,) int are the vertex and the unknown of each loop. Unknowns that are ``hidden``
    (unknowns,) bool take the colors of those that they share triangles with.

    Over a triangle cut n-fold a linear function reaches 2/(3(n−1)) of what its receivers'
    centroids span beyond them; that much is allowed. With one receiver a triangle it is half of
    what the triangles around the unknown span.
    """
    shown = weights > 0
    triangle, values = light.triangle[shown], values[shown]
    n = len(light.area)
    low, high, total = np.full((n, 3), np.inf), np.full((n, 3), -np.inf), np.zeros((n, 3))
    np.minimum.at(low, triangle, values)
    np.maximum.at(high, triangle, values)
    np.add.at(total, triangle, weights[shown, None] * values)
    with np.errstate(invalid="ignore"):
        leeway = (high - low) * (2 / 3 / np.maximum(light.cuts - 1, 0.5))[:, None]
    leeway[light.cuts == 0] = -np.inf
    low, high, leeway = (_over_unknowns(corners, x, f) for x, f in (
        (low, np.minimum), (high, np.maximum), (leeway, np.maximum)))
    mass = corners.T @ np.repeat(light.area, 3)
    known = (mass > 0) & np.isfinite(low).all(1)
    guess = np.zeros((corners.shape[1], 3))
    guess[known] = (corners.T @ np.repeat(total, 3, axis=0))[known] / mass[known, None]
    guess = _fill(guess, known, mass, loop_vertex, group)
    guess[hidden] = _spread_into(corners, guess, known, hidden)
    with np.errstate(invalid="ignore"):
        leeway = np.where(leeway > 0, leeway, (high - low) / 2)
        low, high = np.maximum(low - leeway, 0.0), np.maximum(high + leeway, 0.0)
    known = known[:, None]
    return np.maximum(guess, 0), np.where(known, low, guess), np.where(known, high, guess)


def _over_unknowns(corners: csr_matrix, value: np.ndarray, reduce: np.ufunc) -> np.ndarray:
    """Reduce ``value`` (n, 3) of the triangles over those around each unknown."""
    incidence = corners.tocsc()
    used = np.nonzero(np.diff(incidence.indptr))[0]
    out = np.full((corners.shape[1], 3), np.inf if reduce is np.minimum else -np.inf)
    if len(used):
        out[used] = reduce.reduceat(value[incidence.indices // 3], incidence.indptr[used], axis=0)
    return out


def _spread_into(corners: csr_matrix, guess, known, hidden) -> np.ndarray:
    """(k, 3) colors of the unknowns ``hidden`` (unknowns,) bool: means of those they share a
    triangle with, from the nearest that are ``known`` on; 0 where none is joined to any."""
    used = abs(corners) > 0
    incidence = csr_matrix(used.T.astype(float) @ _triangles_of(used.shape[0]))
    incidence = (incidence @ incidence.T).tocsr()
    colors, done = np.where(known[:, None], guess, 0.0), known.copy()
    left = hidden & ~known
    while left.any():
        weight = incidence @ done.astype(float)
        now = left & (weight > 0)
        if not now.any():
            break
        colors[now] = (incidence @ (colors * done[:, None]))[now] / weight[now, None]
        done |= now
        left &= ~now
    return colors[hidden]


def _triangles_of(corners: int) -> csr_matrix:
    """(corners, corners / 3): which triangle a corner is of."""
    row = np.arange(corners)
    return csr_matrix((np.ones(corners), (row, row // 3)), shape=(corners, corners // 3))


def _fill(guess, known, mass, loop_vertex, group) -> np.ndarray:
    """Give unknowns without light the mean of their vertex, else of the object."""
    if known.all():
        return guess
    if not known.any():
        return np.zeros_like(guess)
    lit = known[group].astype(float)
    count = np.bincount(loop_vertex, lit)
    sums = [np.bincount(loop_vertex, lit * guess[group, c]) for c in range(3)]
    vertex = np.stack(sums, 1) / np.maximum(count, 1)[:, None]
    vertex[count == 0] = np.average(guess[known], axis=0, weights=mass[known])
    filled = np.tile(np.average(guess[known], axis=0, weights=mass[known]), (len(guess), 1))
    filled[group] = vertex[loop_vertex]
    filled[known] = guess[known]
    return filled
