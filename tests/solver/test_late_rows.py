"""What the system did not know of when it was solved: pockets, and places without a patch."""

from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.solver.gather.lighting import MOST_RAYS, batches_of
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.transport.onward import Ends, _resampled, ends_of, go_on, thinned
from radiosity_addon.solver.transport.places import Places
from radiosity_addon.solver.transport.rays import Met, sums_of
from verification import meshes
from verification.stability_scenes import radiosity, worst

REFLECTANCE = 0.99
SIMPLEX = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
INWARDS = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def test_pockets_that_few_rays_find_keep_their_light():
    """Sixteen sealed tetrahedra in a furnace of 19,200 receivers: B = 1 inside them, too."""
    corners, _ = meshes.box_polygons()
    walls = [meshes.grid(face, 40) for face in corners]
    pockets = [
        (0.05 * SIMPLEX + [0.2 * x + 0.1, 0.2 * y + 0.1, 0.5], INWARDS)
        for x, y in np.ndindex(4, 4)
    ]
    scene = meshes.scene([*walls, *pockets], REFLECTANCE, 1 - REFLECTANCE)
    found, receivers, _ = radiosity(scene, 0.03, 1)
    assert receivers.count == 19_264
    assert worst(found, 1.0) < 1e-4


def test_rays_go_on_from_where_nothing_stands():
    """Rays to within 1e-7 of a wall that stands on the floor, from all directions on its one side: they go
    on from that side. Points drawn in from the edges of the floor's triangles are on the other, too."""
    wall = np.array([[0.3, 0, -1], [0.3, 1, -1], [0.3, 1, 1], [0.3, 0, 1]], float)
    floor = np.array([[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]], float)
    scene = meshes.scene([meshes.grid(floor, 1), meshes.grid(wall, 1)], 0.5)
    context = build_context(scene, 0, 1, silent)
    count = 4000
    random = np.random.default_rng(1)
    edge = context.geometry.normalized(wall[0])[0]
    target = context.geometry.normalized(np.column_stack(
        [np.full(count, 0.3), random.uniform(0.1, 0.9, count), np.zeros(count)]))  # fmt: skip
    target[:, 0] -= random.uniform(0, 1e-7, count)
    way = np.column_stack([random.uniform(0.2, 1, count), random.uniform(-1, 1, count),
                           random.uniform(-1, -0.05, count)])  # fmt: skip
    way = (way / np.linalg.norm(way, axis=1)[:, None]).astype(np.float32)
    hits = context.tracer.intersect((target - 0.2 * way).astype(np.float32), way)
    some = np.flatnonzero(np.isin(hits.triangle, (0, 1)))
    assert len(some) > count / 3
    met, nobody = Met(hits, np.zeros(count, np.int32)), np.zeros(len(some), np.int64)
    ends = ends_of(met, way[None], some, nobody, np.ones((len(some), 1)))
    points = ends.points(context, np.zeros((len(some), 3), np.float32))
    drawn_in = ends.places.points(context.geometry, np.zeros((len(some), 3), np.float32))
    assert (points.position[0, :, 0] < edge).all()
    assert (points.position[0, :, 2] > context.geometry.normalized(floor[0])[2]).all()
    assert (drawn_in.position[0, :, 0] >= edge).any()


class NoPatches:
    """As ``Patches``, of a surface without any."""

    miss, onward, elements = 0, 1, SimpleNamespace(has_cuts=False)

    def hit(self, hits, near_goes_onward):
        return np.where(hits.triangle < 0, self.miss, self.onward)

    def somewhere(self, entry):
        return np.zeros(len(entry), bool)


def test_rays_that_end_on_no_patch_find_their_light_themselves():
    """A furnace of reflectance 0.5 whose radiosity is 1, without patches: each ray goes on from the
    middle of a face that it met first. Six reflections make 1 − 2⁻⁷ of its light, the same for each;
    chance ends rays in the rest, with a deviation of about 2⁻⁷: their mean's is 1e-4 for 6,000 rays."""
    corners, _ = meshes.box_polygons()
    scene = meshes.scene([meshes.grid(face, 4) for face in corners], 0.5, 0.5)
    context, count = build_context(scene, 0, 1, silent), 6000
    triangle = np.arange(count) % len(scene.triangles)
    third, front = np.full(count, 1 / 3, np.float32), np.ones(count, bool)
    places = Places(np.full(count, NoPatches.onward), triangle, third, third, front)
    rays = Ends(np.zeros(count, int), places, np.ones((count, 1)), np.zeros((count, 3), np.float32))
    found = go_on(context, NoPatches(), rays, 1, (0,))
    assert len(found.ends.owner) == 0
    assert sum(found.light(context, (1,)))[0] / count * context.unit == pytest.approx(1.0, abs=5e-4)


class OnePatch(NoPatches):
    """As ``Patches`` of a surface that is one patch, which rays shorter than 0.1 find near."""

    patch = 2

    def hit(self, hits, near_goes_onward):
        near = near_goes_onward & (hits.distance < 0.1)
        return np.where(hits.triangle < 0, self.miss, np.where(near, self.onward, self.patch))

    def somewhere(self, entry):
        return entry == self.patch


