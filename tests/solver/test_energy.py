"""The energy balance is the scene's own: exact powers, and shares that can be derived.

Shares come from 2048 particles: an estimate of p scatters by at most √(p(1−p)/2048) ≤ 0.011.
"""

import numpy as np
import pytest

from radiosity_addon.solver.energy import energy_balance
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.scene import AreaLamp, Material, PointLamp, Scene, Sky, SunLamp
from verification import meshes

SCATTER = 3 * 0.011  # three standard deviations
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)


def scene_of(mesh, reflectance=0.0, emission=0.0, transmittance=0.0, **others) -> Scene:
    """One object of one material; ``emission`` is a radiance."""
    vertices, triangles = mesh
    numbers = np.zeros(len(triangles), np.int32)
    values = (Constant(np.full(3, value)) for value in (reflectance, emission, transmittance))
    return Scene(
        vertices, triangles, numbers, numbers, (Material("m", *values),), ("thing",), **others
    )


def balance(scene: Scene, seed: int = 0):
    """Emitted, absorbed and escaped power [W], having checked that it balances."""
    found = energy_balance(build_context(scene, seed, 1, lambda *_: None))
    assert found["absorbed"] + found["escaped"] == pytest.approx(found["emitted"], rel=1e-12)
    return found["emitted"], found["absorbed"], found["escaped"]


def lamp(watts: float, **others) -> PointLamp:
    return PointLamp("lamp", np.zeros(3), np.full(3, watts / (4 * np.pi)), **others)


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.9])
def test_lamp_in_a_sphere_that_lacks_an_octant(reflectance):
    """f = 1/8 of the light leaves at once, and of what a wall reflects, which reaches all parts of
    a sphere alike, f again: escaped/emitted = f + (1 − f) ρ f / (1 − ρ (1 − f))."""
    vertices, triangles = meshes.icosphere(3)
    present = (vertices[triangles].mean(axis=1) < 0).any(axis=1)
    f = 1 / 8
    scene = scene_of((vertices, triangles[present]), reflectance, lamps=(lamp(100.0),))
    emitted, _, escaped = balance(scene)
    assert emitted == pytest.approx(100, rel=1e-12)
    expected = f + (1 - f) * reflectance * f / (1 - reflectance * (1 - f))
    assert escaped / emitted == pytest.approx(expected, abs=SCATTER)


def test_spot_emits_what_its_beam_lets_through():
    """Sharp cone of half angle 60°: P/4π · 2π (1 − cos 60°) = P/4. Blended all over it is half:
    a smoothstep's mean over the cone's cosines."""
    for blend, share in ((0.0, 1 / 4), (1.0, 1 / 8)):
        spot = lamp(100.0, axis=np.array([0, 0, -1.0]), cone=np.radians(120), blend=blend)
        emitted, _, escaped = balance(scene_of(meshes.icosphere(2), lamps=(spot,)))
        assert emitted == pytest.approx(100 * share, rel=1e-9)
        assert escaped == 0


@pytest.mark.parametrize("spread", [np.pi, 1.0])
def test_area_lamp_emits_its_watts_whatever_its_spread(spread):
    """π · radiance · area on one side; straight down onto a plate 2 m wide from 1 mm above."""
    down = AreaLamp(
        "panel", np.array([0, 0, 1e-3]), np.array([0.2, 0, 0]), np.array([0, 0.5, 0]),
        np.array([0, 0, -1.0]), np.full(3, 7.0), spread=spread,
    )  # fmt: skip
    emitted, _, escaped = balance(scene_of(meshes.polygon(SQUARE), 0.25, lamps=(down,)))
    assert emitted == pytest.approx(np.pi * 7 * 0.1, rel=1e-9)
    assert escaped / emitted == pytest.approx(0.25, abs=1e-3)


@pytest.mark.parametrize("size", [1.0, 100.0])
def test_faces_emit_on_both_sides(size):
    """2 π · radiance · area, of a face that is sampled and of a whole scene that glows."""
    mesh = meshes.polygon(size * SQUARE)
    emitted, absorbed, escaped = balance(scene_of(mesh, 0.5, emission=3.0))
    assert emitted == pytest.approx(2 * np.pi * 3 * 4 * size**2, rel=1e-9)
    assert (absorbed, escaped) == (0, emitted)


def test_sun_and_sky_count_what_reaches_a_surface():
    """A sun at 60° of irradiance 2 on 4 m²: 2 · 4 · ½ = 4 W. A sky of radiance 1 sees both sides:
    2 · 4 · π W. Both reach the plate's share of the covering disk only, at most a tenth of 2048."""
    slanted = np.array([0, np.sin(np.pi / 3), -np.cos(np.pi / 3)])
    plate = meshes.polygon(SQUARE)
    sun = SunLamp("sun", slanted, np.full(3, 2.0))
    emitted, _, escaped = balance(scene_of(plate, 0.5, lamps=(sun,)))
    assert emitted == pytest.approx(4, rel=0.2)
    assert escaped / emitted == pytest.approx(0.5, rel=1e-6)
    emitted, _, escaped = balance(scene_of(plate, 0.5, sky=Sky(np.ones((1, 1, 3)))))
    assert emitted == pytest.approx(8 * np.pi, rel=0.2)
    assert escaped / emitted == pytest.approx(0.5, rel=1e-6)


def test_light_goes_through_a_pane():
    """Reflectance 0.2 and transmittance 0.5: 0.3 of what meets the pane stays, the rest leaves."""
    sun = SunLamp("sun", np.array([0, 0, -1.0]), np.ones(3))
    pane = scene_of(meshes.polygon(SQUARE), 0.2, transmittance=0.5, lamps=(sun,))
    emitted, absorbed, _ = balance(pane)
    assert absorbed / emitted == pytest.approx(0.3, abs=SCATTER)


def test_a_room_that_hardly_absorbs_keeps_all_in_the_end():
    """Closed, reflectance 0.999: nothing escapes, however long it is on its way."""
    emitted, absorbed, _ = balance(scene_of(meshes.icosphere(2), 0.999, lamps=(lamp(1.0),)))
    assert absorbed == pytest.approx(emitted, rel=1e-12)


def test_no_light_is_nothing():
    assert balance(scene_of(meshes.icosphere(1), 0.5)) == (0, 0, 0)
