"""Kinds of light, and the lights that light nothing."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.geometry.lambert import polygon_form_factor
from radiosity_addon.solver.geometry.nusselt import cosine_toward
from radiosity_addon.solver.geometry.spherical_triangles import uniform_toward
from radiosity_addon.solver.lights.cones import cone_directions, sphere_form_factor
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.flat_shapes import ELLIPSE, corner_coordinates
from radiosity_addon.solver.lights.polygons import lamp_polygons
from radiosity_addon.solver.lights.spheres import SphereLights
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import AreaLamp, PointLamp, SunLamp
from radiosity_addon.solver.sequence import solve_opened
from radiosity_addon.solver.solution import compose
from verification import stability_scenes as scenes
from verification.meshes import triangle_receivers

DOWN, UP = np.array([0, 0, -1.0]), np.array([0, 0, 1.0])
X, Y = np.array([0.2, 0, 0]), np.array([0, 0.2, 0])


def area(name, center, normal) -> AreaLamp:
    return AreaLamp(name, np.asarray(center, float), X, Y, np.asarray(normal, float), np.ones(3))


def spot(name, position, axis, cone=0.5, radius=0.0) -> PointLamp:
    return PointLamp(name, np.asarray(position, float), np.ones(3), radius,
                     axis=np.asarray(axis, float), cone=cone)  # fmt: skip


USEFUL = (
    PointLamp("Point", np.array([0.5, 0.4, 0.7]), np.ones(3)),
    spot("Spot", (0.5, 0.5, 0.9), DOWN),
    area("Area", (0.3, 0.3, 0.9), DOWN),
)
USELESS = (
    area("Away below", (0.5, 0.5, -0.1), DOWN),
    area("Away above", (0.5, 0.5, 1.1), UP),
    spot("Away", (0.5, 0.5, 1.2), UP),
    spot("Past the corner", (2.0, 0.5, 2.0), (1, 0, 0), 1.0),
    spot("Past, soft", (2.0, 0.5, 2.0), (1, 0, 0), 1.0, 0.1),
)


def context_of(*lamps, **changes):
    return build_context(replace(scenes.lamp_room(), lamps=lamps, **changes), 0, 1, silent)


def test_lights_that_light_nothing_are_not_sampled():
    for lamp in USELESS:
        context = context_of(lamp)
        assert context.sources.count == 1 and context.sources.always == ()
    for lamp in USEFUL:
        assert context_of(lamp).sources.always == (0,)
    assert len(context_of(*USEFUL, *USELESS).sources.always) == 3


def test_dark_lamps_and_lamps_linked_to_nothing_are_not_sampled():
    dark = PointLamp("Dark", np.full(3, 0.5), np.zeros(3))
    assert context_of(dark).sources.count == 0
    nothing = np.zeros(0, int)
    linked = context_of(USEFUL[0], lamp_objects=(nothing,))
    assert linked.sources.always == ()


def test_a_beam_that_grazes_the_room_is_kept():
    """From (2, 0.5, 0.5) along +z: the room's side x = 1 is 1 away from the axis; its
    nearest corners lie at angle 90° − atan((1 − 0.5) / 1) = 63.4° off the axis."""
    for half, kept in ((50, 0), (75, 1)):
        lamp = spot("Beam", (2.0, 0.5, 0.5), UP, 2 * np.radians(half))
        assert len(context_of(lamp).sources.always) == kept


def test_dropping_useless_lights_saves_rays_and_changes_nothing():
    """Eight lamps of which five light nothing: with all of them sampled the light is the same within the
    errors asked for, and costs more rays."""
    scene = replace(scenes.lamp_room(), lamps=(*USEFUL, *USELESS))
    receivers, settings = triangle_receivers(scene, 8), Settings(error=0.02, threads=1)
    context = build_context(scene, 0, 1, silent)
    every = context.under(context.sources.only(np.arange(8)))
    few, all_of_them = (solve_opened(each, receivers, settings) for each in (context, every))
    found, expected = (compose(each, settings.passes) for each in (few, all_of_them))
    difference = (found - expected) / np.maximum(expected, expected.mean())
    assert np.sqrt((difference**2).mean()) < 0.04
    assert few.statistics.rays < 0.95 * all_of_them.statistics.rays


def test_lamps_of_one_link_share_a_row():
    """Two lamps on the floor and one on all: two rows of objects."""
    only = np.array([4])
    context = context_of(*USEFUL, lamp_objects=(only, None, only.copy()))
    allowed = context.sources.allowed[context.sources.link]
    assert context.sources.allowed.shape == (2, 6)
    assert sorted(allowed.sum(axis=1)) == [1, 1, 6] and allowed[:, 4].all()


def test_suns_and_lamps_are_chosen_apart():
    """Eight suns are too many for all to be sampled, whatever else there is."""
    suns = [SunLamp(f"{i}", np.array([np.cos(i), np.sin(i), -1.0]) / np.sqrt(2), np.ones(3))
            for i in range(8)]  # fmt: skip
    sources = context_of(*USEFUL, *suns).sources
    assert len(sources.always) == 3 and len(sources.samplers) == 1
    assert sorted(sources.samplers[0].blocks.ravel()) == list(range(3, 11))


@pytest.mark.parametrize("corners", [
    [(1, 1, 1), (2, 1, 1), (2, 2, 1), (1, 2, 1)],  # beside the zenith
    [(-1, -1, 0.3), (1, -1, 0.3), (1, 1, 0.3), (-1, 1, 0.3)],  # around it, large
    [(0.5, -1, -1), (0.5, 1, -1), (0.5, 1, 2), (0.5, -1, 2)],  # cut by the horizon
    [(0, 0, 1), (0.02, 0, 1), (0, 0.01, 1)],  # small, a corner at the zenith
])  # fmt: skip
def test_directions_to_a_polygon_follow_the_cosine_law(corners):
    """Their total is π times Lambert's factor, all meet the polygon, and parts of it get shares in
    proportion to their own factors: standard error √(p (1 − p) / n)."""
    n = 1 << 14
    corners = np.array(corners, float)
    rays = [np.tile(corner[:, None], n) for corner in corners]
    up = np.tile(UP[:, None], n)
    total, found = cosine_toward(rays, up, np.random.default_rng(0).random((2, n)))
    factor = lambda part: float(polygon_form_factor(np.zeros((1, 3)), UP[None], part)[0])  # noqa: E731
    np.testing.assert_allclose(total, np.pi * factor(corners), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found, axis=0), 1, rtol=1e-9)
    middle = corners.mean(axis=0)
    shares = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        inside = np.ones(n, bool)
        for p, q, r in ((a, b, middle), (b, middle, a), (middle, a, b)):
            plane = np.cross(p, q)
            inside &= (plane @ found) * (plane @ r) >= 0
        shares.append(inside.mean())
        share = factor(np.array([a, b, middle])) / factor(corners)
        assert shares[-1] == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / n) + 1e-9)
    assert sum(shares) == pytest.approx(1, abs=1e-3)


def ball_samples(x, normal, radius: float, n: int = 1 << 14):
    """The Sample of a ball of intensity 1 about the origin at n copies of a point."""
    one = np.ones(1)
    light = SphereLights(np.ones((1, 3)), np.zeros((1, 3)), radius * one, DOWN[None], -2 * one, one)
    xi = np.random.default_rng(2).random((n, 2))
    many = np.tile(np.asarray(x, float), (n, 1)), np.tile(np.asarray(normal, float), (n, 1))
    return light.sample(0, *many, xi)


def test_ball_seen_whole_is_a_point():
    """A sphere of radiance I / πr² above the horizon: π r²/d² cosθ · I / πr² = I cosθ / d², here
    cos 60° / 2² = 1/8 for any r up to d sin 30° = 1."""
    normal = np.array([np.sin(np.pi / 3), 0, np.cos(np.pi / 3)])
    for radius in (0.01, 0.5, 0.99):
        sample = ball_samples((0, 0, -2.0), normal, radius)
        np.testing.assert_allclose(sample.irradiance, 0.125, rtol=1e-6)


@pytest.mark.parametrize("slope", [0.3, 0.0, -0.3])
def test_ball_cut_by_the_horizon(slope):
    """Single samples, averaged, are the closed form; at slope 0 half the sphere is seen: its upper
    half's projection onto the horizon plane, by symmetry (σ − sinσ cosσ) / π of the hemisphere for
    a half angle σ, here 30°."""
    normal = np.array([np.sqrt(1 - slope**2), 0, slope])
    exact = float(sphere_form_factor(np.full(1, slope), np.full(1, 0.25))[0])
    single = ball_samples((0, 0, -2.0), normal, 1.0).irradiance
    assert single.mean() == pytest.approx(exact, abs=4 * single.std() / np.sqrt(len(single)))
    if slope == 0:
        sigma = np.radians(30)
        assert exact == pytest.approx((sigma - np.sin(sigma) * np.cos(sigma)) / np.pi, rel=1e-6)


def test_ball_from_inside():
    """The same radiance I / πr² everywhere: irradiance I / r², whatever the place and normal."""
    sample = ball_samples((0.1, 0.2, -0.3), (1, 0, 0), 0.5)
    np.testing.assert_allclose(sample.irradiance, 4.0, rtol=1e-6)
    away = np.linalg.norm(sample.segment + [0.1, 0.2, -0.3], axis=1)
    np.testing.assert_allclose(away, 0.5, rtol=1e-4)  # segments end on the ball


@pytest.mark.parametrize("slope", [0.9, 0.4, 0.0])
def test_directions_to_a_cone_follow_the_cosine_law(slope):
    """What halves of a cone of sin²σ = 0.3 bring, turned toward the normal and away, by its samples
    and by as many that are uniform in its solid angle, within four standard errors; and where all
    of it is above the horizon, the cosine of its axis for every sample."""
    n, square = 1 << 16, 0.3
    normal = np.tile(np.array([np.sqrt(1 - slope**2), 0, slope])[:, None], n)
    axis, random = np.tile(UP[:, None], n), np.random.default_rng(1)
    many = np.full(n, slope), np.full(n, square)
    found, ratio = cone_directions(axis, normal, *many, random.random((2, n)))
    if slope > np.sqrt(square):
        np.testing.assert_allclose(ratio, slope, rtol=1e-12)
    z = 1 - random.random(n) * (1 - np.sqrt(1 - square))
    x = np.sqrt(1 - z * z) * np.cos(2 * np.pi * random.random(n))
    plain = 2 * (1 - np.sqrt(1 - square)) * np.maximum(x * normal[0] + z * slope, 0) / square
    for toward in (True, False):
        one, other = ratio * ((found[0] > 0) == toward), plain * ((x > 0) == toward)
        spread = np.hypot(one.std(), other.std()) / np.sqrt(n)
        assert one.mean() == pytest.approx(other.mean(), abs=4 * spread)


def test_directions_to_a_window_seen_from_below_stay_inside_it():
    """A window upright beside and above the point, 3.6 mm off its plane: its sector of the disk is
    nearly half a turn wide and thin, where Newton's method from afar leaves it. The first moments of
    the density are those of the window's area in the disk, by a fine grid of it."""
    window = np.array([[0.0036, -1.0, 0.4], [0.0036, -1.0, 1.0], [0.0036, 1.5, 1.0], [0.0036, 1.5, 0.4]])
    count = 20_000
    xi = np.random.default_rng(0).random((2, count))
    rays = [np.repeat(corner[:, None], count, axis=1) for corner in window]
    normal = np.repeat(np.array([[0.0], [0], [1]]), count, axis=1)
    total, direction = cosine_toward(rays, normal, xi)
    place = direction * (0.0036 / direction[0])
    assert (place[1] > -1.0 - 1e-6).all() and (place[1] < 1.5 + 1e-6).all()
    assert (place[2] > 0.4 - 1e-6).all() and (place[2] < 1.0 + 1e-6).all()
    y, z = np.meshgrid((np.arange(800) + 0.5) / 320 - 1, 0.4 + (np.arange(200) + 0.5) * 0.003)
    square = 0.0036**2 + y**2 + z**2
    density = z * 0.0036 / square**2
    assert total == pytest.approx(density.sum() * (2.5 / 800) * 0.003, rel=1e-3)
    for values, grid in ((place[1], y), (place[2], z)):
        mean = (density * grid).sum() / density.sum()
        spread = np.sqrt((density * (grid - mean) ** 2).sum() / density.sum())
        assert values.mean() == pytest.approx(mean, abs=4 * spread / np.sqrt(count))


