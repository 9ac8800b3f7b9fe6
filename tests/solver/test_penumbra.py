"""Half shadows: points of a receiver and places on a lamp are sampled as one, not in step."""

import numpy as np

from radiosity_addon.solver.direct.irradiance import direct_light
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.gather.lighting import points_on_footprints
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import AreaLamp, Material, Scene
from verification import exact, meshes

SQUARE = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
SHUTTER = np.array([(0, -3, 0.5), (3, -3, 0.5), (3, 3, 0.5), (0, 3, 0.5)])
X, Y, Z = np.eye(3)
POINTS, SEEDS = 1024, 16


def shuttered_square() -> tuple[Scene, Receivers]:
    """A unit square under a lamp of its size, 1 above, and a shutter halfway that covers x > 0."""
    scene = meshes.scene([meshes.grid(SQUARE, 1), meshes.grid(SHUTTER, 1)], 0.0)
    lamp = AreaLamp("Lamp", Z, X, Y, -Z, np.ones(3))
    black = Material("Black", Constant(np.zeros(3)))
    scene = Scene(scene.vertices, scene.triangles, np.zeros(4, np.int32), scene.object, (black,),
                  scene.objects, lamps=(lamp,))  # fmt: skip
    return scene, meshes.triangle_receivers(scene)


def test_half_of_a_penumbra_is_half_the_light():
    """A point x of the square sees the lamp's place s where x + s < 0. Turning both over swaps seen
    and hidden pairs and leaves their kernel: half of π·F comes through. Points and places that lie
    on one plane of their four dimensions, as equal digits of two sequences make them, are wrong by
    10 % however many there are. Independent ones would be by 1/√1024 = 3 %; a set of four
    dimensions is better."""
    scene, receivers = shuttered_square()
    truth = np.pi * exact.parallel_rectangles(1, 1, 1) / 2
    errors = []
    for seed in range(SEEDS):
        context = build_context(scene, seed, 1, silent)
        footprints = build_footprints(context.geometry, receivers)
        place = points_on_footprints(footprints, np.arange(2), POINTS, seed, 20)
        found, _ = direct_light(context, 2, POINTS, place, (seed, 20), "gather")
        errors.append(found[:2].mean() / truth - 1)
    assert np.sqrt(np.mean(np.square(errors))) < 0.01
