"""Receivers that are dark share no light of those behind a wall."""

import numpy as np
import pytest

from radiosity_addon.solver.direct.line_of_sight import LineOfSight
from radiosity_addon.solver.filtering.graph import build_graph
from radiosity_addon.solver.filtering.lattice_weights import build_lattices
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from verification import meshes
from verification.stability_scenes import plane

SIZE = 48  # texels along an edge of a square, the plane x < 0.4 of which is dark
GRID = np.stack([np.zeros(SIZE**2), *np.divmod(np.arange(SIZE**2), SIZE)], 1).astype(np.int32)
PLACE = np.stack([GRID[:, 2], GRID[:, 1], GRID[:, 0]], 1) / SIZE
UP = np.tile([0.0, 0, 1], (SIZE**2, 1))
DARK = PLACE[:, 0] < 0.4


@pytest.mark.parametrize(
    "neighbors",
    [build_lattices(GRID, PLACE, UP)[0], build_graph(PLACE, UP, np.ones(SIZE**2), 1)[0]],
    ids=["texels", "faces"],
)
@pytest.mark.parametrize("wall", [True, False])
def test_light_is_shared_with_what_sees_it(neighbors, wall):
    def sees(one, other):
        assert DARK[one].all() and not DARK[other].any()
        return np.full(len(one), not wall)

    parted = neighbors.separated(DARK, sees)
    pictures = parted.as_pictures(np.stack([np.where(DARK, 0.0, 1.0), np.ones(SIZE**2)], 1))
    for level in range(parted.levels):
        pictures = parted.step(*pictures, level=level)
    light, even = (parted.read(picture) for picture in pictures)
    assert (light[DARK].max() == 0) == wall
    assert even == pytest.approx(1, rel=1e-6)


def test_what_a_receiver_sees():
    """A ground of squares under a wall; a ball, whose faces see each other over its curve."""
    ground = plane((0, 0, 0), (3, 0, 0), (0, 3, 0), 3)  # squares 2 wide, of two triangles
    wall = plane((0.5, 0, 4), (0, 4, 0), (0, 0, 4))
    ball, small = meshes.icosphere(3)
    scene = meshes.scene([ground, wall, (ball + [0, 0, 20], small)], 0.5)
    context = build_context(scene, 0, 1, silent)
    receivers = meshes.triangle_receivers(scene)
    footprints = build_footprints(context.geometry, receivers)
    sight = LineOfSight(context, footprints, *footprints.middle())
    column = np.repeat(np.tile([-2, 0, 2], 3), 2)  # the squares' middles, along x
    one, other = np.stack(np.meshgrid(np.arange(18), np.arange(18))).reshape(2, -1)
    sees = sight.sees_all_of(one, other)
    left = column[one] == -2
    assert (sees[left] == (column[other[left]] == -2)).all()
    edges = np.sort(np.concatenate([small[:, [0, 1]], small[:, [1, 2]], small[:, [2, 0]]]), axis=1)
    face = np.tile(np.arange(len(small)), 3)[np.lexsort(edges.T)].reshape(-1, 2)
    face = face + len(scene.triangles) - len(small)
    assert sight.sees_all_of(face[:, 0], face[:, 1]).all()