@pytest.mark.parametrize("nearby, size", [((0.3, 0.2, 1.0), 0.4), ((1.0, 0.1, 0.25), 0.8)])
def test_single_points_sample_ellipses_inside(nearby, size):
    """A disk above a floor, and one beside a wall: samples for single points lie inside, and their mean is Lambert's factor
    of the polygon that stands for it."""
    count, center = 20_000, np.array([0.5, 0.5, 0.5])
    disk = lamp_polygons(np.ones((1, 3)), np.array([ELLIPSE]), center[None] - [size, size, 0], 2 * size * np.eye(3)[:1],
                         2 * size * np.eye(3)[1:2], UP[None], np.array([np.pi]))  # fmt: skip
    point, normal = center + nearby, -np.array(nearby) / np.linalg.norm(nearby)
    points, normals = np.tile(point, (count, 1)), np.tile(normal, (count, 1))
    xi = np.random.default_rng(4).random((count, 2))
    found = disk.sample(np.zeros(count, int), points, normals, xi)
    met = found.irradiance > 0
    place = points[met] + found.segment[met] - center
    assert np.hypot(place[:, 0], place[:, 1]).max() <= size * (1 + 1e-5)
    rim = [center + size * (2 * np.array([s, t, 0.5]) - 1) for s, t in corner_coordinates(ELLIPSE)]
    factor = polygon_form_factor(point[None], normal[None], rim)[0]
    spread = found.irradiance.std() / np.sqrt(count)
    assert found.irradiance.mean() == pytest.approx(np.pi * factor, abs=4 * spread)


