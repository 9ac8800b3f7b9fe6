"""Surfaces whose sides emit differently: each side's light goes where that side faces."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.energy import energy_balance
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import Material, Scene
from tests.solver.test_emission import (
    HALF,
    PANEL,
    floor_light,
    means_of_lambert,
    panel_over_floor,
    relative,
    textured,
)  # fmt: skip

LARGE = PANEL * [4, 4, 1]  # half of the scene's area: left to rays


def gray(value: float) -> Constant:
    return Constant(np.full(3, value))


def sided(front, back, panel=PANEL) -> Scene:
    """A floor under a panel whose front, which looks down at it, and back emit these."""
    scene = panel_over_floor(front, panel)
    floor, lamp = scene.materials
    return replace(scene, materials=(floor, replace(lamp, back=Material("", gray(0), back))))


@pytest.mark.parametrize("panel, explicit", [(PANEL, True), (LARGE, False)])
@pytest.mark.parametrize("front, back", [(3.0, 0.0), (0.0, 3.0), (3.0, 1.0)])
def test_each_side_lights_what_it_faces(panel, explicit, front, back):
    """By Lambert's formula, from below the front and, with the panel turned over, the back."""
    for corners, radiance in ((panel, front), (panel[::-1], back)):
        scene = sided(gray(front), gray(back), corners)
        found, _ = floor_light(scene, 0.005)  # of a mean that the panel's own light raises
        assert build_context(scene, 0, 1, silent).explicit[-1] == explicit
        if radiance == 0:
            assert not found.any()
        else:
            assert relative(found[:, 0], means_of_lambert(scene, panel, radiance)) < 0.01


def test_a_picture_on_the_back_lies_where_it_is():
    """Half of a back shines, the front is dark; turned over, corners run backward: the bright
    half lies from the middle of the edge 3-2 on, whose corners u runs along now."""
    turned = PANEL[::-1]
    found, _ = floor_light(sided(gray(0), textured(HALF), turned), 0.005)
    middle = (turned[0] + turned[1]) / 2, (turned[3] + turned[2]) / 2
    half = np.array([middle[0], turned[1], turned[2], middle[1]])
    truth = means_of_lambert(sided(gray(0), gray(0)), half, 3.0)
    assert relative(found[:, 0], truth) < 0.01


@pytest.mark.parametrize("panel", [PANEL, LARGE])
def test_power_is_that_of_both_sides(panel):
    """π·A·(L_front + L_back)."""
    area = np.ptp(panel[:, 0]) * np.ptp(panel[:, 1])
    for front, back in ((3.0, 0.0), (0.0, 3.0), (3.0, 1.0), (2.0, 2.0)):
        context = build_context(sided(gray(front), gray(back), panel), 0, 1, silent)
        expected = np.pi * area * (front + back)
        assert energy_balance(context)["emitted"] == pytest.approx(expected, rel=1e-6)


def test_sides_that_emit_alike_are_one_light():
    """A back that only reflects otherwise leaves the light two-sided, in one rectangle."""
    for back, count in ((3.0, 1), (2.0, 2)):
        sources = build_context(sided(gray(3.0), gray(back)), 0, 1, silent).sources
        assert sources.count == count and sources.batches[0].two_sided.all() == (count == 1)