@pytest.mark.parametrize("near, most", [(False, 1.0), (True, 0.15)])
def test_rays_in_a_thin_gap_go_on_from_near_patches_at_each_reflection(near, most):
    """A furnace of 1 × 1 × 0.005, of reflectance 0.9, whose radiosity is 1. A ray brings all of that, whenever it reads
    the patch (``OnePatch``) in the end: no noise. Where it reads it from the second reflection on, 0.9 of its light is the
    patch's mean; else 0.9²⁴ = 0.08, and what the few rays bring that are longer than 0.1."""
    corners, _ = meshes.box_polygons((1, 1, 0.005))
    scene = meshes.scene([meshes.grid(face, 1) for face in corners], 0.9, 0.1)
    context, count = build_context(scene, 0, 1, silent), 2000
    floor = np.flatnonzero(np.ptp(scene.vertices[scene.triangles][:, :, 2], axis=1) == 0)
    triangle, front = floor[np.arange(count) % len(floor)], np.ones(count, bool)
    third = np.full(count, 1 / 3, np.float32)
    places = Places(np.full(count, OnePatch.onward), triangle, third, third, front)
    rays = Ends(np.arange(count), places, np.ones((count, 1)), np.zeros((count, 3), np.float32))
    found = go_on(context, OnePatch(), rays, count, (0,), near)
    read = sums_of(found.ends.owner, found.ends.weight, count)
    light = sum(found.light(context, (1,))) * context.unit + read
    assert light == pytest.approx(np.ones((count, 1)), abs=1e-5)
    assert most - 0.1 - 1e-6 <= read.mean() <= most


def test_rays_are_gathered_in_batches_of_bounded_size():
    """Each owner of each part once, none with another's random numbers; one part that is small stays
    as it is."""
    parts = [(np.arange(5), 4), (np.arange(7, 1_000_007), 64), (np.arange(3), MOST_RAYS * 2)]
    batches = batches_of(parts)
    for owners, rays in parts:
        pieces = [piece for batch in batches for piece in batch if piece[1] == rays]
        assert np.array_equal(np.concatenate([piece[0] for piece in pieces]), owners)
        assert len({piece[2:] for piece in pieces}) == len(pieces)
    for batch in batches:
        assert sum(len(owners) * rays for owners, rays, *_ in batch) <= MOST_RAYS or len(batch) == 1
    assert [len(batches_of(parts[:1])), len(batches_of(parts[:1])[0][0])] == [1, 2]
    assert batches_of([]) == []


@pytest.mark.parametrize("by_chance", [False, True])
def test_fewer_rays_stand_for_all_of_an_owner(by_chance):
    """Rays of three owners, one of which has a single ray, reflected by 0.1 to 0.9: each keeps its sum of weights, with as
    many rays as make them about as large as before, and each ray's weight is right in the mean. By chance the
    sums are right in the mean only."""
    random = np.random.default_rng(3)
    owner = np.array([4] * 40 + [1] * 25 + [7])[random.permutation(66)]
    before = random.uniform(0.5, 1, (66, 1))
    weight = before * random.uniform(0.1, 0.9, (66, 1)) * [1, 0.5, 0.25]
    places = Places(np.zeros(66, int), np.arange(66), *np.zeros((2, 66)), np.ones(66, bool))
    rays, came = (Ends(owner, places, each, np.zeros((66, 3))) for each in (weight, before))
    expected, trials = sums_of(owner, weight, 8), 2000
    means = np.zeros_like(weight)
    for trial in range(trials):
        found = _resampled(rays, came, by_chance, (trial,))
        means += sums_of(found.places.triangle, found.weight, 66) / trials
        sums = sums_of(found.owner, found.weight, 8)
        assert by_chance or sums == pytest.approx(expected)
        for each in (1, 4, 7):
            fewer = expected[each, 0] / before[owner == each].mean()
            assert (found.owner == each).sum() < fewer + 1
    assert (np.abs(means - weight) <= 5 * np.sqrt(weight / trials)).all()


def test_thinned_rays_stand_for_all():
    """A third of each owner's rays, rounded up, with the sum of all weights; and each ray as often as its weight asks for.
    Those that bring nothing are left out."""
    random = np.random.default_rng(3)
    owner = random.permutation(np.repeat(np.arange(6), [1, 2, 3, 4, 9, 30]))
    weight = random.uniform(0.2, 1, (len(owner), 1))
    weight[owner == 0] = 0
    number = np.arange(len(owner), dtype=np.int32)
    places = Places(number, number, *np.zeros((2, len(owner))), np.ones(len(owner), bool))
    ends = Ends(owner, places, weight, np.zeros((len(owner), 3), np.float32))
    mean, seeds = np.zeros(len(owner)), 2000
    for seed in range(seeds):
        few = thinned(ends, 1 / 3, (seed,))
        assert (np.bincount(few.owner) <= [0, 1, 1, 2, 3, 10]).all()
        assert np.allclose(sums_of(few.owner, few.weight, 6), sums_of(owner, weight, 6))
        mean += np.bincount(few.places.entry, few.weight[:, 0], len(owner)) / seeds
    lit = owner > 0
    assert np.abs(mean[lit] / weight[lit, 0] - 1).max() < 5 * np.sqrt(3 / seeds / 0.2)
