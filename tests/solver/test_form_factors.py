"""Form factors between patches: closed forms within the reported standard error, and 0.1 %.

A closed form lies within 4 standard errors of 8 replicates with probability 0.995 (Student's t, 7
degrees of freedom); seeds are fixed, so a test either passes for ever or never.
"""

import numpy as np
import pytest

from radiosity_addon.solver.transport.form_factors import patch_form_factors
from verification import exact, meshes

RAYS = 1 << 15
HIGHEST = 1 << 17  # with 8 replicates: a million rays from every patch


def check(scene, wanted, rays=RAYS, errors=4.0, relative=None):
    """``wanted``: {(i, j): F}. Within ``errors`` standard errors, and ``relative`` where given."""
    found, error = patch_form_factors(scene, scene.object, rays)
    assert (found >= 0).all() and (found.sum(axis=1) <= 1 + 1e-12).all()
    for place, value in wanted.items():
        assert abs(found[place] - value) <= errors * error[place] + 1e-12, place
        if relative is not None:
            assert found[place] == pytest.approx(value, rel=relative)
    return found


def two_rectangles(gap):
    """1 × 2, directly opposed."""
    low = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], float)
    return meshes.scene([meshes.grid(low, 1), meshes.grid(low[[0, 3, 2, 1]] + [0, 0, gap], 1)])


def wedge_of_length(angle, length, panels=24, order=8):
    """F of a wedge of strips 1 wide and ``length`` long: the mean of Lambert's point-to-polygon
    formula over one strip, by Gauss's rule on panels that halve toward the edges."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    edges = np.concatenate([[0.0], 0.5 ** np.arange(panels, 0, -1)])
    width = np.diff(edges)[:, None]
    half = (edges[:-1, None] + width * (nodes + 1) / 2).ravel()  # of [0, 1/2], by symmetry of y
    weight = (width * weights / 2).ravel()
    x = np.concatenate([half, 1 - half])  # both ends: the common edge, and the far one
    wx, y = np.concatenate([weight, weight]), half * length
    points = np.stack(np.broadcast_arrays(x[:, None], y[None, :], 0.0), -1)
    far = np.array([np.cos(angle), 0, np.sin(angle)])
    wall = np.array([[0, 0, 0], far, far + [0, length, 0], [0, length, 0]])
    factor = exact.point_to_polygon(points, np.array([0, 0, 1.0]), wall)
    return float(wx @ factor @ weight * 2)


def prism(angle):
    """A closed prism 1 long: two walls 1 wide that meet under ``angle``, a base and two ends."""
    far = np.array([np.cos(angle), 0, np.sin(angle)])
    a, b, c = np.zeros(3), np.array([1.0, 0, 0]), far
    up = np.array([0, 1.0, 0])
    quads = [(b, b + up, a + up, a), (a + up, c + up, c, a), (c, c + up, b + up, b)]
    parts = [meshes.grid(np.array(quad), 1) for quad in quads]
    ends = [np.array([a, c, b]), np.array([a, b, c]) + up]
    return meshes.scene(parts + [meshes.polygon(end) for end in ends])


def test_prism_is_closed_and_faces_inwards():
    scene = prism(np.radians(60))
    corners = scene.vertices[scene.triangles]
    assert np.linalg.det(corners).sum() / 6 == pytest.approx(-np.sin(np.radians(60)) / 2)


def test_cube():
    wanted = {(i, j): exact.CUBE_OPPOSITE if i ^ 1 == j else exact.CUBE_ADJACENT
              for i in range(6) for j in range(6) if i != j}  # fmt: skip
    found = check(meshes.box_scene(), wanted, errors=5.5)  # 30 numbers: t₇ > 5.5 has p = 0.0009
    assert np.abs(found.sum(axis=1) - 1).max() < 1e-12
    assert not found.diagonal().any()


def test_box():
    wanted = {(4, 5): exact.BOX_123["top"], (4, 0): exact.BOX_123["edge2"],
              (4, 1): exact.BOX_123["edge2"], (4, 2): exact.BOX_123["edge1"]}  # fmt: skip
    found = check(meshes.box_scene((1, 2, 3)), wanted)
    assert np.abs(found.sum(axis=1) - 1).max() < 1e-12
    area = np.array([6, 6, 3, 3, 2, 2.0])
    flow = area[:, None] * found  # reciprocity: A_i F_ij = A_j F_ji
    np.testing.assert_allclose(flow, flow.T, atol=0.01)


def test_highest_setting_is_within_a_thousandth():
    scene = meshes.scene(
        [meshes.grid(corners, 1) for corners in meshes.box_polygons()[0][[0, 2]]]
    )  # two adjacent faces of a cube, open
    check(scene, {(0, 1): exact.CUBE_ADJACENT, (1, 0): exact.CUBE_ADJACENT}, HIGHEST, relative=1e-3)


@pytest.mark.parametrize("gap", [1e-4, 0.01, 0.3, 1.0, 3.0])
def test_parallel_rectangles(gap):
    check(two_rectangles(gap), {(0, 1): exact.parallel_rectangles(1, 2, gap)})


def test_slab():
    """1 × 100 × 0.01: opposite faces 0.9899535671, within 0.1 %."""
    check(meshes.box_scene((1, 100, 0.01)), {(4, 5): 0.9899535671}, relative=1e-3)


@pytest.mark.parametrize("degrees", [30.0, 90.0, 150.0])
def test_wedge_quadrature_meets_crossed_strings(degrees):
    """At length L the ends lose a share of order log(L)/L of the far field; at 1000, 0.1 %."""
    angle = np.radians(degrees)
    assert wedge_of_length(angle, 1000.0) == pytest.approx(exact.wedge(angle), rel=2e-3)


@pytest.mark.parametrize("degrees", [0.1, 1.0, 10.0, 45.0, 90.0, 135.0, 170.0, 179.9])
def test_wedge(degrees):
    """Within 0.1 % of 1, the share of light: of the factor itself where that is large."""
    angle = np.radians(degrees)
    value = wedge_of_length(angle, 2.0)
    found, error = patch_form_factors(meshes.wedge_scene(angle, 2.0), np.array([0, 0, 1, 1]), RAYS)
    assert found[0, 1] == pytest.approx(value, abs=1e-3)
    assert abs(found[0, 1] - value) <= 4 * error[0, 1] + 2e-5  # 2e-5: at 0.1° points are that
    # share of the strip away from the edge


@pytest.mark.parametrize("degrees", [0.1, 1.0, 10.0, 90.0, 170.0, 179.0, 179.9])
def test_closed_wedge_loses_nothing(degrees):
    scene = prism(np.radians(degrees))
    found, _ = patch_form_factors(scene, scene.object, 1 << 12)
    assert np.abs(found.sum(axis=1) - 1).max() < 1e-12


def test_disks():
    big, small = exact.coaxial_disks(1, 0.5, 1), exact.coaxial_disks(0.5, 1, 1)
    check(meshes.disks_scene(1, 0.5, 1), {(0, 1): big, (1, 0): small})


def test_sphere_interior():
    """F_ij = A_j / 4πR² on a sphere; its 5120 flat facets do not see themselves: 1 in 5120."""
    scene = meshes.sphere_scene(4)
    found, error = patch_form_factors(scene, scene.object, RAYS // 4)
    area = np.bincount(scene.object, meshes.areas(scene.vertices, scene.triangles))
    expected = np.tile(area / area.sum(), (8, 1))
    assert (np.abs(found - expected) <= 5.5 * error + 1e-3 * expected).all()


def test_concentric_spheres():
    """Flat facets change a sphere's area and so the ratio by less than 0.1 %."""
    scene = meshes.concentric_scene(4, 1, 2, (0.5, 0.5), (1, 1))
    found, error = patch_form_factors(scene, scene.object, RAYS)
    f12, f21, f22 = exact.concentric_spheres(1, 2)
    assert found[0, 1] == f12
    assert abs(found[1, 0] - f21) <= 4 * error[1, 0] + 1e-3 * f21
    assert abs(found[1, 1] - f22) <= 4 * error[1, 1] + 1e-3 * f22


