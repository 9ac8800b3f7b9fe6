"""Corners: vertex colors that fit the light over the faces around them. NumPy and SciPy only.

Colors are interpolated linearly over each triangle, so the light shown at a receiver's centroid
is a weighted sum of the unknown colors x, ``A x``. We seek the x that minimizes

    Σ_r w_r |(A x)_r − L_r|² + ε Σ_t w_t Σ_c |(x_t,c − mean_c x_t,c)|²

over the surface: w are areas over max(L, L̄/4), L a receiver's light, a mean over the channels, and L̄
its mean over the surface. By areas alone a vertex between sun and shadow would fit the sun, and the
shadow would be many times too bright; by areas over max(L, L̄/4)², as errors are judged, what is
hidden under things would make the vertices around it black. Light that is constant or linear over flat faces comes back
exactly, because the mean of a linear function over a cell is its value at the centroid. The second
term matters only where one receiver a triangle cannot tell its three corners apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags

from ..export.exported import ExportedObject
from ..settings import Domain
from ..solver.adaptive.relative_error import FLOOR
from ..solver.receivers import Receivers
from .bounded import solve_bounded, solve_roughly
from .hanging import NOTHING, Hanging, spread

# Stiffnesses ε [of 1] of triangles with fewer than, and at least, three receivers.
STIFFNESS = (0.03, 1e-10)


def fit_corners(
    target: ExportedObject,
    receivers: Receivers,
    values: np.ndarray,
    weights: np.ndarray,
    domain: str = "corner",
) -> np.ndarray:
    """Colors of the target's corners or points for light ``values`` (count, 3): see CornerFit."""
    return corner_fit(target, receivers, weights, domain).colors(values)


@dataclass(frozen=True)
class _Light:
    """Where the receivers are: a matrix and counts on the object's n triangles."""

    sampling: csr_matrix  # (count, 3 n): light at a receiver from that at triangle corners
    triangle: np.ndarray  # (count,) the triangle of the receiver's first cell
    area: np.ndarray  # (n,) area with light known on it
    cuts: np.ndarray  # (n,) float64: square root of the number of receivers with weight


@dataclass(frozen=True)
class CornerFit:
    """What the fit of a target's colors needs but the light: made once, used for any light."""

    weights: np.ndarray  # (count,) area of each receiver
    loop_vertex: np.ndarray  # (n_loops,)
    group: np.ndarray  # (n_loops,) the unknown of each loop
    corners: csr_matrix  # (3 n, unknowns)
    light: _Light
    free: np.ndarray  # (free,) those that are solved for: they hang on no others,
    spread: csr_matrix  # (unknowns, free) which all are made of
    sampling: csr_matrix  # (count, free): light at receivers
    normal: csr_matrix  # (free, free) by areas
    shown: np.ndarray  # (n,) the unknown of each color that is given back
    name: str
    hidden: np.ndarray  # (unknowns,) bool: around them nothing is seen

    def colors(self, values: np.ndarray) -> np.ndarray:
        """Colors (n_loops, 3) of corners, or (n_vertices, 3) of points, float64, >= 0, that fit
        the light ``values`` (count, 3) at the receivers.

        A color stays within the light on the faces around it, widened by as much as a linear
        course of the light needs: a shadow edge across a large face makes no color darker than
        the shadow. Corners without light take that of their vertex, else the object's mean. Raises
        ValueError on wrong shapes or light that is not finite.
        """
        values = np.asarray(values, float)
        _check(self.name, values, self.weights)
        bounds = _bounds(
            self.corners, self.light, values, self.weights, self.loop_vertex, self.group,
            self.hidden,
        )
        weights = self.weights * _importance(values, self.weights)
        corners = self.corners @ self.spread
        normal = _normal_equations(self.sampling, corners, self.light, weights)
        right = self.sampling.T @ (weights[:, None] * values)
        colors = np.empty((len(self.free), 3))
        for channel in range(3):
            same = [c for c in range(channel) if np.array_equal(values[:, c], values[:, channel])]
            colors[:, channel] = (
                colors[:, same[0]]
                if same
                else solve_bounded(
                    normal, right[:, channel], *(x[self.free, channel] for x in bounds)
                )
            )
        return (self.spread @ colors)[self.shown]

    def areas(self) -> np.ndarray:
        """(n_loops,) or (n_vertices,) float64: the area that each color stands for. A face gives a
        third of each of its triangles to that one's corners; loops of one color share alike."""
        area = self.corners.T @ np.repeat(self.light.area / 3, 3)
        return (area / np.maximum(np.bincount(self.shown, minlength=len(area)), 1))[self.shown]

    def rough_colors(self, values: np.ndarray) -> np.ndarray:
        """The same for ``values`` (count, c) of any sign, by areas, without bounds and to a hundredth:
        linear in the light, for telling what becomes of its errors."""
        right = self.sampling.T @ (self.weights[:, None] * values)
        colors = np.stack([solve_roughly(self.normal, column) for column in right.T], 1)
        return (self.spread @ colors)[self.shown]


