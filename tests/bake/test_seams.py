"""Meshes cut open along sharp edges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from radiosity_addon.bake.seams import cut_sharp_edges


def cut(points, faces, degrees=66):
    corner = np.concatenate(faces)
    start = np.cumsum([0] + [len(face) for face in faces[:-1]])
    points = np.array(points, float)
    new, label = cut_sharp_edges(points, corner, start, math.radians(degrees))
    assert np.array_equal(new[label], points[corner])  # nothing moved
    return len(new)


CUBE = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def test_a_cube_falls_apart():
    assert cut(CUBE, SIDES) == 24
    assert cut(CUBE, SIDES, 91) == 8


@pytest.mark.parametrize("degrees, vertices", [(65, 4), (67, 6)])
def test_the_angle_between_two_triangles(degrees, vertices):
    a = math.radians(degrees)
    points = [(0, 0, 0), (0, 1, 0), (-1, 0, 0), (math.cos(a), 0, -math.sin(a))]
    assert cut(points, [(0, 1, 2), (1, 0, 3)]) == vertices


def test_turned_neighbors_and_edges_of_three_faces_are_cut():
    points = [(0, 0, 0), (0, 1, 0), (-1, 0, 0), (1, 0, 0), (1, 1, 0)]
    assert cut(points, [(0, 1, 2), (0, 1, 3)]) == 6
    assert cut(points, [(0, 1, 2), (1, 0, 3), (1, 0, 4)]) == 9


def test_faces_without_area_hang_on_nothing():
    points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0)]
    assert cut(points, [(0, 1, 2), (1, 0, 3)]) == 6
