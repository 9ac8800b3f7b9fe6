"""Direct light of partly hidden lights: its expectation is the integral, for any number of samples.

A light stands at x = 0 over the floor z = 0, facing +x. An opaque sheet just before it, at x = GAP,
hides all above z = h. From a floor point at x = d the sheet's edge is seen before the height
h d / (d − GAP) of the light's own plane: the light below that is what arrives. Truths are Lambert's
polygon factor of the strip, or sums over a fine grid of the light.
"""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.direct.irradiance import direct_light
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.gather.lighting import points_on_footprints
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.lambert import polygon_form_factor
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import AreaLamp, Material, PointLamp, Scene
from verification import meshes
from verification import stability_scenes as scenes

X, Y, Z = np.eye(3)
GAP, EDGE = 0.01, 0.2  # the sheet's distance from the light, the height of its lower edge
SAMPLES = 1 << 14  # of the footprint, each with random numbers of its own
HALF = 0.02  # half an edge of the footprint
GRID = 400  # cells along each axis of a light, in truths by sums


def square(center, u, v) -> np.ndarray:
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    return np.array([center - u - v, center + u - v, center + u + v, center - u + v])


def staged(lamp, distance: float, low: float = EDGE):
    """The context of a ``lamp`` behind the sheet, whose edge is ``low`` above the floor, and the
    footprints: the first two are of a floor patch ``distance`` away."""
    patch = square((distance, 0, 0), (HALF, 0, 0), (0, HALF, 0))
    sheet = square((GAP, 0, low + 2), (0, 3, 0), (0, 0, 2))
    far = square((4, 0, -1), (3, 0, 0), (0, 3, 0))  # so that the scene is large
    scene = meshes.scene([meshes.grid(corners, 1) for corners in (patch, sheet, far)], 0.0)
    black = Material("Black", Constant(np.zeros(3)))
    scene = Scene(scene.vertices, scene.triangles, np.zeros(6, np.int32), scene.object, (black,),
                  scene.objects, lamps=(lamp,))  # fmt: skip
    context = build_context(scene, 5, 1, silent)
    return context, build_footprints(context.geometry, meshes.triangle_receivers(scene))


def sampled(context, footprints, per: int) -> tuple[float, float]:
    """Mean irradiance of the patch and its standard error, each of SAMPLES estimates from ``per``
    points of one of its two triangles."""
    owners = np.arange(SAMPLES) % 2
    place = points_on_footprints(footprints, owners, per, 7, per)
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


def disk_grid(radius: float):
    """Places (n, 2) in a disk and their areas."""
    r = (np.arange(GRID) + 0.5) / GRID * radius
    turn = (np.arange(GRID) + 0.5) / GRID * 2 * np.pi
    r, turn = (a.ravel() for a in np.meshgrid(r, turn))
    places = np.stack([r * np.cos(turn), r * np.sin(turn)], 1)
    return places, r * (radius / GRID) * (2 * np.pi / GRID)


@pytest.mark.parametrize("per", [1, 4, 16])
@pytest.mark.parametrize("distance", [0.1, 0.5, 6.0])
def test_strip_of_a_hidden_window(distance, per):
    """Lambert's factor of the strip below the seen height, times π, for a window 2 wide and 2 high
    that reaches 0.2 below the floor: near, far, and cut by the horizon."""
    lamp = AreaLamp("Window", 0.8 * Z, 2 * Y, 2 * Z, X, np.ones(3))

    def below(x, y, h):
        strip = [(0, -1, -0.2), (0, 1, -0.2), (0, 1, h), (0, -1, h)]
        factor = polygon_form_factor(np.array([[x, y, 0]]), Z[None], np.array(strip))
        return np.pi * float(factor[0])

    mean, error = sampled(*staged(lamp, distance), per)
    expected = over_patch(lambda x, y: below(x, y, seen_height(x)), distance)
    assert error < 0.008 * below(distance, 0, 1.8)  # of the whole window's light
    assert mean == pytest.approx(expected, abs=3 * error)


