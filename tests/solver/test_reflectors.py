"""Reflectors: small bright patches are sampled as lights from afar, and found by rays from nearby."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requests import build_replicate
from radiosity_addon.solver.adaptive.solve_cache import SolveCache
from radiosity_addon.solver.gather.lighting import Aim, add_gathered, no_light
from radiosity_addon.solver.gather.reflectors import _lights
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.far_polygons import FarPolygons
from radiosity_addon.solver.lights.flat_shapes import RECTANGLE
from radiosity_addon.solver.lights.polygons import lamp_polygons
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import SunLamp
from radiosity_addon.solver.sequence import solve
from verification import meshes

RAYS = 32


class Asked:
    seed, passes, target_error = 0, ("direct", "indirect"), 0.03


def room_under_a_tube(glow=50.0, ceiling=0.7):
    """A room of 4 × 4 × 3 m, whose only light is a strip of 4 × 40 cm, which glows upward, 3 cm below a plate of 20 × 60 cm."""
    corners, _ = meshes.box_polygons((4, 4, 3))
    plate = np.array([[1.9, 1.7, 2.5], [1.9, 2.3, 2.5], [2.1, 2.3, 2.5], [2.1, 1.7, 2.5]])
    strip = np.array([[1.98, 1.8, 2.47], [2.02, 1.8, 2.47], [2.02, 2.2, 2.47], [1.98, 2.2, 2.47]])
    parts = [*(meshes.grid(face, 12) for face in corners), meshes.grid(plate, 8), meshes.polygon(strip)]
    reflectance = np.array([[0.5]] * 5 + [[ceiling], [0.8], [0.0]])
    return meshes.scene(parts, reflectance, np.array([[0.0]] * 7 + [[glow]]))


def replicate_of(scene):
    receivers = meshes.triangle_receivers(scene, 1)
    found = build_replicate(scene, receivers, Asked(), 1)
    found.solve(make_plan(0.03, receivers.count, False))
    return found, receivers


def gathered(replicate, reflectors, step: int) -> np.ndarray:
    """(R,) what RAYS rays of each receiver bring, with the radiosities as they were solved."""
    count, split, radiosity = replicate.placed.count, replicate.split, replicate.radiosity
    if reflectors is not None:
        split, radiosity = reflectors.applied(split, radiosity)
    light, parts = no_light(count, replicate.context.channels), [(np.arange(count), RAYS)]
    add_gathered(split, replicate.placed.footprints, light, radiosity, parts, step, aim=Aim())
    return light.bounced[:, 0] / light.rays[:, 0]


def test_light_is_the_same_in_the_mean_with_less_noise():
    """Of receivers of all walls, floor and ceiling, 16 times as many rays in all; the plate's own are left out."""
    scene = room_under_a_tube()
    replicate, receivers = replicate_of(scene)
    reflectors = replicate.reflectors
    assert reflectors is not None
    far = scene.object[receivers.triangle] < 6
    by_lights, by_rays = (
        np.array([gathered(replicate, each, step) for step in range(16)])[:, far] for each in (reflectors, None)
    )
    area = replicate.placed.footprints.area[far]
    means = [found @ area / area.sum() for found in (by_lights, by_rays)]
    noise = np.sqrt(sum(mean.var(ddof=1) / len(mean) for mean in means))
    assert abs(means[0].mean() - means[1].mean()) < 3.5 * noise < 0.05 * means[0].mean()
    assert by_lights.var(axis=0).mean() < 0.05 * by_rays.var(axis=0).mean()


def test_only_small_bright_patches_are_reflectors():
    replicate, receivers = replicate_of(room_under_a_tube())
    middle = replicate.reflectors.lights.middle()[0]
    size = replicate.context.geometry.normalized(np.array([2.0, 2.0, 2.5]))
    assert np.abs(middle - size).max() < replicate.context.geometry.normalized(np.array([2.4, 2, 2.5]))[0] - size[0]
    box = meshes.box_scene(divisions=4, exitance=np.eye(6)[:1].T)
    assert replicate_of(box)[0].reflectors is None


