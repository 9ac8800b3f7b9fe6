"""Surfaces whose two sides differ: each point sees the side that faces it."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.scene import Material, Scene, SunLamp
from radiosity_addon.solver.sequence import solve
from verification import meshes

GAP = 1e-3
SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
SUN = SunLamp("Sun", np.array([0.0, 0.0, -1.0]), np.ones(3))


def gray(value):
    return Constant(np.full(3, value))


def floor_and_pane(floor: Material, pane: Material) -> Scene:
    """A unit square under another, GAP apart, both facing up into the sun."""
    vertices = np.concatenate([np.column_stack([SQUARE, np.full(4, z)]) for z in (0.0, GAP)])
    quad = np.array([(0, 1, 2), (0, 2, 3)])
    of = np.repeat(np.arange(2, dtype=np.int32), 2)
    triangles = np.concatenate([quad, quad + 4]).astype(np.int32)
    return Scene(vertices, triangles, of, of, (floor, pane), ("Floor", "Pane"), lamps=(SUN,))


def irradiance(scene):
    """Of the floor and of the pane's front, means of the first channel."""
    settings = Settings(error=0.003, passes=("direct", "indirect"))
    solution = solve(scene, meshes.triangle_receivers(scene), settings)
    light = (solution.direct + solution.indirect)[:, 0]
    return light[:2].mean(), light[2:].mean()


@pytest.mark.parametrize("clear_from_below, expected", [(True, 1.0), (False, 0.0)])
def test_light_passes_to_the_side_that_sees_a_clear_one(clear_from_below, expected):
    """What is black from one side and clear from the other lets the sun reach the floor, or not;
    its front has the sun in either case."""
    black, clear = (Material("", gray(0), transmittance=gray(share)) for share in (0, 1))
    front, back = (black, clear) if clear_from_below else (clear, black)
    pane = Material("Pane", front.reflectance, transmittance=front.transmittance, back=back)
    below, above = irradiance(floor_and_pane(Material("Floor", gray(0)), pane))
    assert below == pytest.approx(expected, abs=0.005) and above == pytest.approx(1, rel=0.005)


def test_each_side_reflects_for_itself():
    """From below the pane lets half through and reflects 0.4; the floor reflects 0.5. Between
    parallel plates H = 0.5 + 0.5·0.4·H, so H = 0.625; the gap's open edges are 1e-3 of it. The
    front is opaque: it has the sun alone, although it would reflect 0.9."""
    back = Material("", gray(0.4), transmittance=gray(0.5))
    pane = Material("Pane", gray(0.9), back=back)
    below, above = irradiance(floor_and_pane(Material("Floor", gray(0.5)), pane))
    assert below == pytest.approx(0.625, rel=0.01) and above == pytest.approx(1, rel=0.005)


def test_a_back_that_is_not_finite_is_named():
    pane = Material("Pane", gray(0.9), back=Material("Pane (back)", gray(np.nan)))
    with pytest.raises(ValueError, match=r"reflectance of material 'Pane \(back\)' is not finite"):
        irradiance(floor_and_pane(Material("Floor", gray(0.5)), pane))
