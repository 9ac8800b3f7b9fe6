"""Texel footprints: exact areas, partitions, and what gets no texel."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from radiosity_addon.bake.clip import clip_squares, doubled_areas, fan
from radiosity_addon.bake.texels import overlapping_texels, texel_receivers

HALVES = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)


def areas(receivers, uv, resolution):
    """(count,) covered part of each texel, in texels."""
    share = np.abs(doubled_areas(receivers.corners)) * np.where(receivers.square, 1.0, 0.5)
    texels = share * np.abs(doubled_areas(uv))[receivers.triangle] * resolution**2
    return np.bincount(receivers.receiver, texels, receivers.count)


def check_valid(receivers):
    """What the interface promises: every receiver owns a cell of positive area, in order."""
    assert (np.diff(receivers.receiver) >= 0).all()
    assert np.array_equal(np.unique(receivers.receiver), np.arange(receivers.count))
    assert (np.abs(doubled_areas(receivers.corners)) > 0).all()
    ends = receivers.corners
    fourth = np.where(receivers.square[:, None], ends[:, 1] + ends[:, 2] - ends[:, 0], ends[:, 0])
    all_four = np.concatenate([ends, fourth[:, None]], 1)
    assert all_four.min() > -1e-6 and all_four.sum(2).max() < 1 + 1e-6  # within the triangle


def test_full_square_covers_every_texel_wholly():
    receivers = texel_receivers(HALVES, np.array([7, 9]), 8, image=3)
    check_valid(receivers)
    assert receivers.count == 64
    assert (receivers.grid[:, 0] == 3).all()
    rows, columns = np.divmod(np.arange(64), 8)
    assert np.array_equal(receivers.grid[:, 1:], np.stack([rows, columns], 1))
    # 56 texels off the diagonal are one square each, the 8 on it two triangles each
    assert receivers.square.sum() == 56 and len(receivers.receiver) == 56 + 2 * 8
    assert set(receivers.triangle) == {7, 9}
    assert (receivers.triangle[receivers.square & (columns > rows)[receivers.receiver]] == 7).all()


def test_cells_lie_where_the_texel_is():
    uv = np.array([[[0.1, 0.05], [0.93, 0.2], [0.4, 0.97]]])
    receivers = texel_receivers(uv, np.array([0]), 16)
    check_valid(receivers)
    u, v = receivers.corners[..., :1], receivers.corners[..., 1:]
    place = (1 - u - v) * uv[0, 0] + u * uv[0, 1] + v * uv[0, 2]
    texel = receivers.grid[receivers.receiver][:, None, :0:-1]  # (column, row)
    inside = place * 16 - texel
    assert inside.min() > -1e-9 and inside.max() < 1 + 1e-9


def test_axis_aligned_border_is_one_square_cell():
    # 2.5 texels wide, 2 high at (1, 1): the half texels are parallelograms, not two triangles
    corners = np.array([[1, 1], [3.5, 1], [3.5, 3], [1, 3]]) / 8
    uv = corners[[[0, 1, 2], [0, 2, 3]]]
    receivers = texel_receivers(uv, np.arange(2), 8)
    covered = areas(receivers, uv, 8)
    assert receivers.count == 6
    assert covered == pytest.approx([1, 1, 0.5] * 2, abs=1e-12)


@settings(max_examples=60, deadline=None)
@example(points=[(0.0, 1.0), (0.0, 2.2250738585e-313), (1.0, 0.0)], resolution=1)
@given(
    points=st.lists(st.tuples(*[st.floats(0, 1)] * 2), min_size=3, max_size=3),
    resolution=st.integers(1, 40),
)
def test_areas_sum_to_the_triangle(points, resolution):
    """The footprints partition the triangle: their areas add up to it (within the cells left
    out, at most 1e-6 of each of the texels it can touch)."""
    uv = np.array([points])
    receivers = texel_receivers(uv, np.array([0]), resolution)
    total = abs(doubled_areas(uv)[0]) / 2 * resolution**2
    covered = areas(receivers, uv, resolution)
    if total > 1e-4:
        assert covered.sum() == pytest.approx(total, abs=1e-6 * (resolution + 1) * 4 + 1e-9)
        assert covered.max() < 1 + 1e-6


def test_triangulation_partitions_every_texel():
    """A jittered grid over the tile: every texel is covered exactly once."""
    n = 9
    rng = np.random.default_rng(1)
    points = np.stack(np.meshgrid(*[np.linspace(0, 1, n + 1)] * 2), -1)
    points[1:-1, 1:-1] += rng.uniform(-0.3, 0.3, (n - 1, n - 1, 2)) / n
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    uv = np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 2),
                         np.stack([a, c, d], 2).reshape(-1, 3, 2)])
    receivers = texel_receivers(uv, np.arange(len(uv)), 16)
    assert areas(receivers, uv, 16) == pytest.approx(np.ones(256), abs=1e-5)
    assert overlapping_texels(receivers, uv, 0, 16) == 0


@pytest.mark.parametrize("turn", [slice(None), slice(None, None, -1)])
def test_orientation_does_not_matter(turn):
    receivers = texel_receivers(HALVES[:1, turn], np.array([0]), 5)
    assert areas(receivers, HALVES[:1], 5).sum() == pytest.approx(12.5)


def test_triangle_inside_one_texel():
    uv = np.array([[[0.51, 0.51], [0.55, 0.51], [0.51, 0.55]]])
    receivers = texel_receivers(uv, np.array([0]), 4)
    assert receivers.grid.tolist() == [[0, 2, 2]]
    assert areas(receivers, uv, 4) == pytest.approx([0.5 * 0.16**2])


def test_a_speck_keeps_its_texel_unless_it_only_touches():
    side = 1e-3  # area 5e-7 texels: negligible beside others, but alone there
    uv = np.array([[[0.5, 0.5], [0.5 + side, 0.5], [0.5, 0.5 + side]]])
    assert texel_receivers(uv, np.array([0]), 1).count == 1
    both = np.concatenate([HALVES, uv])
    assert 2 not in texel_receivers(both, np.arange(3), 1).triangle
    assert texel_receivers((uv - 0.5) * 1e-2 + 0.5, np.array([0]), 1).count == 0


def test_outside_the_tile_is_clipped():
    receivers = texel_receivers(HALVES * 3 - 1, np.arange(2), 6)  # covers -1..2
    assert receivers.count == 36
    assert areas(receivers, HALVES * 3, 6) == pytest.approx(np.ones(36))
    assert texel_receivers(HALVES + 1, np.arange(2), 6).count == 0


def test_no_texel_for_nan_infinite_or_flat_uv():
    bad = np.array([
        [[0, 0], [1, 0], [np.nan, 1]],
        [[0, 0], [np.inf, 0], [0, 1]],
        [[0, 0], [0.5, 0.5], [1, 1]],
        [[0.3, 0.3]] * 3,
    ])
    assert texel_receivers(bad, np.arange(4), 16).count == 0
    mixed = texel_receivers(np.concatenate([bad, HALVES]), np.arange(6), 16)
    assert mixed.count == 256 and mixed.triangle.min() == 4


def test_no_triangles_at_all():
    empty = texel_receivers(np.zeros((0, 3, 2)), np.zeros(0, int), 16)
    assert empty.count == 0 and empty.grid.shape == (0, 3) and empty.corners.shape == (0, 3, 2)


def test_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"\(2, 3, 2\).*must be \(3, 3, 2\)"):
        texel_receivers(HALVES, np.arange(3), 16)


def test_overlap_is_counted_and_averaged():
    uv = np.concatenate([HALVES, HALVES[:1]])  # the lower half twice
    receivers = texel_receivers(uv, np.arange(3), 8)
    assert receivers.count == 64
    assert overlapping_texels(receivers, uv, 0, 8) == 28 + 8  # below and on the diagonal


def test_seven_corners_at_most():
    """A square cut by all three edges of a triangle has 4 + 3 corners; a fan makes 5 cells."""
    triangle = np.array([[[-0.2, 0.5], [0.9, -0.2], [1.1, 1.15]]])
    points, count = clip_squares(np.zeros((1, 2)), triangle)
    owner, corners, square = fan(points, count)
    polygon = points[: count[0], 0]
    x, y = polygon.real, polygon.imag
    shoelace = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert count[0] <= 7 and len(owner) == count[0] - 2 and not square.any()
    assert np.abs(doubled_areas(corners)).sum() / 2 == pytest.approx(shoelace)


@pytest.mark.timed
def test_time_and_cells_of_a_large_image():
    """A million texels, all but the diagonal's one cell each; the goal is a second (this limit
    leaves room for a busy machine)."""
    started = time.perf_counter()
    receivers = texel_receivers(HALVES, np.arange(2), 1024)
    assert len(receivers.receiver) == 1024**2 + 1024
    assert time.perf_counter() - started < 10


def test_an_oblong_image_has_its_own_columns_and_rows():
    """The lower left half of 8 × 4 texels: the diagonal of slope 1/2
    ends at column 8 − 2 r in row r, from its lower side."""
    receivers = texel_receivers(np.array([[(0, 0), (1, 0), (0, 1)]], float), np.array([0]), (8, 4))
    row, column = receivers.grid[:, 1], receivers.grid[:, 2]
    assert [int((row == r).sum()) for r in range(4)] == [8, 6, 4, 2]
    assert all((column[row == r] == np.arange(8 - 2 * r)).all() for r in range(4))
