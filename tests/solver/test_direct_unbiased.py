"""Direct light of partly hidden lights: its expectation is the integral, for any number of samples.

A light stands at x = 0 over the floor z = 0, facing +x. An opaque sheet just before it, at x = GAP,
hides all above z = h. From a floor point at x = d the sheet's edge is seen before the height
h d / (d − GAP) of the light's own plane: the light below that is what arrives. Truths are Lambert's
polygon factor of the strip, or sums over a fine grid of the light.
"""

import numpy as np
import pytest

from radiosity_addon.solver.direct.irradiance import direct_light
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.gather.lighting import place_on
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.lambert import polygon_form_factor
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import AreaLamp, Material, PointLamp, Scene
from tests.solver import meshes

X, Y, Z = np.eye(3)
GAP, EDGE = 0.01, 0.2  # the sheet's distance from the light, the height of its lower edge
SAMPLES = 1 << 14  # of the footprint, each with random numbers of its own
HALF = 0.02  # half an edge of the footprint
GRID = 400  # cells along each axis of a light, in truths by sums


def square(center, u, v) -> np.ndarray:
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    return np.array([center - u - v, center + u - v, center + u + v, center - u + v])


def staged(lamp, distance: float):
    """The context of a ``lamp`` behind the sheet, and the footprints of two triangles of a floor
    patch ``distance`` away, which a larger floor surrounds."""
    patch = square((distance, 0, 0), (HALF, 0, 0), (0, HALF, 0))
    sheet = square((GAP, 0, EDGE + 2), (0, 3, 0), (0, 0, 2))
    far = square((4, 0, -1), (3, 0, 0), (0, 3, 0))  # so that the scene is large
    scene = meshes.scene([meshes.grid(corners, 1) for corners in (patch, sheet, far)], 0.0)
    black = Material("Black", Constant(np.zeros(3)))
    scene = Scene(scene.vertices, scene.triangles, np.zeros(6, np.int32), scene.object, (black,),
                  scene.objects, lamps=(lamp,))  # fmt: skip
    context = build_context(scene, 5, 1, silent)
    every = meshes.triangle_receivers(scene)
    assert isinstance(every, Receivers)
    return context, build_footprints(context.geometry, every)


def sampled(context, footprints, per: int) -> tuple[float, float]:
    """Mean irradiance of the patch and its standard error, each of SAMPLES estimates from ``per``
    points of one of its two triangles."""
    owners = np.arange(SAMPLES) % 2
    place = place_on(footprints, owners, per, 7, per)
    found, _ = direct_light(context, SAMPLES, per, place, (3, per), "gather")
    level = found.mean(axis=1) * context.unit
    return level.mean(), level.std() / np.sqrt(SAMPLES)


def over_patch(truth, distance: float) -> float:
    """Mean of ``truth(x, y)`` over the patch by Gauss's three points along each axis: exact for
    polynomials of degree 5."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    total = sum(
        a * b * truth(distance + HALF * x, HALF * y)
        for x, a in zip(nodes, weights) for y, b in zip(nodes, weights)
    )
    return total / 4


def seen_height(x: float) -> float:
    """Of the light's plane, from a floor point at x."""
    return EDGE * x / (x - GAP)


def by_sums(places, areas, facing, x: float, y: float) -> float:
    """Σ L cos cos' A / r² over ``places`` (n, 3) of a light that are not hidden, for radiance times
    cosine there ``facing(rays)`` (n,) and ``areas`` (n,)."""
    rays = places - [x, y, 0]
    r = np.linalg.norm(rays, axis=1)
    at_sheet = rays[:, 2] * (GAP - x) / rays[:, 0]
    seen = (at_sheet < EDGE) | (places[:, 0] > GAP)
    return (seen * np.maximum(rays[:, 2], 0) / r**3 * facing(rays / r[:, None]) * areas).sum()


def disc_grid(radius: float):
    """Places (n, 2) in a disc and their areas."""
    r = (np.arange(GRID) + 0.5) / GRID * radius
    turn = (np.arange(GRID) + 0.5) / GRID * 2 * np.pi
    r, turn = (a.ravel() for a in np.meshgrid(r, turn))
    places = np.stack([r * np.cos(turn), r * np.sin(turn)], 1)
    return places, r * (radius / GRID) * (2 * np.pi / GRID)


@pytest.mark.parametrize("per", [1, 4, 16])
@pytest.mark.parametrize("distance", [0.1, 0.5, 2.0, 6.0])
def test_strip_of_a_hidden_window(distance, per):
    """Lambert's factor of the strip below the seen height, times π, for a window 2 wide and 2 high
    that reaches 0.2 below the floor: near, far, and cut by the horizon."""
    lamp = AreaLamp("Window", 0.8 * Z, 2 * Y, 2 * Z, X, np.ones(3))

    def truth(x, y):
        h = seen_height(x)
        strip = [(0, -1, -0.2), (0, 1, -0.2), (0, 1, h), (0, -1, h)]
        factor = polygon_form_factor(np.array([[x, y, 0]]), Z[None], np.array(strip))
        return np.pi * float(factor[0])

    mean, error = sampled(*staged(lamp, distance), per)
    expected = over_patch(truth, distance)
    assert error < 0.01 * expected
    assert mean == pytest.approx(expected, abs=3 * error)


