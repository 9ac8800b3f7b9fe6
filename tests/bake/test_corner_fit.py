"""Corner colors: what is reproduced exactly, what is bounded, what is filled in."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from radiosity_addon.bake.corner_equations import importance
from radiosity_addon.bake.corner_fit import JoinedUnknowns, corner_fit
from radiosity_addon.bake.exported_object import CornerMap, ExportedObject
from radiosity_addon.bake.faces import face_receivers, receiver_areas


class Plane:
    """A unit square of m × m quads; loops are one unknown each, or one a vertex if smooth."""

    def __init__(self, m=3, smooth=True, start=0, cuts=4):
        grid = np.stack(np.meshgrid(*[np.linspace(0, 1, m + 1)] * 2), -1).reshape(-1, 2)
        self.vertices = np.c_[grid, np.zeros(len(grid))]
        number = np.arange((m + 1) ** 2).reshape(m + 1, m + 1)
        quads = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], -1)
        self.loops = quads.ravel()
        loop = np.arange(len(self.loops)).reshape(-1, 4)
        corner = np.concatenate([loop[:, [0, 1, 2]], loop[:, [0, 2, 3]]])
        triangles = self.loops[corner]
        n = len(triangles)
        one_hot = CornerMap(np.arange(3 * n + 1), corner.reshape(-1), np.ones(3 * n), len(self.loops))
        group = self.loops if smooth else np.arange(len(self.loops))
        self.target = ExportedObject(
            "Plane", start, start + n, None, one_hot, self.loops.astype(np.int32),
            group.astype(np.int32),
        )
        area = 0.5 / m**2
        numbers = np.arange(start, start + n)
        self.receivers = face_receivers(
            self.vertices, triangles, numbers, area / cuts**2, least=1
        )
        padded = np.concatenate([np.zeros((start, 3), int), triangles])
        self.area = receiver_areas(self.vertices, padded, self.receivers)
        cell = self.vertices[padded[self.receivers.triangle]]
        u, v = self.receivers.corners.mean(1).T[..., None]
        self.points = (1 - u - v) * cell[:, 0] + u * cell[:, 1] + v * cell[:, 2]

    def fit(self, light, domain="corner", area=None):
        """Fit the light at the receivers; ``light`` is a function of the points (n, 3)."""
        values = light(self.points)
        area = self.area if area is None else area
        return corner_fit(self.target, self.receivers, area, domain).colors(values)


def linear(points):
    x, y = points[:, 0], points[:, 1]
    return np.stack([1 + x, 2 + 3 * y - x, 0.5 + 0.25 * x + y], 1)


def test_errors_of_colors_go_to_the_receivers_around_them():
    """Alike everywhere in the receivers, all in one corner of the colors: the receivers of the quad at that corner get all
    of it, those of other quads none; and what receivers have adds up to what colors have."""
    plane = Plane(3, smooth=False)
    fit = corner_fit(plane.target, plane.receivers, plane.area, "corner")
    errors, own = np.zeros(36), np.ones(len(plane.area))
    errors[0] = 5.0  # at (0, 0)
    found = own * fit.receiver_factors(errors, own)
    assert found.sum() == pytest.approx(5)
    beside = (plane.points[:, :2] < 1 / 3).all(axis=1)
    assert found[~beside] == pytest.approx(0) and found[beside].min() >= 0


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("m", [1, 5])
def test_linear_light_is_exact(m, smooth):
    plane = Plane(m, smooth, start=11)
    assert plane.fit(linear) == pytest.approx(linear(plane.vertices[plane.loops]), abs=1e-6)


def test_linear_light_is_exact_per_vertex():
    plane = Plane(4)
    assert plane.fit(linear, "point") == pytest.approx(linear(plane.vertices), abs=1e-6)


def test_rough_colors_tell_what_becomes_of_errors():
    """Light with errors of both signs less light without them is the errors: linear, and to a few
    times the hundredth that it stops at. In light of 1000 all places count alike, to 0.3 %."""
    plane = Plane(6)
    fit = corner_fit(plane.target, plane.receivers, plane.area)
    errors = np.random.default_rng(0).normal(size=(len(plane.points), 3))
    colors, lit = fit.rough_colors(errors), 1000 + linear(plane.points)
    exact = fit.colors(lit + 0.1 * errors) - fit.colors(lit)
    assert colors.shape == exact.shape and (colors < 0).any()
    assert np.linalg.norm(0.1 * colors - exact) < 0.03 * np.linalg.norm(exact)


def test_no_factor_where_receivers_have_no_error():
    """Squared errors whose noise was taken off may be below 0 in sum, and 0 around some colors: no division by that."""
    plane = Plane(6)
    fit = corner_fit(plane.target, plane.receivers, plane.area)
    own = np.where(plane.points[:, 0] < 0.5, -1.0, 0.0)
    factors = fit.receiver_factors(np.ones(len(fit.shown)), own)
    assert (factors == 0).all()


@pytest.mark.parametrize("cuts", [1, 2, 7])
@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("level", [0.0, 1e-12, 0.7, 1e9])
def test_constant_light_is_exact(cuts, smooth, level):
    colors = Plane(3, smooth, cuts=cuts).fit(lambda p: np.full((len(p), 3), level))
    assert colors == pytest.approx(level, rel=1e-6, abs=0)


def test_one_receiver_a_triangle_still_follows_the_light():
    """Interior vertices of a fine mesh: the smoothing term leaves a linear course alone there,
    because a linear function has no Laplacian; near the border it may lag by one cell, 0.05·3."""
    plane = Plane(20, cuts=1)
    colors = plane.fit(linear, "point")
    inner = (np.abs(plane.vertices[:, :2] - 0.5) < 0.3).all(1)
    assert colors[inner] == pytest.approx(linear(plane.vertices)[inner], abs=0.02)
    assert colors == pytest.approx(linear(plane.vertices), abs=0.15)


def test_a_shadow_edge_does_not_overshoot():
    """Over one quad cut 16-fold the range may be left by 2/(3·15) of the step, no more."""
    plane = Plane(1, cuts=16)
    colors = plane.fit(lambda p: np.repeat((p[:, :1] > 0.4) * 1.0, 3, 1))
    assert colors.min() >= 0 and colors.max() <= 1 + 2 / 45 + 1e-12
    assert colors.max() - colors.min() > 0.9


@pytest.mark.parametrize("seed", range(20))
def test_the_fit_is_the_bounded_minimum(seed):
    """Against SciPy's dense solver of bounded least squares, same matrix and bounds, most of which act. Unknowns that are fixed where
    they first leave their bounds, and never set free again, miss it."""
    from scipy.optimize import lsq_linear

    from radiosity_addon.bake.bounded import solve_bounded

    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(40, 12)), rng.normal(size=40)
    a[:, 1::2] = a[:, ::2] + 0.3 * a[:, 1::2]  # pairs that only differences tell apart, as corners of faces
    low = rng.uniform(-0.3, 0, 12)
    high = low + rng.uniform(0.1, 0.5, 12)
    expected = lsq_linear(a, b, (low, high), tol=1e-14).x
    ours = solve_bounded(csr_matrix(a.T @ a), a.T @ b, np.zeros(12), low, high)
    assert ours == pytest.approx(expected, abs=1e-6)


def test_a_vertex_between_sun_and_shadow_does_not_light_the_shadow():
    """Points of one color each: half of a square has light 1, half s = 0.01, both seen by vertices whose
    colors all are that one color x (one smooth vertex group): Σ w (x − L)² with w = 1 / max(L, 0.35 L̄)²,
    L̄ = 0.505, weighs the shadow 1 / 0.17675² = 32 to the sun's 1: x = (1 + 0.01 · 32) / 33 = 0.040,
    where by areas it is 0.505."""
    weight = importance(np.array([[1.0] * 3, [0.01] * 3]), np.ones(2), csr_matrix(np.ones((2, 1))))
    x = weight @ [1.0, 0.01] / weight.sum()
    assert x == pytest.approx((1 + 0.01 / 0.17675**2) / (1 + 1 / 0.17675**2))
    plane = Plane(1, cuts=16)
    left = plane.points[:, 0] < 0.5
    light = np.repeat(np.where(left, 1.0, 0.01)[:, None], 3, 1)
    fit = corner_fit(plane.target, plane.receivers, plane.area, joined=JoinedUnknowns(np.zeros(99, int)))
    assert fit.colors(light) == pytest.approx(x, rel=0.02)


def test_dark_ground_elsewhere_makes_no_vertex_of_a_lit_room_black():
    """Half of what a color of the room shows is lit with 1, half of it, as under a cupboard, with 0.01; ground of a thousand times the
    area outside is dark, so that the mean light is 0.002. The dark half counts 32 times as much as the lit one, as without the ground."""
    light = np.array([[1.0] * 3, [0.01] * 3, [0.001] * 3])
    room_and_ground = csr_matrix([[1.0, 0], [1, 0], [0, 1]])
    weight = importance(light, np.array([1.0, 1, 1000]), room_and_ground)
    assert weight[1] / weight[0] == pytest.approx(1 / 0.17675**2)
    assert weight[2] > weight[1]


def test_a_vertex_inside_other_geometry_does_not_go_black():
    """A pillar of side 0.2 stands on one corner of a floor lit with 1: its footprint is black.

    A point sample there gives 0. By area the pillar is 4 % of the floor, and counts eight times as it is
    dark: the fit over the whole floor keeps a quarter. Where a thousandth of that is seen it keeps nearly all, and leaving
    the hidden part out (area 0) gives 1.
    """
    plane = Plane(1, cuts=16)
    hidden = (plane.points[:, :2] < 0.2).all(1)
    assert hidden.sum() > 5
    light = lambda p: np.repeat(np.where(hidden, 0.0, 1.0)[:, None], 3, 1)  # noqa: E731
    assert plane.fit(light, "point").min() > 0.2
    fit = corner_fit(plane.target, plane.receivers, plane.area, "point", seen=np.where(hidden, 1e-3, 1.0))
    assert fit.colors(light(plane.points)).min() > 0.99
    seen = plane.fit(light, "point", np.where(hidden, 0.0, plane.area))
    assert seen == pytest.approx(1.0, abs=1e-9)


def test_corners_without_light_take_that_of_their_vertex_else_the_mean():
    plane = Plane(2, smooth=False)
    first_quad = np.isin(plane.receivers.triangle, [0, 4])
    colors = plane.fit(linear, area=np.where(first_quad, 0.0, plane.area))
    neighbor = plane.fit(linear)
    shared = np.nonzero(plane.loops[:4] == 4)[0][0]  # the middle vertex of the square
    others = [i for i in range(4, 16) if plane.loops[i] == 4]
    middle = colors[shared]
    assert (middle > neighbor[others].min(0) - 0.5).all()
    assert (middle < neighbor[others].max(0) + 0.5).all()
    assert np.isfinite(colors).all()
    alone = np.nonzero(plane.loops[:4] == 0)[0][0]  # the vertex only this quad has
    mean = np.average(linear(plane.points[~first_quad]), axis=0,
                      weights=plane.area[~first_quad])
    assert colors[alone] == pytest.approx(mean, rel=0.05)


def test_no_light_anywhere_is_black():
    plane = Plane(2)
    colors = plane.fit(linear, area=np.zeros_like(plane.area))
    assert colors.shape == (16, 3) and not colors.any()


def test_object_without_receivers_is_black():
    plane = Plane(1)
    none = face_receivers(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.array([0]), 1.0)
    colors = corner_fit(plane.target, none, np.zeros(0)).colors(np.zeros((0, 3)))
    assert colors.shape == (4, 3) and not colors.any()


def test_subdivided_surface_keeps_linear_light():
    """Corners that are weighted sums of the user's loops, as modifiers make them: a quad whose
    evaluated mesh is 2 × 2 quads with bilinear weights."""
    fine = Plane(2)
    where = fine.vertices[fine.loops[fine.target.corner_map.loops]]
    x, y = where[:, 0], where[:, 1]
    weights = np.stack([(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y], 1)
    loops = np.arange(4, dtype=np.int32)
    corner_map = CornerMap(
        4 * np.arange(len(weights) + 1), np.tile(loops, len(weights)), weights.ravel(), 4
    )
    target = ExportedObject("Quad", 0, 8, None, corner_map, loops, loops)
    colors = corner_fit(target, fine.receivers, fine.area).colors(linear(fine.points))
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    assert colors == pytest.approx(linear(corners), abs=1e-6)


def test_area_of_colors_of_one_quad():
    """A unit square of two triangles, 1/2 each, which meet at loops 0 and 2: these have a third of
    both, 1/3, and the others a third of one, 1/6. A receiver that is left out, with weight 0, takes
    its area with it: without the second triangle loops 0, 1, 2 have 1/6 each and loop 3 nothing."""
    plane = Plane(1, smooth=False)
    whole = corner_fit(plane.target, plane.receivers, plane.area)
    assert whole.areas() == pytest.approx([1 / 3, 1 / 6, 1 / 3, 1 / 6])
    seen = np.where(plane.receivers.triangle == 0, plane.area, 0.0)
    half = corner_fit(plane.target, plane.receivers, seen)
    assert half.areas() == pytest.approx([1 / 6, 1 / 6, 1 / 6, 0])
    dim = corner_fit(plane.target, plane.receivers, plane.area, seen=np.full(len(plane.area), 1e-3))
    assert dim.areas() == pytest.approx(whole.areas())


@pytest.mark.parametrize("domain", ["corner", "point"])
def test_areas_of_colors_are_shared_by_their_loops(domain):
    """2 × 2 quads, 1/4 each, smooth: the middle vertex is met by 6 triangles of 1/8 (its quads' cuts
    run from the low corner to the high one), so it has 6/24 = 1/4 of the unit square, as four loops
    of 1/16 each; all together have 1."""
    plane = Plane(2, smooth=True)
    area = corner_fit(plane.target, plane.receivers, plane.area, domain).areas()
    assert area.sum() == pytest.approx(1)
    middle = plane.loops == 4 if domain == "corner" else [4]
    assert area[middle] == pytest.approx(1 / 16 if domain == "corner" else 1 / 4)


def test_sizes_from_microns_to_kilometers_in_one_object():
    """Areas that differ by 1e12 in one system: each face still gets its own light exactly."""
    plane = Plane(2, smooth=False)
    scale = np.where(np.isin(plane.receivers.triangle, [0, 4]), 1e12, 1.0)
    colors = plane.fit(linear, area=plane.area * scale)
    assert colors == pytest.approx(linear(plane.vertices[plane.loops]), abs=1e-4)


def test_bad_input():
    plane = Plane(1)
    nan = lambda p: np.full((len(p), 3), np.nan)  # noqa: E731
    with pytest.raises(ValueError, match="receivers of 'Plane'.*not finite"):
        plane.fit(nan)
    with pytest.raises(ValueError, match="do not fit"):
        plane.fit(lambda p: np.ones((2, 3)))