OCTANT = [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]  # a spherical triangle of π/2
BESIDE = [[1.0, -1, -0.5], [1, 1, -0.5], [1, 1, 2], [1, -1, 2]]  # cut by the horizon
GRAZING = [[0.01, 0, 0.02], [5, 0, 0.02], [5, 3, 0.02], [0.01, 3, 0.02]]
TINY = [[1, -1e-3, 1], [1, 1e-3, 1], [1, 0, 1.001]]


@pytest.mark.parametrize("corners", [OCTANT, BESIDE, GRAZING, TINY])
def test_directions_that_are_uniform_in_a_solid_angle(corners):
    """They lie inside; the solid angle times the mean of their cosines above the horizon is Lambert's
    factor times π, and that of an octant is π/2."""
    count, corners = 40_000, np.array(corners, float)
    xi = np.random.default_rng(3).random((2, count))
    total, direction = uniform_toward([np.repeat(c[:, None], count, 1) for c in corners], xi)
    assert np.linalg.norm(direction, axis=0) == pytest.approx(1, abs=1e-9)
    plane = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    place = direction * (plane @ corners[0] / (plane @ direction))
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        inside = np.cross(b - a, place.T - a) @ plane
        assert inside.min() > -1e-6 * (plane @ plane)
    value = total * np.maximum(direction[2], 0)
    expected = np.pi * polygon_form_factor(np.zeros((1, 3)), UP[None], list(corners))[0]
    assert value.mean() == pytest.approx(expected, abs=4 * value.std() / np.sqrt(count) + 1e-12)
    if len(corners) == 3 and corners[0, 0] == 1 and corners[1, 1] == 1:
        assert total == pytest.approx(np.pi / 2, rel=1e-12)


def test_solid_angles_of_nothing_and_of_the_edge():
    """A triangle without an area, and a plane through the point: no solid angle, no NaN."""
    for corners in ([[1.0, 0, 0], [2, 0, 0], [3, 0, 0]], [[1.0, 0, 0], [0, 1, 0], [1, 1, 0]]):
        rays = [np.repeat(np.array(c, float)[:, None], 4, 1) for c in corners]
        total, direction = uniform_toward(rays, np.full((2, 4), 0.5))
        assert total == pytest.approx(0, abs=1e-12) and np.isfinite(direction).all()
