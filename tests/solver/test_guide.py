"""The guide: where it sends rays, what it makes them weigh, and that means stay what they are."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.sampling.guide import (
    BINS,
    COLUMNS,
    ROWS,
    SLOTS,
    _slots,
    clusters_of,
    make_guide,
    start_learning,
    sums_by_bin,
)
from radiosity_addon.solver.sequence import Options, open_scene, solve_opened
from verification import exact, meshes


def learned_from(light):
    """A guide for one receiver whose evenly spread rays brought ``light(x, y)``, or None."""
    learning = start_learning(np.zeros(1, int))
    x, y = np.random.default_rng(0).random((2, 200_000))
    row, column = (x * ROWS).astype(int), (y * COLUMNS).astype(int)
    learning.add(sums_by_bin((row * COLUMNS + column)[:, None], light(x, y)))
    return make_guide(learning)


def window(x, y):
    """Light from one cell of the 128, and a little from everywhere."""
    return 0.01 + 10.0 * ((x < 1 / ROWS) & (y < 1 / COLUMNS))


def aimed(guide, count=4096):
    u, v = np.random.default_rng(1).random((2, count, 1)).astype(np.float32)
    *place, cells = guide.aim(np.zeros(1, int), u, v)
    return np.stack([axis.ravel() for axis in place], 1), cells.ravel()


def test_slots_add_up_and_leave_none_out():
    slots = _slots(np.random.default_rng(2).random((5, BINS)) ** 8)
    assert (slots.sum(axis=1) == SLOTS).all() and slots.min() >= 1


def test_a_chunk_of_receivers_keeps_sums_of_its_own_clusters_only():
    """Four receivers of two clusters out of a thousand: of a chunk 2 · 128 sums are kept, and what
    is added is what one count over all cells gives."""
    random = np.random.default_rng(3)
    cluster = np.array([700, 20, 700, 20])
    learning = start_learning(np.arange(1000))
    cells = cluster * BINS + random.integers(0, BINS, (64, 4))
    light = random.random(cells.size)
    found = sums_by_bin(cells, light)
    assert found.clusters.tolist() == [20, 700]
    assert all(each.shape == (2, BINS) for each in found.sums)
    learning.add(found)
    learning.add(found)
    for found, weight in zip((learning.number, learning.light, learning.square),
                             (None, light, light**2)):  # fmt: skip
        expected = 2 * np.bincount(cells.ravel(), weight, 1000 * BINS)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_rays_go_where_light_comes_from_and_lie_in_their_cells():
    guide = learned_from(window)
    place, cells = aimed(guide)
    inside = (place[:, 0] < 1 / ROWS) & (place[:, 1] < 1 / COLUMNS)
    # The root of the mean square is 10.01 there and 0.01 in 127 other cells: 10.01 / 11.28 of the
    # 384 slots that are shared out, and one more, of 512.
    assert inside.mean() == pytest.approx((384 * 10.01 / 11.28 + 1) / SLOTS, abs=0.02)
    row, column = (place[:, 0] * ROWS).astype(int), (place[:, 1] * COLUMNS).astype(int)
    np.testing.assert_array_equal(row * COLUMNS + column, cells)


def test_weights_make_up_for_the_choice():
    """The weighted mean of any function is its mean over the square: here of x² + y, 5/6, by 4096
    rays that weigh up to 4, whose standard error is below 0.03."""
    guide = learned_from(window)
    place, cells = aimed(guide)
    value = place[:, 0] ** 2 + place[:, 1]
    assert guide.weight.max() <= 4
    assert np.mean(value * guide.weight[cells]) == pytest.approx(5 / 6, abs=0.1)
    assert np.mean(guide.weight[cells]) == pytest.approx(1, abs=0.1)


def test_no_guide_for_even_light():
    assert learned_from(lambda x, y: 1.0 + 0 * x) is None


def test_clusters_hold_neighbors_that_face_alike():
    position = np.random.default_rng(3).random((5000, 3)) * [1, 1, 0]
    normal = np.where(np.arange(5000)[:, None] % 2, [0, 0, 1.0], [0, 0, -1.0])
    cluster = clusters_of(position, normal, np.full(5000, 1 / 5000))
    for number in np.unique(cluster)[:20]:
        mine = cluster == number
        assert np.ptp(position[mine], axis=0).max() <= 1 / 16 + 1e-9  # 256 cubes on area 1
        assert np.ptp(normal[mine], axis=0).max() == 0


@pytest.mark.parametrize("useful", [0.0, np.inf])
def test_guided_rays_change_no_mean(useful):
    """A closed sphere's exact radiosities, with rays that follow a guide and with rays that do
    not: weights that did not make up for the choice would show."""
    q, rho = np.array([4.0] + 7 * [0.0]), np.full(8, 0.5)
    scene = meshes.sphere_scene(3, rho[:, None], q[:, None])
    expected = exact.closed_sphere(
        q[scene.object], rho[scene.object], meshes.areas(scene.vertices, scene.triangles)
    )
    means = []
    for seed in range(3):  # a correction that is noise alone has a mean of up to a quarter of the error
        receivers, settings = meshes.triangle_receivers(scene), Settings(error=0.005, seed=seed)
        context = open_scene(scene, receivers, settings)
        found = solve_opened(context, receivers, settings, Options(useful=useful))
        level = found.emission + found.diffuse / np.pi * (found.direct + found.indirect)
        ratio = np.pi * level[:, 0] / expected
        assert np.sqrt(np.mean((ratio - 1) ** 2)) < 0.01  # twice what is asked for
        means.append(ratio.mean())
    assert np.mean(means) == pytest.approx(1, abs=2e-3)