def test_error_falls_faster_than_plain_sampling():
    """Scrambled Sobol points: slope of the error against rays steeper than Monte Carlo's −1/2."""
    scene = two_rectangles(1.0)
    rays = [1 << k for k in (8, 11, 14, 17)]
    error = [
        np.abs(patch_form_factors(scene, scene.object, n, 16, seed=3)[1][0, 1]) for n in rays
    ]
    slope = np.polyfit(np.log(rays), np.log(error), 1)[0]
    assert slope < -0.55


def test_same_seed_same_bits_whatever_the_threads():
    scene = meshes.box_scene()
    runs = [patch_form_factors(scene, scene.object, 1 << 10, threads=n) for n in (1, 2, 3)]
    for other in runs[1:]:
        np.testing.assert_array_equal(runs[0], other)
    assert (patch_form_factors(scene, scene.object, 1 << 10, seed=1)[0] != runs[0][0]).any()


@pytest.mark.parametrize(
    "patch, rays, replicates, message",
    [
        (np.zeros(3, int), 64, 8, "12 triangles"),
        (np.zeros(12), 64, 8, "one integer for each"),
        (np.full(12, -1), 64, 8, "labels start at 0"),
        (np.full(12, 1), 64, 8, "patch 0 has no area; number the patches without gaps"),
        (np.zeros(12, int), 100, 8, "rays is 100; it must be a power of two"),
        (np.zeros(12, int), 64, 1, "at least 2 are needed"),
    ],
)
def test_bad_input_is_named(patch, rays, replicates, message):
    with pytest.raises(ValueError, match=message):
        patch_form_factors(meshes.box_scene(), patch, rays, replicates)
