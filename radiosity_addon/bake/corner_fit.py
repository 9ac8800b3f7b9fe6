"""Corner fit: vertex colors that fit the light over the faces around them. NumPy and SciPy only.

Colors are interpolated linearly over each triangle, so the light shown at a receiver's centroid
is a weighted sum of the unknown colors x, ``A x``. We seek the x that minimizes

    Σ_r w_r |(A x)_r − L_r|² + ε Σ_t w_t Σ_c |(x_t,c − mean_c x_t,c)|²

over the surface: w are areas, as far as they are seen (``free_paths``), over max(L, 0.35 L̄)², L a receiver's light, a
mean over the channels, and L̄ its mean over the surface or, where that is more, around the colors shown there. By areas alone
a vertex between sun and shadow would fit the sun, and the shadow would be many times too bright; and what lies under things,
dark and hardly seen, would make the vertices around it dark. Light that is constant or linear over flat faces comes back
exactly, because the mean of a linear function over a cell is its value at the centroid. The second
term matters only where one receiver a triangle cannot tell its three corners apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..settings import Domain
from ..solver.expected import Refused
from ..solver.receivers import Receivers
from .bounded import solve_bounded, solve_roughly
from .corner_bounds import color_bounds
from .corner_equations import SurfaceLight, importance, normal_equations, shares_of, surface_light
from .exported_object import ExportedObject
from .hanging import NOTHING, Hanging, spread

# Share [of the mean squared error around a color]: where the error is smaller, it is rounding, and no samples lower it.
NOTICED = 1e-9


@dataclass(frozen=True)
class JoinedUnknowns:
    """``number`` (m,) says which of the m unknowns of the object's own are one, from 0 on; and which of these are ``hanging``: they
    lie on lines between others."""

    number: np.ndarray
    hanging: Hanging = NOTHING


@dataclass(frozen=True)
class CornerFit:
    """What the fit of a target's colors needs but the light: made once, used for any light."""

    receiver_area: np.ndarray  # (count,) what each receiver stands for,
    weights: np.ndarray  # (count,) and what it counts by
    area: np.ndarray  # (n,) of triangles, where light is known on them
    loop_vertex: np.ndarray  # (n_loops,)
    group: np.ndarray  # (n_loops,) the unknown of each loop
    corners: csr_matrix  # (3 n, unknowns)
    light: SurfaceLight
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
        course of the light needs. So a shadow edge across a large face makes a color hardly darker than
        the shadow where the face is cut finely; where it is cut in two or three along an edge, by a third to
        two thirds of the light's span. Corners without light take that of their vertex, else the object's mean. Raises
        ValueError on wrong shapes or light that is not finite.
        """
        values = np.asarray(values, float)
        _check(self.name, values, self.weights)
        bounds = self._bounds(values)
        weights = self.weights * importance(values, self.weights, self.sampling)
        corners = self.corners @ self.spread
        normal = normal_equations(self.sampling, corners, self.light, weights)
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

    def _bounds(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``color_bounds`` for light ``values`` (count, 3)."""
        return color_bounds(
            self.corners, self.light, values, self.weights, self.loop_vertex, self.group, self.hidden
        )

    def limits(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The lowest and the highest color, as many as ``colors`` gives back and (., 3) each, that it allows for the
        light ``values`` (count, 3)."""
        _, low, high = self._bounds(values)
        return low[self.shown], high[self.shown]

    def receiver_factors(self, errors: np.ndarray, own: np.ndarray) -> np.ndarray:
        """(count,) factors of the receivers' ``own`` (count,) squared errors by which these become the ``errors``
        (n,) of the colors: around each color they add up to its own. Where a few receivers determine a corner badly, its
        error is a hundred times theirs."""
        colors = self.spread.T @ np.bincount(self.shown, errors, self.spread.shape[0])
        shares, total = shares_of(self.sampling)
        around = shares.T @ (own / total)
        some = around > NOTICED * max(around.sum(), 0.0) / max(len(around), 1)
        return (shares @ (colors / np.where(some, around, np.inf))) / total

    def areas(self) -> np.ndarray:
        """(n_loops,) or (n_vertices,) float64: the area that each color stands for. A third of each triangle goes to
        each of its corners; loops that share a color share its area evenly."""
        area = self.corners.T @ np.repeat(self.area / 3, 3)
        return (area / np.maximum(np.bincount(self.shown, minlength=len(area)), 1))[self.shown]

    def seen(self) -> np.ndarray:
        """(n_loops,) or (n_vertices,) float64: how much of the surface around each color is seen for its area."""
        shares, _ = shares_of(self.sampling)
        around = shares.T @ self.receiver_area
        mean = (shares.T @ self.weights) / np.where(around > 0, around, 1)
        return (self.spread @ mean)[self.shown]

    def rough_colors(self, values: np.ndarray) -> np.ndarray:
        """``colors`` for values (count, c) of any sign, weighted by areas alone, without bounds, and solved to a
        hundredth. It is linear in the light, so that it shows what becomes of errors of the light."""
        right = self.sampling.T @ (self.weights[:, None] * values)
        colors = np.stack([solve_roughly(self.normal, column) for column in right.T], 1)
        return (self.spread @ colors)[self.shown]


def corner_fit(
    target: ExportedObject, receivers: Receivers, areas: np.ndarray, domain: str = Domain.CORNER.value,
    hidden: np.ndarray | None = None, joined: JoinedUnknowns | None = None, seen: np.ndarray | None = None,
) -> CornerFit:
    """The fit for a target's colors on ``domain``, corner or point.

    ``receivers`` lie on the target's triangles (scene numbers) and stand for the ``areas`` (count,); 0 leaves a receiver out (a
    part of the face that is inside another object). They count by that times how much is ``seen`` (count,) of them, in any
    unit; None: alike. Corners of triangles that are all ``hidden`` (n,) bool take the colors of
    those that they are joined to by faces; where there are none they are black. ``point`` gives a
    color for each vertex up to the last one that a loop uses. Raises ValueError for a target that
    was exported without its loops.
    """
    if target.corner_map is None or target.loop_vertex is None:
        raise ValueError(f"{target.name!r} was exported without its loops; export for vertices")
    areas = np.asarray(areas, float)
    weights = areas if seen is None else areas * seen
    _check(target.name, np.zeros((receivers.count, 3)), weights)
    group = unknowns_of(target, domain)
    joined = joined or JoinedUnknowns(np.arange(int(group.max(initial=-1)) + 1))
    number = joined.number
    shown, group = (number if domain == Domain.POINT else number[group]), number[group]
    unknowns = int(number.max(initial=-1)) + 1
    corners = _corner_map(target, group, unknowns)
    light = surface_light(receivers, weights, target.start, target.stop - target.start)
    known = np.bincount(light.triangle, areas, len(light.area))
    free, matrix = spread(joined.hanging, unknowns)
    sampling = (light.sampling @ corners @ matrix).tocsr()
    normal = normal_equations(sampling, corners @ matrix, light, weights)
    return CornerFit(
        areas, weights, known, target.loop_vertex, group, corners, light, free, matrix, sampling, normal, shown,
        target.name, _nowhere_seen(corners, light, hidden),
    )


def unknowns_of(target: ExportedObject, domain: str) -> np.ndarray:
    """(n_loops,) the unknown color of each loop, within the object."""
    return target.loop_vertex if domain == Domain.POINT else target.loop_smooth_group


def _nowhere_seen(corners: csr_matrix, light: SurfaceLight, hidden: np.ndarray | None) -> np.ndarray:
    """(unknowns,) bool: light is known on none of the triangles around, and some are ``hidden``."""
    if hidden is None:
        return np.zeros(corners.shape[1], bool)
    share = abs(corners).T
    lit, covered = (share @ np.repeat(np.asarray(x, float), 3) for x in (light.area > 0, hidden))
    return (lit == 0) & (covered > 0)


def _check(name: str, values: np.ndarray, weights: np.ndarray) -> None:
    """Raise ValueError for light of a wrong shape, Refused for light that is not finite."""
    if values.shape != (len(weights), 3) or weights.ndim != 1:
        raise ValueError(
            f"light {values.shape} and weights {weights.shape} do not fit the receivers of {name!r}"
        )
    bad = int((~np.isfinite(values).all(1)).sum() + (~np.isfinite(weights) | (weights < 0)).sum())
    if bad:
        raise Refused(
            f"{bad} receivers of {name!r} have light or area that is not finite; look for "
            "infinite values among the lamps, the sky and the emission strengths"
        )


def _corner_map(target: ExportedObject, group: np.ndarray, unknowns: int) -> csr_matrix:
    """(3 n, unknowns): the color at each evaluated triangle corner from the unknown colors."""
    loops = len(group)
    selection = csr_matrix((np.ones(loops), (np.arange(loops), group)), shape=(loops, unknowns))
    return (target.corner_map.matrix() @ selection).tocsr()
