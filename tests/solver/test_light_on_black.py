"""Light that arrives where nothing is reflected: it is as real as elsewhere."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.sequence import solve
from verification import meshes


def test_indirect_light_on_black_octants():
    """In a sphere every point sees each patch alike: irradiance φ = q̄ / (1 − mean ρ) on black
    octants too (mean over the area), of which q̄ comes straight and φ − q̄ indirectly. With
    q = 1 on one octant of eight and ρ = 0.8 on every other: φ = (1/8) / (1 − 0.4)."""
    q, rho = np.zeros(8), np.tile([0.0, 0.8], 4)
    q[1] = 1.0
    scene = meshes.sphere_scene(2, rho[:, None], q[:, None])
    settings = Settings(error=0.01, passes=("direct", "indirect"))
    solution = solve(scene, meshes.triangle_receivers(scene), settings)
    area = meshes.areas(scene.vertices, scene.triangles)
    emitting = area[scene.object == 1].sum() / area.sum()
    reflecting = 0.8 * area[np.isin(scene.object, (1, 3, 5, 7))].sum() / area.sum()
    for octant in (0, 2, 4, 6):
        mine = scene.object == octant
        direct, indirect = (
            np.average(light[mine, 0], weights=area[mine])
            for light in (solution.direct, solution.indirect)
        )
        assert direct == pytest.approx(emitting, rel=0.01)
        assert indirect == pytest.approx(emitting / (1 - reflecting) - emitting, rel=0.01)
