"""Clips, areas and clusters: what several parts of the solver share."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.array_struct import ArrayStruct
from radiosity_addon.solver.geometry.clusters import cubes, facings, labels, octants
from radiosity_addon.solver.geometry.planar import (
    cell_areas,
    cell_middles,
    clip,
    doubled_areas,
    fan,
)
from radiosity_addon.solver.tracing.crossings import Crossings

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


@pytest.mark.parametrize("cut", [0.25, 0.5, 1.25, 1.9])
def test_a_square_clipped_across_its_corner(cut):
    """Left of x + y = c lies c²/2 of a unit square, and beyond 1 all but (2 − c)²/2."""
    part = clip(SQUARE, cut - SQUARE.sum(axis=1))
    expected = cut**2 / 2 if cut < 1 else 1 - (2 - cut) ** 2 / 2
    assert np.abs(doubled_areas(fan(part))).sum() / 2 == pytest.approx(expected)


def test_nothing_is_left_below_and_all_above():
    assert clip(SQUARE, np.full(4, -1.0)).shape == (0, 2)
    assert fan(clip(SQUARE, np.full(4, -1.0))).shape == (0, 3, 2)
    assert len(fan(clip(SQUARE, np.ones(4)))) == 2


def test_areas_and_middles_of_cells():
    """A parallelogram and the triangle that is half of it."""
    corners = np.array([[[1.0, 1], [3, 1], [1, 4]]] * 2)
    square = np.array([True, False])
    assert cell_areas(corners, square).tolist() == [12.0, 6.0]  # twice as much
    assert cell_middles(corners, square).tolist() == [[2.0, 2.5], [5 / 3, 2.0]]


@pytest.mark.parametrize(("far", "times"), [(1, 1), (1, 1000), (1 << 40, 1)])
def test_labels_ascend_without_gaps(far, times):
    """The first column is foremost; keys that are too many for one number, or few for the things, are told apart, too."""
    one = np.array([3, 1, 3, 1, 2]) * far
    two = np.array([[0, 5], [7, -5], [0, 5], [7, -6], [0, 0]]) * far
    found = labels(np.tile(one, times), np.tile(two, (times, 1)))
    assert found.tolist() == times * [3, 1, 3, 0, 2]
    assert labels(one[:0], two[:0]).tolist() == []


def test_cubes_and_facings():
    assert cubes(np.array([[-0.1, 0.0, 0.19]]), 0.1, -0.5).tolist() == [[4, 5, 6]]
    assert facings(np.array([[0, 0, 1.0], [0, 0.1, 0.99], [0.6, 0, -0.8]])).tolist() == [
        [0, 0, 2], [0, 0, 1], [1, 0, -1],
    ]  # fmt: skip


def test_octants_are_around_each_owners_own_mean():
    position = np.array([[0.0, 0, 0], [1, 1, 1], [5, 5, 5], [7, 5, 5]])
    assert octants(position, np.array([0, 0, 1, 1])).tolist() == [0, 7, 8, 9]


def test_structs_of_arrays_are_taken_from_and_joined():
    """All arrays alike; a join of what was taken apart is what there was."""
    k = np.arange(4)
    every = Crossings(k, np.ones((4, 3)) * k[:, None], np.zeros((4, 2, 2)), k + 1, k > 1)
    one, two = every.take(k[:1]), every.take(k > 0)
    assert isinstance(every, ArrayStruct) and two.triangle.tolist() == [1, 2, 3]
    joined = Crossings.join([one, two])
    assert joined.height.tolist() == every.height.tolist()
    assert joined.across.tolist() == every.across.tolist()
