"""Random scenes: few here, 2,000 in ``python -m benchmarks.stability``."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.sequence import solve
from verification import meshes
from verification.stability_random import Random, check, run

BOX = meshes.box_scene(exitance=1.0)


def test_random_scenes():
    run(15)


def test_a_scene_that_should_be_refused_and_is_not_is_found():
    with pytest.raises(AssertionError, match="not refused: no such thing"):
        check(Random(BOX, meshes.triangle_receivers(BOX), "no such thing", 0))


def test_a_wrong_refusal_is_found():
    scene = meshes.box_scene(reflectance=1.0, exitance=1.0)
    with pytest.raises(AssertionError, match="every surface of this closed scene"):
        check(Random(scene, meshes.triangle_receivers(scene), "something else", 0))


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_light_that_is_none_is_found(value):
    solution = solve(BOX, meshes.triangle_receivers(BOX), Settings(error=0.5))
    solution.direct[3, 1] = value
    with pytest.raises(AssertionError, match="direct"):
        check(Random(BOX, meshes.triangle_receivers(BOX), None, 0), lambda *_: solution)
