"""Reflectors: small bright patches are sampled as lights from afar, and found by rays from nearby."""


import numpy as np

from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requests import build_replicate
from radiosity_addon.solver.gather.lighting import Aim, add_gathered, no_light
from radiosity_addon.solver.lights.far_polygons import FarPolygons
from radiosity_addon.solver.lights.flat_shapes import RECTANGLE
from radiosity_addon.solver.lights.polygons import lamp_polygons
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


def test_far_polygons_light_only_from_afar():
    square = np.array([[[0.0, 0, 1]], [[0.1, 0, 0]], [[0, 0.1, 0]], [[0, 0, -1.0]]])
    plain = lamp_polygons(np.ones((1, 1)), np.array([RECTANGLE]), *square, np.array([np.pi]))
    far = FarPolygons(**vars(plain), nearest=np.array([0.5]))
    position = np.array([[0.05, 0.05, z] for z in (0.0, 0.4, 0.6, 0.9)])
    up, xi = np.tile([0, 0, 1.0], (4, 1)), np.full((4, 2), 0.5)
    one, other = (each.sample(np.zeros(4, int), position, up, xi) for each in (plain, far))
    assert np.array_equal(other.irradiance, np.where([True, True, False, False], one.irradiance, 0))
    assert (one.irradiance > 0).all()
