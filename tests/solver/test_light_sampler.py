"""The choice among many lights: whatever its guesses, what is expected of it is the sum."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.light_sampler import (
    BLOCK,
    TOP,
    make_light_sampler,
    sample_lights,
)
from radiosity_addon.solver.lights.light_tree import Emitters, build_tree, sample_discrete
from radiosity_addon.solver.lights.polygons import Polygons
from radiosity_addon.solver.materials.emissive_parts import undivided
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import AreaLamp, PointLamp
from radiosity_addon.solver.tracing.coincident import uncovered
from verification import meshes
from verification import stability_scenes as scenes


def hall(count: int, seed: int = 0, uneven: bool = False):
    """Point lamps, spots and area lamps in the unit room, of powers over two decades; ``uneven``
    ones shine into a fifth of all directions, and not at all into the others."""
    random = np.random.default_rng(seed)
    lamps = []
    for i, place in enumerate(random.uniform(0.05, 0.95, (count, 3))):
        power = 10 ** random.uniform(-1, 1) * np.ones(3)
        axis = random.normal(size=3)
        axis /= np.linalg.norm(axis)
        across = np.linalg.svd(axis[None])[2][1:] * random.uniform(0.01, 0.1)
        spots = np.where(random.random((6, 12)) < 0.2, 1, 0).astype(np.float32) if uneven else None
        lamps.append((
            PointLamp("", place, power, 0.02, distribution=spots),
            PointLamp("", place, power, 0.01, axis=axis, cone=1.5, blend=0.3),
            AreaLamp("", place, *across, axis, 30 * power),
        )[i % 3])  # fmt: skip
    return build_context(replace(scenes.lamp_room(), lamps=tuple(lamps)), 0, 1, silent).sources


def all_together(sources, position, normal) -> np.ndarray:
    """(n,) unoccluded irradiance of all lights, mean of channels, by 128 samples of each."""
    n = len(position)
    xi = np.tile(np.random.default_rng(1).random((128, 2)), (n, 1))
    many = np.repeat(position, 128, axis=0), np.repeat(normal, 128, axis=0)
    total = np.zeros(n)
    for light in range(sources.count):
        kind, place = sources.batches[sources.batch[light]], sources.index[light]
        sample = kind.sample(np.full(128 * n, place), *many, xi)
        total += sample.irradiance.reshape(n, 128).mean(axis=1) * kind.color[place].mean()
    return total


@pytest.mark.parametrize("count, reach, uneven", [
    *((count, reach, False) for count in (10, 150, 600) for reach in (0.0, 0.05)),
    (10, 0.05, True), (150, 0.05, True),
])  # fmt: skip
def test_choices_bring_the_sum(count, reach, uneven):
    """With 2^14 numbers, evenly spread, a point's choices divided by their probability average to
    the sum over all lights, within four standard errors of the mean (as if they were independent,
    which is more), whether they are made for the point or for all within ``reach`` of it."""
    sources = hall(count, uneven=uneven)
    (sampler,) = sources.samplers
    random = np.random.default_rng(3)
    position = random.uniform(-0.45, 0.45, (3, 3))
    normal = random.normal(size=(3, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    truth = all_together(sources, position, normal)
    n = 1 << 14
    for x, direction, expected in zip(position, normal, truth):
        many = np.tile(x, (n, 1)), np.tile(direction, (n, 1))
        level = ((np.arange(n) + 0.5) / n)[None]
        (light,), (factor,) = sample_lights(sources.importance, sampler, *many, np.full(n, reach), level)
        values = np.zeros(n)
        for number, kind in enumerate(sources.batches):
            rows = np.flatnonzero((sources.batch[light] == number) & (factor > 0))
            place = sources.index[light[rows]]
            sample = kind.sample(place, many[0][rows], many[1][rows], random.random((len(rows), 2)))
            values[rows] = sample.irradiance * kind.color[place].mean(axis=1) * factor[rows]
        assert values.mean() == pytest.approx(expected, abs=4 * values.std() / np.sqrt(n))
        # Choosing by what they would bring leaves little to chance: even choice of one among
        # ``count`` lights of such powers scatters by √count and more. What uneven lamps near a
        # dark place waste, the tree does not know.
        assert uneven or values.std() < 3 * values.mean()


def test_blocks_are_filled_up_where_the_last_light_is_of_a_larger_kind():
    """A block of one kind of light, filled up with −1, in a scene whose last light has a number beyond that kind's: it ended a bake."""
    few, many = (hall(count, seed=1) for count in (9, 60))
    kind = next(k for k, batch in enumerate(few.batches) if isinstance(batch, Polygons))
    sources = few.with_polygons(many.batches[kind])
    mine = np.flatnonzero(few.batch == kind)
    light = np.append(mine, -1)[:, None]
    place = np.full((3, 1), 0.1, np.float32), np.array([[0], [0], [1]], np.float32), np.zeros(1, np.float32)
    found = sources.importance(light, *place)
    assert found[-1] == 0
    np.testing.assert_array_equal(found[:-1], few.importance(mine[:, None], *place))


