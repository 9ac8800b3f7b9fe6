"""The whole solver in closed scenes with exact solutions: within half a percent."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from verification import exact, meshes
from verification.error import relative_error
from verification.exact_solves import SHARP, deviation, radiosity

HALF_PERCENT = 5e-3


def test_furnace_around_a_blob():
    """E = 1 − ρ, ρ = 0.9 in a closed scene: B = 1 whatever stands in it. Leaks, lost rays, wrong sides and
    growing energy would all show."""
    scene = meshes.furnace_scene(0.9, level=4, divisions=4)
    assert deviation(radiosity(scene), 1.0) < HALF_PERCENT


def test_closed_sphere_with_eight_emissions_and_reflectances():
    random = np.random.default_rng(0)
    q, rho = random.uniform(0, 1, 8), random.uniform(0, 0.9, 8)
    scene = meshes.sphere_scene(3, rho[:, None], q[:, None])
    area = meshes.areas(scene.vertices, scene.triangles)
    expected = exact.closed_sphere(q[scene.object], rho[scene.object], area)
    found = radiosity(scene)
    assert relative_error(found[:, None], expected[:, None]).error < HALF_PERCENT
    for octant in range(8):
        mine = scene.object == octant
        power = found[mine] @ area[mine]
        assert power == pytest.approx(expected[mine] @ area[mine], rel=SHARP.error)


def test_concentric_spheres():
    """1280 flat faces a sphere: the gap's view factors differ from the spheres' by 0.1 %."""
    q, rho = (1.0, 0.2), (0.5, 0.8)
    scene = meshes.concentric_scene(3, 1.0, 2.0, rho, q)
    expected = np.array(exact.concentric_radiosity(1.0, 2.0, q, rho))[scene.object]
    found = radiosity(scene)
    for sphere in range(2):
        mine = scene.object == sphere
        assert found[mine].mean() == pytest.approx(expected[mine][0], rel=HALF_PERCENT)


def test_manufactured_cube():
    """B constant on every face; what is judged is the mean over each (linear E on 1/16 cells)."""
    truth = np.array([1.0, 2.0, 0.5, 0.7, 1.5, 3.0])
    rho = np.array([0.5, 0.1, 0.2, 0.1, 0.2, 0.4])
    scene = meshes.manufactured_cube(truth, rho, 16)
    found = radiosity(scene)
    for face in range(6):
        mean = found[scene.object == face].mean()
        assert mean == pytest.approx(truth[face], rel=HALF_PERCENT)


def glowing_box(reflectance, glow):
    """A closed box of these colors (3,)."""
    corners, _ = meshes.box_polygons()
    return meshes.scene([meshes.grid(face, 2) for face in corners], reflectance[None], glow[None])


@pytest.mark.parametrize("channel", [0, 2])
def test_light_of_one_color_that_never_leaves_is_refused(channel):
    """A closed box that glows, and reflects all light of one color."""
    box = glowing_box(np.where(np.arange(3) == channel, 1.0, 0.5), np.ones(3))
    with pytest.raises(ValueError, match="of one color at least"):
        solve(box, meshes.triangle_receivers(box, 2), Settings(error=0.03))


def test_a_color_without_light_may_be_reflected_for_ever():
    """The same box where that color has no light."""
    reflectance = np.array([0.5, 0.5, 1.0])
    glow = np.where(reflectance < 1, 1.0, 0.0)
    dark = glowing_box(reflectance, glow)
    found = compose(solve(dark, meshes.triangle_receivers(dark, 2), Settings(error=0.03)), Settings().passes)
    assert np.allclose(found, 2 * glow / np.pi, rtol=0.03)
