"""Shading normals: light counts by them, rays are hidden by the true surface."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.cell_normals import shading_of
from radiosity_addon.bake.faces import face_receivers
from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.filtering.lattice_weights import build_lattices
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.receivers import Receivers, Shading, concatenate, slice_receivers
from radiosity_addon.solver.sampling.shade import Shade, fading
from radiosity_addon.solver.scene import Material, PointLamp, Scene, Sky, SunLamp
from radiosity_addon.solver.sequence import solve

FLOOR = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
FLOOR_TRIANGLES = np.array([(0, 1, 2), (0, 2, 3)])


def scene_of(vertices, triangles, **light) -> Scene:
    """A black surface, so that only what arrives first-hand counts."""
    none = np.zeros(len(triangles), np.int32)
    black = Material("Black", Constant(np.zeros(3)))
    return Scene(vertices, triangles.astype(np.int32), none, none, (black,), ("Thing",), **light)


def lit(scene: Scene, receivers: Receivers):
    """(direct, gathered) irradiance (count,) at an asked 1 %."""
    found = solve(scene, receivers, Settings(error=0.01, threads=1))
    return found.direct[:, 0] + found.indirect[:, 0]


def floor_receivers(degrees: float, smooth=None, level: float = 1.0) -> Receivers:
    """Pieces of the floor, shaded as if turned toward +x by an angle."""
    part = face_receivers(FLOOR, FLOOR_TRIANGLES, np.arange(2), 1 / 32)
    angle = np.radians(degrees)
    normal = np.tile(level * np.array([np.sin(angle), 0, np.cos(angle)]), (part.count, 1))
    shading = Shading(normal.astype(np.float32), smooth, np.zeros(part.count, np.float32))
    return Receivers(**{**vars(part), "shading": shading})


def sun(direction=(0, 0, -1)) -> SunLamp:
    return SunLamp("Sun", np.array(direction, float), np.ones(3))


@pytest.mark.parametrize("degrees", [0, 30, 75])
def test_light_counts_by_the_cosine_to_the_shading_normal(degrees):
    """Of a sun at the zenith, of irradiance 1: cos of the angle. A lamp of intensity 1 at the
    height 100 over it brings 1e-4 times that."""
    expected = np.cos(np.radians(degrees))
    scene = scene_of(FLOOR, FLOOR_TRIANGLES, lamps=(sun(),))
    np.testing.assert_allclose(lit(scene, floor_receivers(degrees)), expected, rtol=1e-5)
    lamp = PointLamp("Lamp", np.array([0.5, 0.5, 100]), np.ones(3))
    scene = scene_of(FLOOR, FLOOR_TRIANGLES, lamps=(lamp,))
    np.testing.assert_allclose(
        1e4 * lit(scene, floor_receivers(degrees)), expected, atol=0.012  # up to 0.6° aside
    )


@pytest.mark.parametrize("degrees", [0, 40, 80])
def test_below_the_true_horizon_is_no_sky(degrees):
    """A sky of radiance 1 gives π (1 + cos d) / 2 to a normal turned by d: the part of the
    hemisphere around it below the floor's horizon has the cosine-weighted share (1 − cos d) / 2,
    as a half disk projected less half of the ellipse that the horizon projects to."""
    scene = scene_of(FLOOR, FLOOR_TRIANGLES, sky=Sky(np.ones((1, 1, 3), np.float32)))
    expected = np.pi * (1 + np.cos(np.radians(degrees))) / 2
    np.testing.assert_allclose(lit(scene, floor_receivers(degrees)).mean(), expected, rtol=0.01)


def test_a_mean_of_normals_that_is_shorter_gets_less():
    """Two normals 60° to both sides of the zenith have a mean of length ½ there; a sun at the
    zenith brings ½ to each."""
    scene = scene_of(FLOOR, FLOOR_TRIANGLES, lamps=(sun(),))
    np.testing.assert_allclose(lit(scene, floor_receivers(0, level=0.5)), 0.5, rtol=1e-5)


def test_light_fades_that_grazes_what_maps_turn():
    """A map turns the normal by 45°: α² = tan² 45° / 8 = 1/8. From 60° off the plain normal, tan² =
    3: 2 / (1 + √(1 + 3/8)) = 0.92055. From below nothing comes."""
    share = fading(np.array([0.5, 1.0, -0.1]), np.full(3, np.sqrt(0.5)))
    np.testing.assert_allclose(share, [0.92055, 1, 0], rtol=1e-5)
    up = np.tile(np.float32([0, 0, 1]), (32, 1))
    direction = (-np.sqrt(0.75), 0, -0.5)  # from +x, 60° off the zenith, 15° off the turned normal
    scene = scene_of(FLOOR, FLOOR_TRIANGLES, lamps=(sun(direction),))
    receivers = floor_receivers(45)
    up = np.tile(np.float32([0, 0, 1]), (receivers.count, 1))
    faded = lit(scene, floor_receivers(45, smooth=up))
    np.testing.assert_allclose(faded / lit(scene, receivers), 0.92055, rtol=1e-5)


def column(sides: int):
    """An upright prism of radius 1 and height 1 about the z axis: vertices, triangles, and the
    normals (n, 3, 3) of the round column at its triangles' corners."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], 1)
    vertices = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 1.0)])
    k, following = np.arange(sides), (np.arange(sides) + 1) % sides
    lower = np.stack([k, following, following + sides], 1)
    upper = np.stack([k, following + sides, k + sides], 1)
    triangles = np.concatenate([lower, upper])
    return vertices, triangles, vertices[triangles] * [1, 1, 0]