def corner_fit(
    target: ExportedObject, receivers: Receivers, weights: np.ndarray, domain: str = "corner",
    hidden: np.ndarray | None = None, joined: np.ndarray | None = None,
    hanging: Hanging | None = None,
) -> CornerFit:
    """The fit for a target's colors on ``domain``, corner or point.

    ``joined`` (m,) says which of the m unknowns of the object's own are one, from 0 on, and ``hanging``
    which of the joined ones lie on lines between others.

    ``receivers`` lie on the target's triangles (scene numbers) and stand for the areas ``weights``
    (count,); weight 0 leaves a receiver out (a part of the face that nobody can see, inside
    another object). Corners of triangles that are all ``hidden`` (n,) bool take the colors of
    those that they are joined to by faces; where there are none they are black. ``point`` gives a
    color for each vertex up to the last one that a loop uses. Raises ValueError for a target that
    was exported without its loops.
    """
    if target.corner_map is None or target.loop_vertex is None:
        raise ValueError(f"{target.name!r} was exported without its loops; export for vertices")
    weights = np.asarray(weights, float)
    _check(target.name, np.zeros((receivers.count, 3)), weights)
    group = unknowns_of(target, domain)
    number = np.arange(int(group.max(initial=-1)) + 1) if joined is None else joined
    shown, group = (number if domain == Domain.POINT else number[group]), number[group]
    unknowns = int(number.max(initial=-1)) + 1
    corners = _corner_map(target, group, unknowns)
    light = _data(receivers, weights, target.start, target.stop - target.start)
    free, matrix = spread(NOTHING if hanging is None else hanging, unknowns)
    sampling = (light.sampling @ corners @ matrix).tocsr()
    normal = _normal_equations(sampling, corners @ matrix, light, weights)
    return CornerFit(
        weights, target.loop_vertex, group, corners, light, free, matrix, sampling, normal, shown,
        target.name, _nowhere_seen(corners, light, hidden),
    )


def unknowns_of(target: ExportedObject, domain: str) -> np.ndarray:
    """(n_loops,) the unknown color of each loop, within the object."""
    return target.loop_vertex if domain == Domain.POINT else target.loop_smooth_group


def _nowhere_seen(corners: csr_matrix, light: _Light, hidden: np.ndarray | None) -> np.ndarray:
    """(unknowns,) bool: light is known on none of the triangles around, and some are ``hidden``."""
    if hidden is None:
        return np.zeros(corners.shape[1], bool)
    share = abs(corners).T
    lit, unseen = (share @ np.repeat(np.asarray(x, float), 3) for x in (light.area > 0, hidden))
    return (lit == 0) & (unseen > 0)


def _check(name: str, values: np.ndarray, weights: np.ndarray) -> None:
    if values.shape != (len(weights), 3) or weights.ndim != 1:
        raise ValueError(
            f"light {values.shape} and weights {weights.shape} do not fit the receivers of {name!r}"
        )
    bad = int((~np.isfinite(values).all(1)).sum() + (~np.isfinite(weights) | (weights < 0)).sum())
    if bad:
        raise ValueError(
            f"{bad} receivers of {name!r} have light or area that is not finite; look for "
            "infinite values among the lamps, the sky and the emission strengths"
        )


def _data(receivers: Receivers, weights, start: int, triangles: int) -> _Light:
    """Sampling matrix at the receivers' centroids, each the area mean over its cells."""
    u, v = _centroids(receivers)
    cell_triangle = receivers.triangle - start
    side = receivers.corners[:, 1:] - receivers.corners[:, :1]
    area = np.abs(side[:, 0, 0] * side[:, 1, 1] - side[:, 0, 1] * side[:, 1, 0])
    area = area * np.where(receivers.square, 2.0, 1.0)
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
    return _Light(sampling, triangle, np.bincount(triangle, weights, triangles), np.sqrt(known))


