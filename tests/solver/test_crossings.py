"""Triangles that cut or touch each other, and what becomes of the cells there."""

import numpy as np
import pytest

from radiosity_addon.solver.elements.discontinuities import split_at_discontinuities
from radiosity_addon.solver.elements.elements import build_elements
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.tracing.coincident import COPIES, copied_often
from radiosity_addon.solver.tracing.crossings import TOUCHING, find_crossings
from radiosity_addon.solver.tracing.embree import Tracer
from verification import meshes

FLOOR = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def crossings(other: np.ndarray):
    """Of the floor and one more triangle; lengths stay, as both fit the unit box."""
    geometry = build_geometry(np.concatenate([FLOOR, other]), np.arange(6).reshape(2, 3))
    tracer = Tracer(geometry.vertices, geometry.triangles)
    return find_crossings(geometry, tracer, 1, silent_tick)


def silent_tick(fraction):
    pass


def upright(low: float, high: float) -> np.ndarray:
    """At x = ¼, from (y = −½, z = low) to (y = ½, z = low) to z = high."""
    return np.array([[0.25, -0.5, low], [0.25, 0.5, low], [0.25, 0.0, high]])


def test_triangles_through_each_other_are_both_cut():
    found = crossings(upright(-0.5, 0.5))
    assert sorted(found.triangle) == [0, 1]
    floor = found.ends[list(found.triangle).index(0)]
    # At z = 0, half way up, the other one is half as wide: y from −¼ to ¼, the floor's from 0.
    np.testing.assert_allclose(sorted(floor.tolist()), [[0.25, 0], [0.25, 0.25]], atol=8 * TOUCHING)


def test_what_stands_on_a_triangle_cuts_it_alone():
    found = crossings(upright(0.0, 0.5))
    assert found.triangle[found.across].tolist() == [0]
    np.testing.assert_allclose(found.height[0] * np.sign(found.height[0, 1]), [-0.25, 0.75, -0.25],
                               rtol=0.4)  # fmt: skip


@pytest.mark.parametrize(
    "other",
    [upright(1e-3, 0.5), FLOOR + [0, 0, 0.1], FLOOR[::-1], FLOOR + [1, 0, 0],
     FLOOR @ np.diag([1, 0, 1])],
    ids=["above", "parallel", "the same, reversed", "beside", "degenerate"],
)  # fmt: skip
def test_what_does_not_touch_or_lies_in_one_plane_cuts_nothing(other):
    assert len(crossings(other).triangle) == 0


def test_neighbors_of_a_mesh_do_not_cut_each_other():
    vertices, triangles = meshes.blob(3)
    geometry = build_geometry(vertices, triangles)
    tracer = Tracer(geometry.vertices, geometry.triangles)
    assert len(find_crossings(geometry, tracer, 1, silent_tick).triangle) == 0


def test_no_element_lies_on_both_sides_of_what_cuts_it():
    """A floor of two triangles, a wall across it at x = 0.3: random places on the floor, by the
    side they lie on. Next to the wall, within the band, they lie nowhere."""
    floor = meshes.grid(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float), 1)
    wall = meshes.grid(np.array([[0.3, -1, -1], [0.3, 2, -1], [0.3, 2, 1], [0.3, -1, 1]], float), 1)
    context = build_context(meshes.scene([floor, wall]), 0, 1, silent)
    geometry = context.geometry
    elements = build_elements(geometry, np.zeros(4, int), 50)
    elements = split_at_discontinuities(context, elements, 50, 0.1)
    random = np.random.default_rng(0)
    uv = random.random((20_000, 2))
    uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv).astype(np.float32)
    triangle = random.integers(0, 2, len(uv))
    x = geometry.at(triangle, uv.astype(float))[:, 0] * geometry.scale + geometry.center[0] - 0.3
    cell = elements.cells_at(triangle, uv[:, 0], uv[:, 1])
    somewhere = cell < len(elements.element)
    assert (np.abs(x[~somewhere]) < 1e-4).all() and somewhere.mean() > 0.999
    owner = elements.element[cell[somewhere]]
    left, right = (np.unique(owner[side]) for side in (x[somewhere] < 0, x[somewhere] > 0))
    assert len(left) and len(right) and not np.isin(left, right).any()


def test_all_but_the_first_of_many_copies_are_named():
    count = COPIES + 1
    vertices = np.concatenate([np.tile(FLOOR, (count, 1)), np.tile(FLOOR + 1, (COPIES, 1))])
    geometry = build_geometry(vertices, np.arange(len(vertices)).reshape(-1, 3))
    found = copied_often(geometry, np.ones(count + COPIES, bool))
    assert found.tolist() == [False] + [True] * (count - 1) + [False] * COPIES
