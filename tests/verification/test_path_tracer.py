"""The oracle against closed forms: within four of its own standard errors, and those are small."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.fields import Constant, Texture
from radiosity_addon.solver.scene import AreaLamp, Material, PointLamp, Scene, Sky, SunLamp
from verification import exact, meshes
from verification.build import Build, small_receivers
from verification.path_tracer import irradiance
from verification.random_scenes import FAMILIES

FLOOR = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
MIDDLE = ([0], [[0.5, 0.0]])  # of the floor's first triangle, half along its edge: (0, -1, 0)
DOWN = np.array([0.0, 0, -1])


def close(found, error, expected, within):
    """Four standard errors, which are at most ``within`` of the value."""
    found, error = found[..., 0], error[..., 0]
    assert (error <= within * np.abs(expected)).all(), error / expected
    assert (np.abs(found - expected) <= 4 * error + 1e-12).all(), (found, error, expected)


def above_floor(*parts, rho=0.0, exitance=0.0, **more) -> Scene:
    """A floor, the square ±1, and what lies above it."""
    return replace(meshes.scene([meshes.grid(FLOOR, 1), *parts], rho, exitance), **more)


def seen(scene, paths=20_000, where=MIDDLE, seed=0):
    return irradiance(scene, *where, paths, seed)


@pytest.mark.parametrize("height", [1e-3, 0.3, 2.0])
def test_glowing_rectangle_by_lambert(height):
    """Radiosity 1 over [−½, ½] × [−1, 0]: the factor of the polygon, from its rim."""
    corners = np.array([[-0.5, -1, height], [-0.5, 0, height], [0.5, 0, height], [0.5, -1, height]])
    scene = above_floor(meshes.polygon(corners), exitance=np.array([[0.0], [1.0]]))
    expected = exact.point_to_polygon(np.array([0, -1.0, 0]), -DOWN, corners)
    found = seen(scene)
    close(found.direct, found.direct_error, expected, 0.01)
    assert found.indirect.max() == 0


def test_hidden_but_for_a_strip():
    """A glowing rectangle behind an opaque one just before it, but for a strip: Lambert's factor
    of the strip alone."""
    glowing = np.array([[-0.5, -0.9, 1], [-0.5, 0.5, 1], [0.5, 0.5, 1], [0.5, -0.9, 1]])
    strip = glowing.copy()
    strip[1:3, 1] = -0.8
    lid = glowing.copy() + 1e-4 * DOWN
    lid[[0, 3], 1] = -0.8
    scene = above_floor(meshes.polygon(glowing), meshes.polygon(lid),
                        exitance=np.array([[0.0], [1.0], [0.0]]))  # fmt: skip
    expected = exact.point_to_polygon(np.array([0, -1.0, 0]), -DOWN, strip)
    found = seen(scene, 100_000)
    close(found.direct, found.direct_error, expected, 0.03)


def test_furnace():
    """Radiosity 1 everywhere, so irradiance 1, of which 1 − ρ is direct."""
    scene = meshes.furnace_scene(0.7, level=2)
    where = np.arange(0, len(scene.triangles), 40), np.full((9, 2), 0.3)
    found = seen(scene, 10_000, where)
    close(found.direct, found.direct_error, 0.3, 0.02)
    close(found.indirect, found.indirect_error, 0.7, 0.02)


def test_closed_sphere():
    """φ the same everywhere for any emissions and reflectances; flat faces, 0.3 % of it."""
    q, rho = np.linspace(0.2, 1.6, 8), np.linspace(0.1, 0.8, 8)
    scene = meshes.sphere_scene(3, rho[:, None], q[:, None])
    area = meshes.areas(scene.vertices, scene.triangles)
    radiosity = exact.closed_sphere(q[scene.object], rho[scene.object], area)
    expected = (radiosity @ area) / area.sum()
    where = np.arange(0, 1280, 160), np.full((8, 2), 1 / 3)
    found = seen(scene, 20_000, where)
    total = (found.direct + found.indirect).mean(axis=0)[0]
    assert total == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("rho", [0.5, 0.9])
def test_facing_strips(rho):
    """Sparrow's: in the middle B = 1 + ρ H; H of strips 200 long is low by 1e-5 there."""
    scene = meshes.strips_scene(rho)
    found = seen(scene, 60_000, ([0], [[0.0, 0.5]]))
    error = np.hypot(found.direct_error, found.indirect_error) * 2
    expected = (exact.STRIPS[rho][0] - 1) / rho
    close(found.direct + found.indirect, error, expected, 0.02)