@pytest.mark.parametrize("sides", [6, 12])
def test_the_terminator_of_a_coarse_column_shows_no_faces(sides):
    """A sun from the side lights a round column by max(n · l, 0); as its faces lie, those with
    their middle beyond the terminator would be black up to 180° / sides before it. Cells are
    shaded by the normal in their middle."""
    vertices, triangles, normals = column(sides)
    part = face_receivers(vertices, triangles, np.arange(len(triangles)), 0.01)
    shading = shading_of(part, vertices, triangles, 0, normals)
    direction = np.array([-np.cos(0.1), -np.sin(0.1), 0])
    scene = scene_of(vertices, triangles, lamps=(sun(direction),))
    cosine = -shading.normal @ direction
    found = lit(scene, Receivers(**{**vars(part), "shading": shading}))
    np.testing.assert_allclose(found, np.maximum(cosine, 0), atol=0.005)
    faces = np.cross(vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
                     vertices[triangles[:, 2]] - vertices[triangles[:, 0]])  # fmt: skip
    hidden = (faces @ direction)[part.triangle] > 0
    assert (cosine[hidden] > 0.05).any(), "some light arrives beyond the faces' own horizon"


def test_the_rounded_surface_is_as_high_as_touching_planes_are():
    """In the middle of an edge of length c between normals turned by ±a from the face's, each plane
    lies (c / 2) sin a above along its own normal, of which cos a goes along the mean normal. Six
    sides of radius 1: c = 1, a = 30°: √3 / 8."""
    vertices, triangles, normals = column(6)
    corners = np.array([[[0.5, 0.0], [0.5, 0], [0.5, 0]]])  # a cell as small as a point
    cell = Receivers(1, np.zeros(1, int), np.zeros(1, int), corners, np.zeros(1, bool))
    found = shading_of(cell, vertices, triangles, 0, normals)
    np.testing.assert_allclose(found.height, np.sqrt(3) / 8, rtol=1e-6)
    np.testing.assert_allclose(found.normal, [[np.cos(np.pi / 6), 0.5, 0]], atol=1e-6)


