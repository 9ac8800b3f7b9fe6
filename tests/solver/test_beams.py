"""Narrow spots, which points spread over the surface miss.

In a closed room of one reflectance ρ and area A, light Φ that lands anywhere is reflected ρ Φ; each
reflection returns ρ of it: the mean indirect irradiance is Φ ρ / (A (1 − ρ)), wherever it lands.
"""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.direct.beams import find_beams, split_beams
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.scene import PointLamp
from radiosity_addon.solver.sequence import solve
from verification import meshes
from verification.build import Build

RHO, BLEND = 0.5, 0.2
DOWN = np.array([0.13, 0.21, -1.0])
TO_THE_EDGE = np.array([0.5, 0.1, -0.9])  # where the floor meets a wall


def spot(cone: float, axis=DOWN, intensity=1.0, radius=0.0) -> PointLamp:
    """Below the middle of a unit room's ceiling."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    place = np.array([0.5, 0.5, 0.9])
    return PointLamp("spot", place, np.full(3, intensity), radius, axis, cone, BLEND, False)


def flux(cone: float) -> float:
    """[W] of intensity 1, in steps of the cosine: the smoothstep of its blend integrated."""
    edge = np.cos(cone / 2)
    t = np.clip((np.linspace(edge, 1, 200_001) - edge) / ((1 - edge) * BLEND), 0, 1)
    return 2 * np.pi * (1 - edge) * float((t * t * (3 - 2 * t)).mean())


def room(*lamps, skip=()):
    """One meter wide; its floor is the object 4."""
    build = Build()
    gray = build.material(RHO)
    build.room((1, 1, 1), gray, gray, gray, skip)
    return build.scene(lamps)


def indirect(scene, passes=("indirect",), error=0.02, seed=0):
    """The mean over the whole surface, and the error told."""
    receivers = meshes.triangle_receivers(scene, 4)
    settings = Settings(error=error, seed=seed, threads=2, passes=passes)
    solution = solve(scene, receivers, settings)
    return solution.indirect.mean(), solution.statistics.estimated_error


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("cone", [0.05, 0.01, 0.005])
def test_a_beam_lights_the_room(cone, seed):
    found, told = indirect(room(spot(cone)), seed=seed)
    assert found == pytest.approx(flux(cone) * RHO / (6 * (1 - RHO)), rel=0.02)
    assert told <= 0.02


def test_direct_light_of_a_beam_is_not_reflected_once_more():
    """Receivers that it lights are as bright as they are; its spot lights the room, not they."""
    found, _ = indirect(room(spot(0.02)), ("direct", "indirect"))
    assert found == pytest.approx(flux(0.02) * RHO / (6 * (1 - RHO)), rel=0.02)


def test_a_spot_on_each_plane_with_all_of_the_power():
    """Where the floor meets a wall: two ellipses, whose power π · radiance · area adds up to ρ Φ. Of
    4096 particles in a Sobol set each carries the beam there: their sum is off by some 1e-3 at most."""
    context = build_context(room(spot(0.02, TO_THE_EDGE)), 0, 1, lambda *_: None)
    spots = split_beams(context).spots.sources.batches[-1]
    assert len(spots.color) == 2
    normals = sorted(np.abs(np.round(spots.normal, 6)).tolist())
    assert normals == [[0, 0, 1], [1, 0, 0]]
    power = float(spots.power[:, 0].sum()) * context.unit * context.geometry.scale**2
    assert power == pytest.approx(RHO * flux(0.02), rel=2e-3)


def test_beams_beside_other_lamps():
    """What each lamp brings adds up."""
    bulb = PointLamp("bulb", np.array([0.3, 0.6, 0.5]), np.full(3, 0.01), 0.0)
    found, _ = indirect(room(bulb, spot(0.01, intensity=400.0)))
    power = 4 * np.pi * 0.01 + 400 * flux(0.01)
    assert found == pytest.approx(power * RHO / (6 * (1 - RHO)), rel=0.02)


def beams_of(scene):
    return find_beams(build_context(scene, 0, 1, lambda *_: None))


def test_which_spots_are_beams():
    """By the area that they light: a wide one close to a wall is one, too."""
    close = replace(spot(0.5, [0, 0, 1]), position=np.array([0.5, 0.5, 0.99]))
    scene = room(spot(1.0), spot(0.01), close, spot(0.02, radius=0.3))
    assert beams_of(scene).tolist() == [1, 2]


def test_objects_that_particles_would_meet_and_light_would_not():
    scene = room(spot(0.01))
    unseen = np.ones(len(scene.objects), bool)
    unseen[4] = False
    assert len(beams_of(replace(scene, casts_shadow=unseen))) == 0
    assert len(beams_of(replace(scene, visible=unseen))) == 0


def test_beams_that_light_nothing():
    """One that leaves the room is none; the spot of one that lands on black does not shine."""
    scene = room(spot(0.01, [0.1, 0, 1.0]), skip=(5,))
    assert len(beams_of(scene)) == 0 and indirect(scene)[0] == 0
    build = Build()
    black = build.material(0.0)
    build.room((1, 1, 1), black, black, black)
    split = split_beams(build_context(build.scene([spot(0.01)]), 0, 1, lambda *_: None))
    assert split.spots is None and split.beams is not None


def test_a_beam_does_not_light_what_it_is_not_linked_to():
    scene = room(spot(0.01))
    others = np.array([0, 1, 2, 3, 5])  # all but the floor that it meets
    assert indirect(replace(scene, lamp_objects=(others,)))[0] == 0
