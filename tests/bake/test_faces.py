"""Pieces of faces: they tile the triangles, and large ones get more."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.faces import (
    face_receivers,
    most_receivers,
    receiver_areas,
    receiver_budget,
    triangle_areas,
)

VERTICES = np.array([(0, 0, 0), (4, 0, 0), (0, 3, 0), (0.1, 0, 1), (0, 0.1, 1), (0, 0, 1)], float)
TRIANGLES = np.array([(0, 1, 2), (5, 3, 4)])  # areas 6 and 0.005


def test_areas_of_the_pieces_are_equal_and_add_up():
    budget = receiver_budget(triangle_areas(VERTICES, TRIANGLES), 100)
    receivers = face_receivers(VERTICES, TRIANGLES, np.array([0, 1]), budget)
    # 6 / (6.005/100) = 99.9 pieces: n = ceil(sqrt(99.9)) = 10; the small one has the least, 2
    assert np.bincount(receivers.triangle).tolist() == [100, 4]
    area = receiver_areas(VERTICES, TRIANGLES, receivers)
    assert area == pytest.approx([0.06] * 100 + [0.005 / 4] * 4)


@pytest.mark.parametrize("n", [1, 2, 3, 16])
def test_pieces_tile_the_triangle(n):
    """Random points of the triangle lie in exactly one piece."""
    receivers = face_receivers(VERTICES, TRIANGLES[:1], np.array([0]), 6 / n**2, least=1)
    assert receivers.count == n**2
    rng = np.random.default_rng(0)
    points = rng.dirichlet([1, 1, 1], 500)[:, 1:]
    a, b, c = receivers.corners.transpose(1, 0, 2)
    inverse = np.linalg.inv(np.stack([b - a, c - a], -1))
    local = np.einsum("rij,prj->pri", inverse, points[:, None] - a)
    inside = (local >= 0).all(-1) & (local.sum(-1) <= 1)
    assert (inside.sum(1) == 1).all()


def test_fine_meshes_cost_one_receiver_a_triangle():
    triangles = np.repeat(TRIANGLES, 30_000, axis=0)
    receivers = face_receivers(VERTICES, triangles, np.arange(60_000), 100.0)
    assert receivers.count == 60_000


def test_faces_without_area_or_with_nan_get_none():
    vertices = np.concatenate([VERTICES, [(np.nan, 0, 0)]])
    triangles = np.array([(0, 1, 6), (0, 0, 1), (0, 1, 2)])
    assert triangle_areas(vertices, triangles).tolist() == [0, 0, 6]
    receivers = face_receivers(vertices, triangles, np.array([5, 6, 7]), 6.0)
    assert set(receivers.triangle) == {7} and receivers.count == 4


def test_square_cells_count_twice():
    from radiosity_addon.bake.texels import texel_receivers

    uv = np.array([[[0, 0], [1, 0], [0, 1]]], float)  # 4 × 4 texels over an area of 6
    receivers = texel_receivers(uv, np.array([0]), 4)
    area = receiver_areas(VERTICES, TRIANGLES, receivers)
    assert area.sum() == pytest.approx(6) and area.max() == pytest.approx(6 * 2 / 16)


@pytest.mark.parametrize("cuts", [1, 12, 60, 90])
def test_no_more_receivers_than_are_foreseen(cuts):
    """Two grids of equal triangles, one 3 times as wide: at 60 cuts each triangle is to have 0.56
    or 5 pieces, at 12 cuts 14 or 125."""
    s, t = (place.ravel() for place in np.meshgrid(*[np.linspace(0, 1, cuts + 1)] * 2))
    first = (np.arange(cuts)[:, None] * (cuts + 1) + np.arange(cuts)).ravel()
    triangles = np.column_stack([first, first + 1, first + cuts + 2])
    grids = [scale * np.column_stack([s, t, 0 * s]) for scale in (1, 3)]
    budget = receiver_budget(np.concatenate([triangle_areas(g, triangles) for g in grids]))
    numbers = np.arange(len(triangles))
    made = sum(face_receivers(grid, triangles, numbers, budget).count for grid in grids)
    assert made <= most_receivers([len(triangles)] * 2)