def test_every_light_is_in_one_block():
    random = np.random.default_rng(0)
    for count in (BLOCK * TOP - 1, BLOCK * TOP + 1, 5000):
        emitters = Emitters(random.random((count, 3)), np.zeros(count), random.random((count, 3)),
                            np.ones(count), np.zeros(count), np.zeros(count, bool))  # fmt: skip
        tree = build_tree(emitters, TOP, BLOCK)
        assert sorted(tree.blocks[tree.blocks >= 0]) == list(range(count))
        assert tree.levels[0].count <= TOP and tree.levels[-1].count == len(tree.blocks)
        total = [level.power.sum() for level in tree.levels]
        np.testing.assert_allclose(total, count, rtol=1e-9)
        for upper, lower in zip(tree.levels, tree.levels[1:]):
            assert lower.count == 2 * upper.count


def test_a_lamp_of_several_faces_is_found_from_nearby():
    """25 lamps of six faces each, 4 and 6 m apart. 65 cm beside each, a block's light over the chance that it is taken has a
    mean square of at most 1.5 times its mean, squared. It was 500 times that, where a block held one face of the lamp nearby and others far away."""
    lamps = np.stack(np.meshgrid(6.0 * np.arange(5), 4.0 * np.arange(5), [2.5]), -1).reshape(-1, 3)
    faces = 0.05 * np.vstack([np.eye(3), -np.eye(3)]) * [15, 1, 0.6]
    center = (lamps[:, None] + faces).reshape(-1, 3)
    power, nothing = np.ones(len(center)), np.zeros(len(center))
    tree = build_tree(Emitters(center, nothing, center, power, power, nothing == 0), TOP, BLOCK)
    position, normal = lamps - [0, 0.65, 0], np.tile([0.0, 1, 0], (len(lamps), 1))
    xi = np.tile(((np.arange(4096) + 0.5) / 4096)[:, None], len(lamps))
    block, chance, _ = tree.descend(position, normal, nothing[: len(lamps)], xi)
    away = center - position[:, None]
    light = np.maximum(away[..., 1], 0) / (away**2).sum(axis=2) ** 1.5
    members = np.where(tree.blocks >= 0, light[:, tree.blocks], 0).sum(axis=2)  # (places, blocks)
    value = members[np.arange(len(lamps)), block] / chance
    assert value.mean(axis=0) == pytest.approx(light.sum(axis=1), rel=0.05)
    assert ((value**2).mean(axis=0) < 1.5 * light.sum(axis=1) ** 2).all()


def test_work_grows_with_the_logarithm():
    """Ten times the lights add at most four levels, each of two nodes for a way down; the nodes
    compared near the root and the lights at the end stay as many."""
    depth = {}
    for count in (1000, 10_000, 100_000):
        zero = np.zeros(count)
        center = np.random.default_rng(0).random((count, 3))
        sampler = make_light_sampler(np.arange(count), Emitters(center, zero, center, zero + 1, zero, zero > 0))
        depth[count] = len(sampler.tree.levels)
        assert sampler.blocks.shape[1] == BLOCK and sampler.tree.levels[0].count <= TOP
    assert depth[10_000] - depth[1000] <= 4 and depth[100_000] - depth[10_000] <= 4


