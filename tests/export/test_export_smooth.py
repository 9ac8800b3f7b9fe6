"""Smooth groups: which loops share an unknown, on shapes whose dihedral angles are known."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.smooth_groups import smooth_groups
from tests.export.scene_building import add_object


def fold(bpy, degrees, flip=False):
    """Two unit squares sharing the y axis, the second bent up by an angle. Loops 0-3 and 4-7."""
    bend = np.radians(degrees)
    x, z = np.cos(bend), np.sin(bend)
    points = [(-1, 0, 0), (0, 0, 0), (0, 1, 0), (-1, 1, 0), (x, 0, z), (x, 1, z)]
    second = (1, 4, 5, 2)
    mesh = bpy.data.meshes.new("Fold")
    mesh.from_pydata(points, [], [(0, 1, 2, 3), second[::-1] if flip else second])
    add_object(bpy, "Fold", mesh)
    return mesh


@pytest.mark.parametrize("degrees, groups", [(0, 6), (29, 6), (31, 8), (90, 8), (180, 8)])
def test_angle_decides(blender, degrees, groups):
    # 8 loops; joined faces share the two vertices of their edge: 8 - 2 groups.
    assert len(np.unique(smooth_groups(fold(blender, degrees)))) == groups


def test_loops_of_a_group_share_a_vertex(blender):
    mesh = fold(blender, 10)
    group = smooth_groups(mesh)
    vertex = np.array([loop.vertex_index for loop in mesh.loops])
    for number in np.unique(group):
        assert len(set(vertex[group == number])) == 1


def test_sharp_edge_separates(blender):
    mesh = fold(blender, 0)
    next(e for e in mesh.edges if set(e.vertices) == {1, 2}).use_edge_sharp = True
    assert len(np.unique(smooth_groups(mesh))) == 8


def test_opposite_winding_separates(blender):
    assert len(np.unique(smooth_groups(fold(blender, 0, flip=True)))) == 8


def test_cube_has_no_smooth_corner_and_sphere_no_sharp_one(blender):
    blender.ops.mesh.primitive_cube_add()
    assert len(np.unique(smooth_groups(blender.context.object.data))) == 24
    blender.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    sphere = blender.context.object.data
    assert len(np.unique(smooth_groups(sphere))) == len(sphere.vertices)


def test_edge_of_three_faces_separates(blender):
    mesh = blender.data.meshes.new("Fan")
    points = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (-1, 0, 0.1), (-1, 0, -0.1)]
    mesh.from_pydata(points, [], [(0, 2, 1), (0, 1, 3), (0, 1, 4)])
    assert len(np.unique(smooth_groups(mesh))) == 9
