"""The whole solver against exact solutions: open scenes, within half a percent."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.sequence import solve
from verification import exact, meshes
from verification.error import relative_error
from verification.exact_solves import radiosity

LIGHT = Settings(error=0.003, passes=("direct", "indirect"))  # irradiance, whatever reflects it
HALF_PERCENT = 5e-3


def irradiance(scene, receivers):
    """(count,) of the first channel, from everywhere."""
    solution = solve(scene, receivers, LIGHT)
    return (solution.direct + solution.indirect)[:, 0]


def middle_of_strip(n=16):
    """n receivers across half of scene triangle 0 of a long quad, in its middle: squares from
    the strip's middle to its edge, 1e-4 of its length long. On the quad a, b, c, d
    the first triangle has p = a + u (b−a) + v (c−a), so v = ½ is the middle and u = x there."""
    u = np.arange(n) / (2 * n)
    origin = np.column_stack([u, np.full(n, 0.5)])
    corners = np.stack([origin, origin + [0.5 / n, 0], origin + [0, 1e-4]], axis=1)
    first = np.arange(n, dtype=np.int32)
    return Receivers(n, first, 0 * first, corners, np.ones(n, bool))


@pytest.mark.parametrize("rho", [0.5, 0.99])
def test_facing_strips(rho):
    nodes, weights = np.polynomial.legendre.leggauss(64)
    y, w = nodes / 2, weights / 2

    def transport(x):
        return rho * w / (2 * (1 + (np.asarray(x)[:, None] - y) ** 2) ** 1.5)

    b = np.linalg.solve(np.eye(64) - transport(y), np.ones(64))
    expected = 1 + transport((np.arange(16) + 0.5) / 32) @ b
    found = radiosity(meshes.strips_scene(rho), middle_of_strip())
    assert relative_error(found[:, None], expected[:, None]).error < HALF_PERCENT


@pytest.mark.parametrize("r1, r2, h", [(1.0, 1.0, 1.0), (0.5, 2.0, 1.0)])
def test_disks(r1, r2, h):
    """Only the second disk emits, 1, and nothing reflects: the first's mean irradiance is F12."""
    scene = meshes.disks_scene(r1, r2, h, 0.0, np.array([[0.0], [1.0]]))
    receivers = meshes.triangle_receivers(scene)
    found = irradiance(scene, receivers)[scene.object == 0]
    area = meshes.areas(scene.vertices, scene.triangles)[scene.object == 0]
    mean = found @ area / area.sum()
    assert mean == pytest.approx(exact.coaxial_disks(r1, r2, h), rel=HALF_PERCENT)


@pytest.mark.parametrize("degrees", [1.0, 30.0, 90.0, 150.0])
def test_wedge(degrees):
    """The upper strip emits 1; the mean irradiance across the lower is 1 − sin(α/2). Seen from
    receivers in the middle of the half away from the shared edge, each by Lambert's formula."""
    angle = np.radians(degrees)
    scene = meshes.wedge_scene(angle, 200.0, 0.0, np.array([[0.0], [1.0]]))
    found = irradiance(scene, middle_of_strip())
    x = 0.5 + (np.arange(16)[:, None] + (np.arange(64) + 0.5) / 64) / 32
    far = np.array([np.cos(angle), np.sin(angle)])
    reach = far[0] - x
    expected = (0.5 * (reach / np.hypot(reach, far[1]) + 1)).mean(axis=1)
    assert relative_error(found[:, None], expected[:, None]).error < HALF_PERCENT
