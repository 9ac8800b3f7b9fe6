"""What rays meet, looked up where they are shot: places on a cut of an element lie on neither side of it."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.elements.elements import build_elements, cut_cells
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.sampling.points import Points
from radiosity_addon.solver.transport.onward import ends_of
from radiosity_addon.solver.transport.patches import Patches
from radiosity_addon.solver.transport.rays import shoot
from verification import meshes

FLOOR = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
CUT, LEFT, RIGHT, BESIDE = 0.5, 0.25, 0.75, 2.0  # x of where rays end: on the cut u = ½, beside it, past the floor


def shot_at(x, transmittance=0.0):
    """The shot, and its scene and patches, of rays from a height of 0.3 at y = 0.1, down to ``x`` (rays, R):
    a floor of one triangle that is cut along u = ½, above another that lets nothing through."""
    scene = meshes.scene([FLOOR, (FLOOR[0] - [0, 0, 0.2], FLOOR[1])], reflectance=0.5)
    floor = replace(scene.materials[0], transmittance=Constant(np.full(3, transmittance)))
    context = build_context(replace(scene, materials=(floor, *scene.materials[1:])), 0, 1, silent)
    geometry = context.geometry
    elements = build_elements(geometry, np.arange(2), 1)
    patches = Patches(cut_cells(elements, elements.base[:1], np.array([[-0.5, 0.5, -0.5]])))
    rays, count = np.shape(x)
    origin = geometry.normalized(np.tile([0.4, 0.1, 0.3], (count, 1)))
    target = geometry.normalized(np.stack([x, np.full_like(x, 0.1), np.zeros_like(x)], -1).reshape(-1, 3))
    way = target.reshape(rays, count, 3) - origin
    way = (way / np.linalg.norm(way, axis=2, keepdims=True)).astype(np.float32)
    down = np.tile(np.array([0, 0, -1], np.float32), (1, count, 1))
    points = Points(origin[None].astype(np.float32), down, np.zeros((1, count), np.int32),
                    np.zeros((1, count, 2), np.float32), np.zeros((count, 3), np.float32))  # fmt: skip
    return shoot(context, patches, points, way[None]), patches, context, origin


def test_a_ray_to_a_cut_is_the_owners_next_one():
    """Three rays of two owners. The first owner's second and third end on the cut: both are its first. The
    other's first is its second, which leaves past the floor: nothing is met."""
    shot, patches, _, _ = shot_at(np.array([[LEFT, CUT], [CUT, BESIDE], [CUT, RIGHT]]))
    (met,) = shot.met
    assert shot.lost.tolist() == [1, 2, 4] and shot.by.tolist() == [3, 0, 0]
    entry = met.entry.reshape(3, 2)
    assert entry[0, 0] == entry[1, 0] == entry[2, 0]
    assert entry[0, 1] == entry[1, 1] == patches.miss
    assert entry[2, 1] not in (entry[0, 0], patches.miss, patches.nowhere)
    numbers = np.arange(6).reshape(3, 2)
    assert shot.replaced(numbers).tolist() == [[0, 3], [0, 3], [0, 5]]
    assert np.array_equal(shot.directions.reshape(6, 3), shot.directions.reshape(6, 3)[shot.replaced(numbers).ravel()])


def test_rays_go_on_from_where_their_entries_are():
    """Of all rays the entry is that of the place where the ray ends, and the ray leads there."""
    x = np.random.default_rng(0).choice([LEFT, CUT, RIGHT], (8, 50))
    shot, patches, context, origin = shot_at(x)
    (met,) = shot.met
    some = np.arange(len(met.entry))
    owner = some % 50
    ends = ends_of(met, shot.directions, some, owner, np.ones((len(some), 1)))
    kept = patches.somewhere(ends.places.entry)
    assert len(shot.lost) > 100 and kept.mean() > 0.99
    assert np.array_equal(ends.places.on(patches).entry, ends.places.entry)
    position = context.geometry.at(ends.places.triangle, ends.places.uv)
    expected = origin[owner] + met.hits.distance[:, None] * shot.directions.reshape(-1, 3)
    np.testing.assert_allclose(position, expected, atol=1e-6)


def test_where_all_rays_of_an_owner_end_on_a_cut_nothing_is_known():
    shot, patches, _, _ = shot_at(np.array([[CUT, LEFT], [CUT, CUT]]))
    assert (shot.met[0].entry.reshape(2, 2)[:, 0] == patches.nowhere).all()
    assert patches.somewhere(shot.met[0].entry.reshape(2, 2)[:, 1]).all()


def test_what_goes_through_goes_on_from_the_ray_that_counts():
    """The floor lets half through: behind it one ray meets the lower one, and the other passes it by."""
    shot, patches, context, _ = shot_at(np.array([[LEFT, RIGHT], [CUT, CUT]]), transmittance=0.5)
    first, later = shot.met
    assert later.rays.tolist() == [0, 1, 2, 3] and later.weight == pytest.approx(0.5)
    assert later.hits.triangle.tolist() == [1, -1, 1, -1] and later.hits.u[0] == later.hits.u[2] > 0