def test_light_that_grazes_the_face_or_the_rounded_surface_starts_above():
    """As in Cycles: a cosine of 0.05 to the face lifts by half of the height; where that to the shading normal is below
    0.1, too, both count, so that 0.08 and 0.09 lift by 0.3 of it; steeper light starts where it is."""
    steep, both = np.sqrt(1 - 0.05**2), 0.09
    true = np.tile(np.float32([0, 0, 1]), (1, 3, 1))
    normal = np.float32([[[1, 0, 0], [0, 1, 0], [0, 0, 1]]])
    shade = Shade(true, normal, np.ones((1, 3), np.float32), None, np.full((1, 3), 2, np.float32)).together()
    way = np.array([[steep, 0, 0.05], [np.sqrt(1 - 0.08**2 - both**2), both, 0.08], [0.6, 0, 0.8]], np.float32)
    found = shade.lifted(np.zeros((3, 3), np.float32), 7 * way)
    np.testing.assert_allclose(found, [[1, 0, 0], [0, 0.6, 0], [0, 0, 0]], atol=1e-5)


def test_hollow_faces_are_not_raised():
    vertices, triangles, normals = column(6)
    part = face_receivers(vertices, triangles[:, ::-1], np.arange(12), 0.1)
    assert (shading_of(part, vertices, triangles[:, ::-1], 0, -normals[:, ::-1]).height == 0).all()


def test_normals_that_face_away_or_are_missing_are_the_faces_own():
    told = np.array([(0, 0, 0), (0, 0.6, -0.8), (0, 0.6, 0.8), (0, 0, 1)], np.float32)
    part = face_receivers(FLOOR, FLOOR_TRIANGLES, np.arange(2), 1.0, least=1)
    part = concatenate([part, part])
    shading = Shading(told, None, np.ones(4, np.float32))
    geometry = build_geometry(FLOOR, FLOOR_TRIANGLES)
    found = build_footprints(geometry, Receivers(**{**vars(part), "shading": shading})).shading
    np.testing.assert_allclose(found.normal, [(0, 0, 1), (0, 0, 1), (0, 0.6, 0.8), (0, 0, 1)])
    assert found.turned.tolist() == [False, False, True, False]
    np.testing.assert_allclose(found.height, [0, 0, 1, 0])  # the scene is one unit across


def test_shading_is_joined_and_cut_with_the_receivers():
    plain = face_receivers(FLOOR, FLOOR_TRIANGLES, np.arange(2), 1 / 32)
    turned = floor_receivers(30)
    whole = concatenate([plain, turned])
    assert concatenate([plain, plain]).shading is None
    assert (whole.shading.normal[: plain.count] == 0).all()
    part = slice_receivers(whole, plain.count, whole.count)
    np.testing.assert_array_equal(part.shading.normal, turned.shading.normal)


def test_maps_part_neighbors_and_smooth_edges_do_not():
    """Rows of texels of 1: over an edge of 20°, tan 10° = 0.18 of the distance off the
    middle of its neighbors, only where faces are shaded smooth; never where normals differ by 20°,
    of which the two on both sides have the mean cosine 0.94 < 0.99."""
    x = np.arange(-4, 5)
    edge = np.column_stack([x * np.where(x > 0, np.cos(0.35), 1), 0 * x,
                            np.where(x > 0, -x * np.sin(0.35), 0)])  # fmt: skip
    rows = np.repeat(edge[None], 3, axis=0) + np.arange(3)[:, None, None] * [0, 1, 0]
    position = rows.reshape(-1, 3)
    cells = np.indices((3, 9)).reshape(2, -1).T
    grid = np.column_stack([np.zeros(27, int), cells])
    up = np.tile([0.0, 0, 1], (27, 1))

    def pairs(normal, rounded):
        [lattice] = build_lattices(grid, position, normal, levels=1, rounded=rounded)
        return lattice.weights[0][0][1] > 0  # along the middle row

    everywhere = [False, *[True] * 7, False]
    assert pairs(up, np.ones(27, bool)).tolist() == everywhere
    assert not pairs(up, None)[4]
    bumpy = up.copy()
    bumpy[cells[:, 1] % 2 == 0] = [np.sin(0.35), 0, np.cos(0.35)]
    assert not pairs(bumpy, np.ones(27, bool)).any()