@pytest.mark.parametrize("per", [1, 4])
@pytest.mark.parametrize("spread", [np.pi, 1.5])
@pytest.mark.parametrize("distance", [0.3, 2.0])
def test_half_hidden_disk_lamp(distance, spread, per):
    """A disk of radius 0.3 about the sheet's edge, Lambertian or with a narrowed beam: linear in the
    tangent from the normal, 0 at half the spread, (tan h − tan θ) / (tan h − h)."""
    lamp = AreaLamp("Disk", EDGE * Z, 0.6 * Y, 0.6 * Z, X, np.ones(3), ellipse=True, spread=spread)
    flat, areas = disk_grid(0.3)
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
    it, half behind the sheet: a disk that faces the point, or, its soft falloff off, a sphere, of
    radiance 1 / πr². A sphere is seen as the disk that its outline spans, which lies d cos²σ away
    and has the radius r cosσ, sinσ = r / d."""
    radius = 0.25
    lamp = PointLamp("Lamp", EDGE * Z, np.ones(3), radius, sphere=ball)
    flat, areas = disk_grid(1.0)

    def truth(x, y):
        toward = np.array([0, 0, EDGE]) - [x, y, 0]
        d = np.linalg.norm(toward)
        axis = toward / d
        cosine = np.sqrt(1 - (radius / d) ** 2) if ball else 1.0
        one = np.cross(axis, Z) / np.linalg.norm(np.cross(axis, Z))
        disk = flat * radius * cosine
        places = [x, y, 0] + axis * d * cosine**2 + disk @ np.stack([one, np.cross(one, axis)])
        facing = lambda rays: rays @ axis / (np.pi * radius**2)  # noqa: E731
        end = sphere_end(axis * d, radius) if ball else None
        return by_direction(places, areas * (radius * cosine) ** 2, facing, x, y, end)

    mean, error = sampled(*staged(lamp, distance), per)
    expected = over_patch(truth, distance)
    assert mean == pytest.approx(expected, abs=3 * error + 1e-3 * expected)


def sphere_end(toward, radius: float):
    """How far rays (n, 3) of length 1 go to the sphere of this ``radius`` whose middle is ``toward``."""

    def end(unit):
        along = unit @ toward
        return along - np.sqrt(np.maximum(along**2 - toward @ toward + radius**2, 0))

    return end


def by_direction(places, areas, facing, x, y, end=None) -> float:
    """As ``by_sums``; ``end`` tells how far rays go: None: to the places."""
    rays = places - [x, y, 0]
    r = np.linalg.norm(rays, axis=1)
    unit = rays / r[:, None]
    last = x + unit[:, 0] * (r if end is None else end(unit))
    at_sheet = unit[:, 2] * (GAP - x) / unit[:, 0]
    seen = (at_sheet < EDGE) | (last > GAP)
    return (seen * np.maximum(unit[:, 2], 0) / r**2 * facing(unit) * areas).sum()


def free_light(context, place, count: int) -> np.ndarray:
    """(count,) Lambert's irradiance of the context's one window at points' middles."""
    (window,) = context.sources.batches
    middles = place(np.arange(count), 0).middles()
    corners = [window.origin[0] + s * window.u[0] + t * window.v[0]
               for s, t in ((0, 0), (1, 0), (1, 1), (0, 1))]  # fmt: skip
    return np.pi * polygon_form_factor(middles.position.T, middles.normal.T, corners)


def seen_whole(distance, per, owners):
    """What so many owners of ``per`` points find of a window that the sheet hides nothing of, and what
    Lambert's formula gives. For the closest it looks 14 times as large as it is far."""
    lamp = AreaLamp("Window", 0.5 * Z, Y, Z, X, np.ones(3))
    context, footprints = staged(lamp, distance, 1.5)
    place = points_on_footprints(footprints, np.zeros(owners, int), per, 1)
    found, _ = direct_light(context, owners, per, place, (1,), "gather")
    color = context.sources.batches[0].color[0, 0]
    single = lambda some, _: place(some, 0)  # noqa: E731
    return found[:, 0], color * free_light(context, single, owners)


def test_a_window_seen_whole_has_no_noise():
    """Four samples of any law bring all of their owner's light. Other points are in groups of their
    own: the places' spread is all there is."""
    found, expected = seen_whole(2.0, 4, 64)
    assert found.std() < 0.01 * found.mean()
    assert found.mean() == pytest.approx(expected.mean(), rel=5e-3)


@pytest.mark.parametrize("distance", [0.1, 1.0])
def test_single_points_have_the_spread_of_cosines_at_most(distance):
    """Directions uniform in a solid angle bring its size times their cosines. These lie in [0, 1]: with
    a mean of m their variance is m (1 − m) at most. Half of the closest window's solid angle is that
    of low directions: m is 0.3 or more there."""
    found, expected = seen_whole(distance, 1, 4096)
    assert found.std() < np.sqrt(0.7 / 0.3) * expected.mean()
    assert found.mean() == pytest.approx(expected.mean(), abs=4 * found.std() / 64)


@pytest.mark.parametrize("distance", [0.1, 2.0])
def test_a_window_all_hidden_brings_exactly_nothing(distance):
    lamp = AreaLamp("Window", 0.5 * Z, Y, Z, X, np.ones(3))
    context, footprints = staged(lamp, distance, -0.1)
    for per in (1, 4):
        place = points_on_footprints(footprints, np.zeros(64, int), per, 1)
        found, _ = direct_light(context, 64, per, place, (1,), "gather")
        assert found.max() == 0


def lit_room(window: AreaLamp) -> float:
    """Mean radiosity of a unit room of reflectance 0.5, over two seeds, that is lit by a window
    behind a black sheet which covers all of its wall above z = 0.2."""
    sheet = square((0.0022, 0.5, 0.55), (0, 0.5, 0), (0, 0, 0.35))
    parts = [*scenes.walls(2), meshes.grid(sheet, 1)]
    scene = meshes.scene(parts, [[0.5] * 3] * 6 + [[0.0] * 3])
    scene = replace(scene, lamps=(window,))
    return np.mean([scenes.part_means(scene, 0.03, seed=seed)[:6].mean() for seed in range(2)])


def test_a_room_behind_a_hidden_window():
    """A window 0.1 to 0.9 high whose upper seven eighths the sheet hides brings what a window does
    that ends at the sheet's edge. Through the gap of 2e-4 a place 0.5 away sees 2e-4 / 0.5 · 0.2 =
    8e-5 more of its 0.1: 0.08 %, and nearer ones little of it. The means have a standard error of
    0.25 % each (as the seeds tell): 1 % is 2.8 of their difference's. Taken by area with the shares of
    samples alone, the elements' light is wrong by tens of percent."""
    whole = AreaLamp("Window", np.array([0.002, 0.5, 0.5]), 0.8 * Y, 0.8 * Z, X, np.ones(3))
    strip = replace(whole, center=np.array([0.002, 0.5, 0.15]), v=0.1 * Z)
    assert lit_room(whole) == pytest.approx(lit_room(strip), rel=0.01)