def test_pick_is_in_proportion():
    """Columns 1, 3, 0, 4 of 8: one eighth, three eighths, none, a half of evenly spread numbers;
    and the numbers made anew are evenly spread again."""
    n = 8000
    importance = np.tile(np.array([1.0, 3, 0, 4])[:, None], n)
    (column,), (chance,), (rest,) = sample_discrete(importance, ((np.arange(n) + 0.5) / n)[None])
    assert list(np.bincount(column)) == [1000, 3000, 0, 4000]
    np.testing.assert_allclose(chance, np.array([1, 3, 0, 4])[column] / 8)
    for k in (0, 1, 3):
        mine = np.sort(rest[column == k])
        np.testing.assert_allclose(mine, (np.arange(len(mine)) + 0.5) / len(mine), atol=1e-6)
    assert sample_discrete(np.zeros((3, 2)), np.full((1, 2), 0.5))[1].max() == 0


def test_choices_for_all_points_of_a_receiver_reach_each():
    """Chosen once for all points of a flat receiver: every light that brings them a thousandth of
    their light or more is taken by some of 2^14 evenly spread numbers."""
    sources = hall(90)
    (sampler,) = sources.samplers
    random = np.random.default_rng(5)
    n, reach = 1 << 14, 0.05
    place, normal = np.array([0.1, -0.2, 0.05]), np.array([0.0, 0.6, 0.8])
    level = ((np.arange(n) + 0.5) / n)[None]
    many = np.tile(place, (n, 1)), np.tile(normal, (n, 1))
    (light,), (factor,) = sample_lights(sources.importance, sampler, *many, np.full(n, reach), level)
    chance = np.zeros(sources.count)
    np.maximum.at(chance, light, factor > 0)
    inside = random.uniform(-1, 1, (200, 3)) * reach / np.sqrt(3)
    inside -= (inside @ normal)[:, None] * normal  # a flat receiver
    needed = np.zeros(sources.count)
    facing, middle = np.tile(normal, (200, 1)), np.full((200, 2), 0.5)
    for number in range(sources.count):
        kind, k = sources.named(number)
        sample = kind.sample(np.full(200, k), place + inside, facing, middle)
        needed[number] = sample.irradiance.mean() * kind.color[k].mean()
    strong = needed > 1e-3 * needed.sum()
    assert strong.sum() > 5 and (chance[strong] > 0).all()


@pytest.mark.parametrize("size, offset", [(0.25, 0.0), (0.25, 0.1), (0.5, 0.0), (0.1, 0.02)])
def test_overlapping_faces_cover_their_union_once(size, offset):
    """A square of edge 1/4 and one of ``size``, moved by ``offset`` along x, cut 3 × 3: what is
    left has the area of both less that of their intersection, a rectangle."""
    first = scenes.quad((0.5, 0.5, 0.8), 0.25)
    corners = scenes.quad((0.5 + offset, 0.5, 0.8), size)[0][[0, 1, 3, 2]]
    scene = meshes.scene([*scenes.walls(1), first, meshes.grid(corners, 3)], 0.5, 0.0)
    context = build_context(scene, 0, 1, silent)
    lit = np.flatnonzero(scene.object >= 6)
    cells, left = uncovered(
        context.geometry, context.tracer, undivided(lit, np.ones((len(lit), 3)))
    )
    assert not left.any()
    across = max(min(0.125, offset + size / 2) - max(-0.125, offset - size / 2), 0)
    union = 0.25**2 + size**2 - across * min(size, 0.25)
    found = (cells.share * context.geometry.area[cells.triangle]).sum() * context.geometry.scale**2
    assert found == pytest.approx(union, rel=1e-6)