def test_point_sun_and_sky():
    """I cos θ / d² from (0, −1, 2): 1/4; a sun of irradiance 2 at 60°: 1; a white sky: π."""
    point = PointLamp("point", np.array([0, -1.0, 2]), np.ones(3))
    sun = SunLamp("sun", np.array([np.sqrt(0.75), 0, -0.5]), np.full(3, 2.0))
    found = seen(above_floor(lamps=(point, sun)))
    close(found.direct, found.direct_error, 1.25, 0.01)
    found = seen(above_floor(sky=Sky(np.ones((1, 1, 3), np.float32))), 1000)
    np.testing.assert_allclose(found.direct[0], np.pi, rtol=1e-9)


def test_soft_lamps():
    """A disk of radius 1 that faces from a distance 2 brings I / (d² + r²), a sphere I / d²."""
    for ball, expected in ((False, 0.2), (True, 0.25)):
        lamp = PointLamp("soft", np.array([0, -1.0, 2]), np.ones(3), 1.0, sphere=ball)
        found = seen(above_floor(lamps=(lamp,)))
        close(found.direct, found.direct_error, expected, 0.01)


def test_spot_sends_out_its_flux():
    """Into a closed box of one reflectance ½: the mean indirect irradiance is flux ρ / (A (1 − ρ)),
    here of a hard cone: flux 2π (1 − cos ½)."""
    scene = meshes.box_scene()
    lamp = PointLamp("spot", np.full(3, 0.5), np.ones(3), axis=DOWN, cone=1.0, blend=0.0)
    where = np.repeat(np.arange(12), 250), _places(3000)
    found = seen(replace(scene, lamps=(lamp,)), 60, where)
    expected = 2 * np.pi * (1 - np.cos(0.5)) / 6
    assert found.indirect[:, 0].mean() == pytest.approx(expected, rel=0.02)


def _places(count):
    places = np.random.default_rng(0).random((count, 2))
    return np.where(places.sum(axis=1, keepdims=True) > 1, 1 - places, places)


@pytest.mark.parametrize("spread", [np.pi, 1.0])
def test_area_lamp(spread):
    """Lambert's factor times π of a square of radiance 1; with a spread, its beam on the axis,
    tan h / (tan h − h) for a small lamp of area 1e-4 at a distance 1."""
    size = 1.0 if spread == np.pi else 1e-2
    u, v = np.array([size, 0, 0]), np.array([0, size, 0])
    lamp = AreaLamp("area", np.array([0, -1.0, 1]), u, v, DOWN, np.ones(3), False, spread)
    found = seen(above_floor(lamps=(lamp,)))
    corners = np.array([[-0.5, -1.5, 1], [0.5, -1.5, 1], [0.5, -0.5, 1], [-0.5, -0.5, 1]])
    expected = np.pi * exact.point_to_polygon(np.array([0, -1.0, 0]), -DOWN, corners)
    if spread < np.pi:
        half = spread / 2
        expected = 1e-4 * np.tan(half) / (np.tan(half) - half)
        assert found.direct[0, 0] == pytest.approx(expected, rel=0.01)
    else:
        close(found.direct, found.direct_error, expected, 0.01)


def test_ellipse():
    """A disk of radius 1 at a distance 1 on the axis: π r² / (r² + d²)."""
    u, v = np.array([2.0, 0, 0]), np.array([0, 2.0, 0])
    lamp = AreaLamp("area", np.array([0, -1.0, 1]), u, v, DOWN, np.ones(3), True)
    found = seen(above_floor(lamps=(lamp,)))
    close(found.direct, found.direct_error, np.pi / 2, 0.01)


def test_panes_tint_straight_light_and_two_sides_differ():
    """Two panes of transmittance (½, ¼, 1) before a white sky over the whole hemisphere: π τ². A
    pane black inside and glowing 2 on its back, that looks down: 2π."""
    pane = 100 * FLOOR
    scene = above_floor(*(meshes.polygon(pane + [0, 0, z]) for z in (0.05, 0.1)),
                        sky=Sky(np.ones((1, 1, 3), np.float32)))  # fmt: skip
    tau = np.array([0.5, 0.25, 1.0])
    black = Constant(np.zeros(3))
    glass = Material("glass", black, black, Constant(tau))
    scene = replace(scene, materials=(scene.materials[0], glass, glass))
    found = irradiance(scene, [0], [[0.25, 0.25]], 20_000)
    deviation = np.abs(found.direct - np.pi * tau**2)
    assert (deviation <= 4 * found.direct_error + 0.01).all()
    lid = Material("lid", black, black, black, Material("back", black, Constant(np.full(3, 2.0))))
    scene = replace(above_floor(meshes.polygon(pane + [0, 0, 0.05])),
                    materials=(scene.materials[0], lid))  # fmt: skip
    found = irradiance(scene, [0], [[0.25, 0.25]], 5000)
    close(found.direct, found.direct_error, 2 * np.pi, 0.01)