@pytest.mark.parametrize("per", [1, 4])
@pytest.mark.parametrize("spread", [np.pi, 1.5])
@pytest.mark.parametrize("distance", [0.3, 2.0])
def test_half_hidden_disc_lamp(distance, spread, per):
    """A disc of radius 0.3 about the sheet's edge, Lambertian or with a narrowed beam: linear in the
    tangent from the normal, 0 at half the spread, (tan h − tan θ) / (tan h − h)."""
    lamp = AreaLamp("Disc", EDGE * Z, 0.6 * Y, 0.6 * Z, X, np.ones(3), ellipse=True, spread=spread)
    flat, areas = disc_grid(0.3)
    places = np.stack([np.zeros(len(flat)), flat[:, 0], EDGE + flat[:, 1]], 1)
    half = spread / 2

    def facing(toward):
        cosine = -toward[:, 0]
        if spread == np.pi:
            return cosine
        tangent = np.sqrt(1 / cosine**2 - 1)
        return cosine * np.maximum(np.tan(half) - tangent, 0) / (np.tan(half) - half)

    mean, error = sampled(*staged(lamp, distance), per)
    expected = over_patch(lambda x, y: by_sums(places, areas, facing, x, y), distance)
    assert mean == pytest.approx(expected, abs=3 * error + 1e-3 * expected)  # of the sums


@pytest.mark.parametrize("per", [1, 4])
@pytest.mark.parametrize("distance", [0.4, 2.0])
@pytest.mark.parametrize("ball", [False, True])
def test_half_hidden_round_lamp(ball, distance, per):
    """A soft point lamp of intensity 1 and radius r = 0.25, 0.2 above the floor and so partly below
    it, half behind the sheet: a disc that faces the point, or, its soft falloff off, a sphere, of
    radiance 1 / πr². A sphere is seen as the disc that its outline spans, which lies d cos²σ away
    and has the radius r cosσ, sinσ = r / d."""
    radius = 0.25
    lamp = PointLamp("Lamp", EDGE * Z, np.ones(3), radius, ball=ball)
    flat, areas = disc_grid(1.0)

    def truth(x, y):
        toward = np.array([0, 0, EDGE]) - [x, y, 0]
        d = np.linalg.norm(toward)
        axis = toward / d
        cosine = np.sqrt(1 - (radius / d) ** 2) if ball else 1.0
        one = np.cross(axis, Z) / np.linalg.norm(np.cross(axis, Z))
        disc = flat * radius * cosine
        places = [x, y, 0] + axis * d * cosine**2 + disc @ np.stack([one, np.cross(one, axis)])
        facing = lambda rays: rays @ axis / (np.pi * radius**2)  # noqa: E731
        return by_direction(places, areas * (radius * cosine) ** 2, facing, x, y, axis * d, radius, ball)

    mean, error = sampled(*staged(lamp, distance), per)
    expected = over_patch(truth, distance)
    assert mean == pytest.approx(expected, abs=3 * error + 1e-3 * expected)


def by_direction(places, areas, facing, x, y, toward, radius, ball) -> float:
    """As ``by_sums``; a ray to a sphere ends on its surface."""
    rays = places - [x, y, 0]
    r = np.linalg.norm(rays, axis=1)
    unit = rays / r[:, None]
    end = r
    if ball:
        along = unit @ toward
        end = along - np.sqrt(np.maximum(along**2 - toward @ toward + radius**2, 0))
    last = x + unit[:, 0] * end
    at_sheet = unit[:, 2] * (GAP - x) / unit[:, 0]
    seen = (at_sheet < EDGE) | (last > GAP)
    return (seen * np.maximum(unit[:, 2], 0) / r**2 * facing(unit) * areas).sum()


@pytest.mark.parametrize("distance", [0.1, 2.0])
def test_seen_or_hidden_it_has_no_noise(distance):
    """Nothing before a window: a single sample brings all of its light, exactly where the cosine law
    places it. All behind a sheet: exactly nothing."""
    lamp = AreaLamp("Window", 0.5 * Z, Y, Z, X, np.ones(3))
    context, footprints = staged(lamp, distance)
    place = place_on(footprints, np.zeros(64, int), 4, 1)
    open_ = context.__class__(**{**context.__dict__, "blockers": (context.blockers[0].__class__(None, None),)})
    found, _ = direct_light(open_, 64, 4, place, (1,), "gather")
    assert found.std() < 0.02 * found.mean()
    place = place_on(footprints, np.full(64, 4), 4, 1)  # the floor far below, all hidden
    found, _ = direct_light(context, 64, 4, place, (1,), "gather")
    assert found.max() == 0
