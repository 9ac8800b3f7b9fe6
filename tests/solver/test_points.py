"""Where rays start: chunks of owners, cells of footprints, and axes to aim by."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.sampling.points import footprint_points, grouped_chunks, masked, owned
from radiosity_addon.solver.sampling.sobol import GROUPS, sobol, tangent_axes, tangent_frames

CORNER = np.array([[[0.0, 0], [0.5, 0], [0, 0.5]]])  # a quarter of a triangle, or half as a square


def footprints():
    """Three receivers on two triangles that face differently, the second four times as large: a
    piece of the first, pieces of both, a piece of the second."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (0, 2, 0)], float)
    geometry = build_geometry(vertices, np.array([(0, 1, 2), (0, 4, 3)]))
    receiver, triangle = np.array([0, 1, 1, 2]), np.array([0, 0, 1, 1], np.int32)
    square = np.array([False, True, False, True])
    return geometry, build_footprints(
        geometry, Receivers(3, receiver, triangle, np.repeat(CORNER, 4, axis=0), square)
    )


@pytest.mark.parametrize("count", [0, 1, 7, 64, 500, 10_000])
@pytest.mark.parametrize("size", [1, 60, 4096])
def test_chunks_cover_every_owner_once(count, size):
    """Neighbors are in different groups, but few owners in few: 64 of them fill one."""
    chunks = grouped_chunks(count, size)
    group = np.full(count, -1)
    for number, chosen in chunks:
        assert (group[chosen] == -1).all() and 0 < len(group[chosen]) <= size
        group[chosen] = number
    assert (group >= 0).all()
    assert len(np.unique(group)) == min(count, GROUPS, 1 + count // 64)
    if count >= 64:
        assert (np.diff(group) != 0).all()


def test_many_owners_share_no_set():
    """Four rays of each of 131,072 owners, whose sets differ by a rotation about the normal only; light comes from a band of
    1/32 of sin²θ, which one ray of a set meets with the chance p = 4/32. The mean over all owners is off by
    √((1 − p) / p / n) of itself for n sets: 0.33 for 64, within a standard error of 100 seeds, √(2 / 100) / 2, three
    times; 8 sets, as few owners have, would leave 0.94."""
    chunks, off = grouped_chunks(1 << 17, 1 << 14), []
    for seed in range(100):
        brought = [(chosen.stop - chosen.start) / chosen.step * ((sobol(4, 2, seed, group)[:, 0] // (1 / 32)) == 13).mean()
                   for group, chosen in chunks]  # fmt: skip
        off.append(sum(brought) / (1 << 17) * 32 - 1)
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(np.sqrt(7 / 64), rel=3 * np.sqrt(2 / 100) / 2)


def test_means_over_footprints_are_by_area():
    """The middle receiver has a square of area ½ · ½ of the first triangle's doubled area, 1, and a
    triangle of half of that of the second's, 4: their areas are as 1 to 2."""
    _, found = footprints()
    values = np.array([[1.0, 0], [2, 0], [5, 3], [7, 1]])
    np.testing.assert_allclose(found.mean_of_cells(values), [[1, 0], [4, 2], [7, 1]], rtol=1e-12)


def test_points_of_a_footprint_lie_on_its_cells():
    """A footprint of two cells has points on both, in proportion to their areas (2 in 3 on the
    larger), and the others' lie on the one they have."""
    _, found = footprints()
    owners = np.repeat(np.arange(3), 50)
    turn = np.random.default_rng(0).random((150, 3), np.float32)
    points = footprint_points(found, owners, turn, 12, 5)
    triangle = points.triangle
    assert (triangle[:, :50] == 0).all() and (triangle[:, 100:] == 1).all()
    assert triangle[:, 50:100].sum(axis=0).min() >= 7 and triangle[:, 50:100].sum(axis=0).max() <= 9
    flat = np.abs(np.einsum("pok,pok->po", points.normal, points.position - found.origin[0]))
    assert flat.max() < 1e-5  # both planes go through one corner, but for what rays are lifted


def test_owners_that_are_chosen():
    array = np.arange(24).reshape(2, 4, 3)
    every, some = np.ones(4, bool), np.array([True, False, True, True])
    assert owned(array, masked(every)).base is array.base  # all of them: no copy
    np.testing.assert_array_equal(owned(array, masked(some)), array[:, some])


def test_axes_are_turned_frames():
    """Right-handed, orthonormal, the normal last; half a turn takes the tangent to its opposite."""
    normal = np.random.default_rng(1).normal(size=(100, 3))
    normal = np.concatenate([normal, np.eye(3), -np.eye(3)])
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32)
    frames = tangent_frames(normal)
    np.testing.assert_allclose(frames @ frames.swapaxes(1, 2), np.tile(np.eye(3), (106, 1, 1)),
                               atol=1e-6)  # fmt: skip
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-6)
    axes = tangent_axes(normal, 0.5)
    np.testing.assert_allclose(axes[:2], -frames.swapaxes(0, 1)[:2], atol=1e-6)
    np.testing.assert_array_equal(axes[2], normal)