def test_one_lit_texel():
    """Of 5 × 5 texels on a square the middle one glows with radiance 10: its Lambert factor."""
    pixels = np.zeros((5, 5, 3), np.float32)
    pixels[2, 2] = 10
    square = np.array([[-0.5, -1, 1], [-0.5, 0, 1], [0.5, 0, 1], [0.5, -1, 1]])
    scene = above_floor(meshes.polygon(square))
    uv = (scene.vertices[scene.triangles][..., :2] + [0.5, 1]).astype(np.float32)
    black = Constant(np.zeros(3))
    sign = Material("sign", black, Texture(pixels, uv, "EXTEND", "Closest"))
    scene = replace(scene, materials=(scene.materials[0], sign))
    lit = (square - square.mean(axis=0)) / 5 + square.mean(axis=0)
    expected = 10 * np.pi * exact.point_to_polygon(np.array([0, -1.0, 0]), -DOWN, lit)
    found = seen(scene, 200_000)
    close(found.direct, found.direct_error, expected, 0.015)


def test_a_bright_pixel_of_the_sky():
    """Radiance 100 in one of 8 × 16 pixels, in the row from 45° to 67.5° up: its irradiance is 100
    Δφ (sin² b − sin² a) / 2."""
    pixels = np.zeros((8, 16, 3), np.float32)
    pixels[6, 3] = 100
    found = seen(above_floor(sky=Sky(pixels)))
    high, low = np.sin(np.radians([67.5, 45.0])) ** 2
    close(found.direct, found.direct_error, 100 * np.pi / 8 * (high - low) / 2, 0.01)


def test_errors_are_what_repetitions_scatter_by():
    """64 seeds: their standard deviation is known to 1/√128 = 9 %; three of those."""
    scene = meshes.box_scene(exitance=np.array([0, 0, 0, 0, 0, 1.0])[:, None])
    runs = [seen(scene, 500, ([8], [[0.3, 0.3]]), seed) for seed in range(64)]
    for name in ("direct", "indirect"):
        scatter = np.std([getattr(run, name)[0, 0] for run in runs], ddof=1)
        said = np.mean([getattr(run, name + "_error")[0, 0] for run in runs])
        assert scatter == pytest.approx(said, rel=0.27)


def test_refuses_what_it_does_not_know():
    with pytest.raises(ValueError, match="casts_shadow"):
        seen(replace(meshes.box_scene(), casts_shadow=np.ones(6, bool)))


@pytest.mark.parametrize("family", ["windows", "pictures", "panoramas", "panes"])
def test_lights_sampled_or_met_by_chance_are_the_same(family):
    """Means over eight points of a random scene, within four standard errors of the difference."""
    random = np.random.default_rng(3)
    build, scene, _ = FAMILIES[family](random)
    _, triangle, uv = small_receivers(build, scene, 8, random)
    found = [irradiance(scene, triangle, uv, 4000, 1, alone) for alone in (False, True)]
    for name in ("direct", "indirect"):
        means = [getattr(f, name).mean() for f in found]
        noise = [np.linalg.norm(getattr(f, name + "_error").mean(axis=1)) / 8 for f in found]
        assert abs(means[0] - means[1]) <= 4 * np.hypot(*noise), (name, means, noise)


def test_what_a_narrow_spot_lights_lights_the_room():
    """Light Φ that lands anywhere in a closed room of one reflectance ρ and area A: the mean
    indirect irradiance is Φ ρ / (A (1 − ρ)). Paths that meet the lit dot by chance are rare."""
    build, cone = Build(), np.radians(2.0)
    gray = build.material(0.5)
    build.room((1, 1, 1), gray, gray, gray)
    lamp = PointLamp("spot", np.array([0.4, 0.6, 0.7]), np.ones(3), 0.0, DOWN, cone, 1e-6)
    scene, random = build.scene([lamp]), np.random.default_rng(0)
    count = 2000
    uv = random.random((count, 2))
    uv[uv.sum(axis=1) > 1] = 1 - uv[uv.sum(axis=1) > 1]
    found = irradiance(scene, random.integers(0, 12, count), uv, 50, 1).indirect[:, 0]
    power = 2 * np.pi * (1 - np.cos(cone / 2))
    error = found.std() / np.sqrt(count)
    assert error < 0.03 * power / 6
    assert found.mean() == pytest.approx(power * 0.5 / (6 * 0.5), abs=4 * error)
