"""Lamps that only some objects shade: each blocks the light of those that it is linked to."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.light_sampler import FEW
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import Material, Scene, SunLamp
from radiosity_addon.solver.sequence import solve
from verification import meshes

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
SUN = SunLamp("Sun", np.array([0.0, 0.0, -1.0]), np.ones(3))
FLOOR, LOW, HIGH = (np.array([i]) for i in range(3))
NONE = np.zeros(0, int)


def stack(*blockers, clear=0.0) -> Scene:
    """A black unit floor facing up, under two panes, black but for the share ``clear`` that the
    upper one lets through; and a sun from above for each of ``blockers``."""
    vertices = np.concatenate([np.column_stack([SQUARE, np.full(4, z)]) for z in (0, 1e-3, 2e-3)])
    quad = np.array([(0, 1, 2), (0, 2, 3)])
    triangles = np.concatenate([quad, quad + 4, quad + 8]).astype(np.int32)
    of = np.repeat(np.arange(3, dtype=np.int32), 2)
    black = Constant(np.zeros(3))
    materials = [Material(name, black) for name in ("Floor", "Low", "High")]
    materials[2] = Material("High", black, transmittance=Constant(np.full(3, clear)))
    return Scene(vertices, triangles, of, of, tuple(materials), ("Floor", "Low", "High"),
                 lamps=(SUN,) * len(blockers), lamp_blockers=blockers)  # fmt: skip


def floor_light(scene: Scene) -> float:
    """Mean irradiance of the floor [W/m²]."""
    solution = solve(scene, meshes.triangle_receivers(scene), Settings(error=0.01))
    return float(solution.direct[:2].mean())


@pytest.mark.parametrize("blockers, expected", [
    ((None,), 0), ((NONE,), 1), ((FLOOR,), 1), ((LOW,), 0), ((HIGH,), 0),
    ((None, NONE), 1), ((NONE, None, FLOOR), 2),
])  # fmt: skip
def test_only_linked_objects_shade(blockers, expected):
    """Every sun that nothing shades brings 1 W/m² to the floor; a floor does not shade itself."""
    assert floor_light(stack(*blockers)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("blockers, expected", [
    ((None,), 0), ((HIGH,), 0.25), ((HIGH, FLOOR), 1.25), ((HIGH, LOW, NONE), 1.25),
])  # fmt: skip
def test_a_linked_pane_lets_its_share_through(blockers, expected):
    assert floor_light(stack(*blockers, clear=0.25)) == pytest.approx(expected, abs=1e-6)


def test_a_linked_lamp_is_never_chosen_among_many():
    """Of nine suns one is not shaded: sampled everywhere, it brings its 1 W/m² without noise; the
    others are a pool to choose from."""
    scene = stack(*(None,) * (FEW + 2), NONE)
    sources = build_context(scene, 0, 1, silent).sources
    assert sources.always == (FEW + 2,) and len(sources.samplers) == 1
    assert FEW + 2 not in sources.samplers[0].blocks
    assert floor_light(scene) == pytest.approx(1, abs=1e-6)
