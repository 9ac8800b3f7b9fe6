"""Packing: islands that lie far apart in an image come close, and each is smoothed as it is alone."""

import numpy as np
import pytest

from radiosity_addon.solver.filtering.lattice_weights import build_lattices
from radiosity_addon.solver.filtering.pack_texels import BLOCK, pack_texels
from radiosity_addon.solver.filtering.smooth import smooth

GAP = 16


def island(row: int, column: int, height: int, width: int) -> np.ndarray:
    """(height · width, 2) rows and columns of a rectangle of texels."""
    return np.stack(np.divmod(np.arange(height * width), width), 1) + [row, column]


def scattered(seed: int) -> list[np.ndarray]:
    """Rectangles of texels of many sizes, no two of which have blocks that touch, all over an image of 1000²."""
    random = np.random.default_rng(seed)
    cell = 100
    return [
        island(*(cell * np.array([i, j]) + random.integers(0, 60, 2)), *random.integers(1, cell - 80, 2))
        for i in range(10)
        for j in range(10)
        if random.random() < 0.3
    ]


@pytest.mark.parametrize("seed", range(5))
def test_islands_move_as_wholes_and_stay_apart(seed):
    islands = scattered(seed)
    number = np.repeat(np.arange(len(islands)), [len(each) for each in islands])
    row, column = np.concatenate(islands).T
    row, column = row - row.min(), column - column.min()
    packed = np.stack(pack_texels(row, column, GAP), 1)
    for k, each in enumerate(islands):
        assert np.ptp(packed[number == k] - each, axis=0).tolist() == [0, 0]
    place = [packed[number == k] for k in range(len(islands))]
    for k, one in enumerate(place):
        for other in place[:k]:
            beyond = np.maximum(one.min(0) - other.max(0), other.min(0) - one.max(0))
            assert beyond.max() > GAP
    assert packed.min() == 0
    assert np.prod(packed.max(0) + 1) < 0.3 * np.prod([np.ptp(row) + 1, np.ptp(column) + 1])


def test_full_images_stay_as_they_are():
    row, column = island(0, 0, 40, 40)[:, 0], island(0, 0, 40, 40)[:, 1]
    assert pack_texels(row, column, GAP) == (row, column)
    near = np.arange(0, 40 * BLOCK, BLOCK)  # single texels in blocks that touch
    assert pack_texels(near, near, GAP) == (near, near)


def test_an_island_is_smoothed_as_it_is_alone():
    """Two walls of 40 x 30 texels in opposite corners of an image of 1024²."""
    one, two = island(0, 0, 40, 30), island(980, 990, 40, 30)
    normal = np.tile([0.0, 0, 1], (len(one), 1))
    random = np.random.default_rng(3)
    a, b = (1 + 0.3 * random.normal(size=(2, 2 * len(one), 1))).astype(np.float32)

    def lattice(islands, height):
        grid = np.hstack([np.zeros((len(one) * len(islands), 1), int), np.concatenate(islands)])
        place = np.concatenate([np.hstack([each, np.full((len(one), 1), z)]) for each, z in zip(islands, height)])
        return build_lattices(grid, place.astype(float), np.tile(normal, (len(islands), 1)))

    (both,) = lattice([one, two], [0, 5])
    assert np.prod(both.shape) < 20 * len(one)
    found = smooth([both], a, b, np.ones_like(a))
    for part, each, z in zip((slice(None, len(one)), slice(len(one), None)), (one, two), (0, 5)):
        alone = smooth(lattice([each], [z]), a[part], b[part], np.ones_like(a[part]))
        assert np.array_equal(found.a[part], alone.a)
        assert np.array_equal(found.square[part], alone.square)