def room_with_a_sunbeam(reflectance=0.5):
    """A room of 4 × 4 × 3 m with a hole of 10 cm in a wall, whose sunbeam lands on a few triangles of the floor: the scene, and what
    they reflect of it, ρ E A cosθ."""
    corners, _ = meshes.box_polygons((4, 4, 3))
    wall = next(k for k, face in enumerate(corners) if (face[:, 1] == 0).all())
    (x, z), a, b = (1.9, 2.0), 0.1, 0.13
    bands = [(0, x, 0, 3), (x + a, 4, 0, 3), (x, x + a, 0, z), (x, x + a, z + b, 3)]
    turned = [(0, 1, 2, 3), (3, 2, 1, 0)][int(np.cross(*(corners[wall][1:3] - corners[wall][0]))[1] < 0)]
    pieces = [np.array([(l, 0, u), (l, 0, o), (r, 0, o), (r, 0, u)], float)[list(turned)] for l, r, u, o in bands]
    parts = [meshes.grid(face, 40) for k, face in enumerate(corners) if k != wall] + [meshes.grid(each, 4) for each in pieces]
    direction = np.array([0.1, 0.6, -0.7]) / np.linalg.norm([0.1, 0.6, -0.7])
    scene = replace(meshes.scene(parts, reflectance), lamps=(SunLamp("sun", direction, np.full(3, 2.0), 0.01),))
    return scene, reflectance * 2.0 * direction[1] * a * b


def test_all_of_a_sunbeam_through_a_small_hole_is_in_reflectors():
    """The points of most of the rows that it lights are dark. What is not ten times the mean, at the beam's edges, may lack."""
    scene, expected = room_with_a_sunbeam()
    replicate, _ = replicate_of(scene)
    lights, unit = replicate.reflectors.lights, replicate.context.unit
    flux = lights.power[:, 0].sum() * replicate.context.geometry.scale**2 * unit
    assert flux == pytest.approx(expected, rel=0.03)


def test_reflectors_that_bring_most_light_light_rows_too():
    """Outside the room nothing reflects, and next to nothing leaves it: by any path all surfaces together reflect P / (1 − ρ).
    Of a few rays of a row hardly one finds the sunbeam. Were they all that lights a row, its deviation would be twelve times the mean."""
    scene, expected = room_with_a_sunbeam(0.8)
    replicate, _ = replicate_of(scene)
    own, radiosity = replicate.placed.footprints, replicate.radiosity
    light = radiosity.reflected[: own.count, 0].astype(float) * replicate.context.unit
    total = own.area @ light * replicate.context.geometry.scale**2
    assert total == pytest.approx(expected / (1 - 0.8), rel=0.03)
    usual = light[light < 10 * np.median(light)]
    assert len(usual) > 0.99 * len(light)
    assert usual.std() < 0.3 * usual.mean()


def test_a_solve_that_was_kept_gives_the_same_light_again():
    """What is known of reflectors is found anew, and not added to what it was before."""
    scene, _ = room_with_a_sunbeam()
    receivers, kept, settings = meshes.triangle_receivers(scene, 1), SolveCache(), Settings(error=0.2, threads=1)
    first = solve(scene, receivers, settings, cache=kept)
    again = solve(scene, receivers, settings, cache=kept)
    assert again.statistics.rays < first.statistics.rays
    assert np.array_equal(first.indirect, again.indirect)


def test_a_light_of_few_cells_is_divided():
    square = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    triangle = (np.array([(0.0, 0, 2), (1, 0, 2), (0, 1, 2)]), np.array([[0, 1, 2]]))
    scene = meshes.scene([meshes.polygon(square), triangle], 0.5)
    own = build_footprints(build_context(scene, 0, 1, silent).geometry, meshes.triangle_receivers(scene))
    for square in (np.zeros(3, bool), np.ones(3, bool)):
        cells = replace(own, square=square)
        lights = _lights(cells, np.arange(3), np.ones((3, 1)), np.zeros(3))
        area = own.area * np.where(square, 2, 1)
        assert len(lights.area) == 12 and lights.area.reshape(3, 4).sum(axis=1) == pytest.approx(area)
        middle, _ = lights.middle()
        assert middle.reshape(3, 4, 3).mean(axis=1) == pytest.approx(cells.middle()[0], abs=1e-5)


def test_far_polygons_light_only_from_afar():
    square = np.array([[[0.0, 0, 1]], [[0.1, 0, 0]], [[0, 0.1, 0]], [[0, 0, -1.0]]])
    plain = lamp_polygons(np.ones((1, 1)), np.array([RECTANGLE]), *square, np.array([np.pi]))
    far = FarPolygons(**vars(plain), nearest=np.array([0.5]))
    position = np.array([[0.05, 0.05, z] for z in (0.0, 0.4, 0.6, 0.9)])
    up, xi = np.tile([0, 0, 1.0], (4, 1)), np.full((4, 2), 0.5)
    one, other = (each.sample(np.zeros(4, int), position, up, xi) for each in (plain, far))
    assert np.array_equal(other.irradiance, np.where([True, True, False, False], one.irradiance, 0))
    assert (one.irradiance > 0).all()