def _centroids(receivers: Receivers) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = receivers.corners.transpose(1, 2, 0)
    return tuple(np.where(receivers.square, (b + c) / 2, (a + b + c) / 3))


def _corner_map(target: ExportedObject, group: np.ndarray, unknowns: int) -> csr_matrix:
    """(3 n, unknowns): the color at each evaluated triangle corner from the unknown colors."""
    loops = len(group)
    choose = csr_matrix((np.ones(loops), (np.arange(loops), group)), shape=(loops, unknowns))
    return (target.corner_map.matrix() @ choose).tocsr()


def _importance(values: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """(count,) L̄ / max(L, L̄/4) of light (count, 3) over ``areas`` (count,); 1 where all is dark."""
    level = values.mean(axis=1)
    total = areas.sum()
    mean = float(level @ areas / total) if total > 0 else 0.0
    if not mean > 0:
        return np.ones(len(level))
    return 1 / np.maximum(level / mean, FLOOR)


def _normal_equations(
    sampling: csr_matrix, corners: csr_matrix, light: _Light, weights: np.ndarray
) -> csr_matrix:
    """(unknowns, unknowns) for receivers that count by ``weights`` (count,)."""
    area = np.bincount(light.triangle, weights, len(light.area))
    stiff = _stiffness(corners, replace(light, area=area))
    return (sampling.T @ diags(weights) @ sampling + stiff).tocsr()


def _stiffness(corners: csr_matrix, light: _Light) -> csr_matrix:
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


def _bounds(corners, light, values, weights, loop_vertex, group, hidden):
    """Per unknown a first guess, the lowest and the highest color allowed: (unknowns, 3) each.

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
        reach = (high - low) * (2 / 3 / np.maximum(light.cuts - 1, 0.5))[:, None]
    reach[light.cuts == 0] = -np.inf
    low, high, reach = (_over_unknowns(corners, x, f) for x, f in (
        (low, np.minimum), (high, np.maximum), (reach, np.maximum)))
    mass = corners.T @ np.repeat(light.area, 3)
    known = (mass > 0) & np.isfinite(low).all(1)
    guess = np.zeros((corners.shape[1], 3))
    guess[known] = (corners.T @ np.repeat(total, 3, axis=0))[known] / mass[known, None]
    guess = _fill(guess, known, mass, loop_vertex, group)
    guess[hidden] = _spread_into(corners, guess, known, hidden)
    with np.errstate(invalid="ignore"):
        reach = np.where(reach > 0, reach, (high - low) / 2)
        low, high = np.maximum(low - reach, 0.0), np.maximum(high + reach, 0.0)
    known = known[:, None]
    return np.maximum(guess, 0), np.where(known, low, guess), np.where(known, high, guess)


def _over_unknowns(corners: csr_matrix, value: np.ndarray, reduce: np.ufunc) -> np.ndarray:
    """Reduce ``value`` (n, 3) of the triangles over those around each unknown."""
    around = corners.tocsc()
    used = np.nonzero(np.diff(around.indptr))[0]
    out = np.full((corners.shape[1], 3), np.inf if reduce is np.minimum else -np.inf)
    if len(used):
        out[used] = reduce.reduceat(value[around.indices // 3], around.indptr[used], axis=0)
    return out


def _spread_into(corners: csr_matrix, guess, known, hidden) -> np.ndarray:
    """(k, 3) colors of the unknowns ``hidden`` (unknowns,) bool: means of those they share a
    triangle with, from the nearest that are ``known`` on; 0 where none is joined to any."""
    used = abs(corners) > 0
    around = csr_matrix(used.T.astype(float) @ _triangles_of(used.shape[0]))
    around = (around @ around.T).tocsr()
    colors, done = np.where(known[:, None], guess, 0.0), known.copy()
    left = hidden & ~known
    while left.any():
        weight = around @ done.astype(float)
        now = left & (weight > 0)
        if not now.any():
            break
        colors[now] = (around @ (colors * done[:, None]))[now] / weight[now, None]
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
