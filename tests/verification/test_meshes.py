"""The test scenes are what they claim: closed, oriented, of the right area and volume."""

import numpy as np
import pytest

from verification import exact, meshes


def volume(vertices, triangles):
    """∫ x·n/3 dA: negative where the fronts face inwards."""
    return np.linalg.det(vertices[triangles]).sum() / 6


def welded(vertices, triangles):
    """Triangles over vertices merged where they coincide."""
    _, index = np.unique(np.round(vertices, 9), axis=0, return_inverse=True)
    return index.reshape(-1)[triangles]


def is_closed(vertices, triangles):
    """Every edge is used once in either direction."""
    welds = welded(vertices, triangles)
    edges = welds[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forward = {tuple(edge) for edge in edges}
    return len(forward) == len(edges) and all((b, a) in forward for a, b in forward)


@pytest.mark.parametrize("divisions", [1, 3])
def test_box(divisions):
    scene = meshes.box_scene((1, 2, 3), divisions)
    assert len(scene.triangles) == 12 * divisions**2
    assert is_closed(scene.vertices, scene.triangles)
    assert volume(scene.vertices, scene.triangles) == pytest.approx(-6)  # facing inwards
    face_area = np.bincount(scene.object, meshes.areas(scene.vertices, scene.triangles))
    np.testing.assert_allclose(face_area, [6, 6, 3, 3, 2, 2])


def test_box_normals_point_inwards_and_faces_oppose():
    polygons, normals = meshes.box_polygons((1, 2, 3))
    for f in range(6):
        assert (0.5 * np.array([1, 2, 3]) - polygons[f].mean(axis=0)) @ normals[f] > 0
        np.testing.assert_allclose(normals[f], -normals[f ^ 1])
        edge, other = polygons[f][1] - polygons[f][0], polygons[f][2] - polygons[f][0]
        assert np.cross(edge, other) @ normals[f] > 0


@pytest.mark.parametrize("inward", [False, True])
def test_icosphere_has_the_spheres_area(inward):
    vertices, triangles = meshes.icosphere(2, 1.5, inward)
    assert len(triangles) == 20 * 4**2
    assert is_closed(vertices, triangles)
    assert meshes.areas(vertices, triangles).sum() == pytest.approx(4 * np.pi * 1.5**2)
    assert np.sign(volume(vertices, triangles)) == (-1 if inward else 1)


def test_sphere_scene_is_the_whole_sphere_in_octants():
    scene = meshes.sphere_scene(2, exitance=np.arange(8.0)[:, None])
    assert is_closed(scene.vertices, scene.triangles)
    octant = np.bincount(scene.object, meshes.areas(scene.vertices, scene.triangles))
    assert octant.sum() == pytest.approx(4 * np.pi)
    np.testing.assert_allclose([m.emission.value[0] * np.pi for m in scene.materials], range(8))


def test_disk_has_the_disks_area_and_faces():
    for up in (True, False):
        vertices, triangles = meshes.disk(2.0, 0.5, up)
        assert meshes.areas(vertices, triangles).sum() == pytest.approx(4 * np.pi)
        a, b, c = vertices[triangles[0]]
        assert (np.cross(b - a, c - a)[2] > 0) == up


def test_blob_is_closed_bumpy_and_within_the_box():
    vertices, triangles = meshes.blob(4)
    assert is_closed(vertices, triangles) and volume(vertices, triangles) > 0
    assert vertices.min() > 0.05 and vertices.max() < 0.95
    from scipy.spatial import ConvexHull

    # dents: it fills less of its hull than a convex body of as many triangles would (0.99)
    assert volume(vertices, triangles) < 0.9 * ConvexHull(vertices).volume


def test_furnace_scene_emits_what_it_absorbs():
    scene = meshes.furnace_scene(0.9, level=2)
    assert len(scene.triangles) == 12 + 320
    for material in scene.materials:
        np.testing.assert_allclose(material.emission.value * np.pi, 0.1)
        np.testing.assert_allclose(material.reflectance.value, 0.9)


def test_strips_and_wedge_face_each_other():
    for scene in (meshes.strips_scene(0.5, 10.0), meshes.wedge_scene(np.pi / 3, 10.0)):
        a, b, c = (scene.vertices[scene.triangles[:, k]] for k in range(3))
        normal, middle = np.cross(b - a, c - a), (a + b + c) / 3
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1) / 2, 5.0)
        assert ((middle[[2, 3, 0, 1]] - middle) * normal).sum(axis=1).min() > 0


def test_strips_are_long_enough_to_be_infinite():
    """What a strip of length 200 loses to one without end: 1 − F/(√2 − 1), below half a percent at
    the ends and far less in the middle."""
    infinite = np.sqrt(2) - 1
    assert exact.parallel_rectangles(1, 200, 1) == pytest.approx(infinite, rel=0.005)


def test_disks_face_each_other():
    scene = meshes.disks_scene(1.0, 2.0, 0.5)
    areas = np.bincount(scene.object, meshes.areas(scene.vertices, scene.triangles))
    np.testing.assert_allclose(areas, [np.pi, 4 * np.pi])


def test_concentric_scene_between_the_spheres():
    scene = meshes.concentric_scene(2, 1.0, 2.0, (0.5, 0.6), (0.5, 0.4))
    inner = scene.triangles[scene.object == 0]
    outer = scene.triangles[scene.object == 1]
    assert volume(scene.vertices, inner) > 0 > volume(scene.vertices, outer)
    assert scene.materials[1].reflectance.value[2] == 0.6


def test_manufactured_cube_has_the_cubes_balance():
    """The area mean of E over each face is B_i − rho_i Σ F_ij B_j; linear between corners of
    1/16 that errs by some h² = 0.4 %."""
    radiosity = np.array([1.0, 2.0, 0.5, 0.7, 1.5, 3.0])
    rho = np.array([0.5, 0.1, 0.9, 0.3, 0.2, 0.4])
    scene = meshes.manufactured_cube(radiosity, rho)
    weights = meshes.areas(scene.vertices, scene.triangles)
    for f in range(6):
        mine = scene.object == f
        values = scene.materials[f].emission.values[mine].mean(axis=1)[:, 0] * np.pi
        factors = np.full(6, exact.CUBE_ADJACENT)
        factors[[f, f ^ 1]] = 0.0, exact.CUBE_OPPOSITE
        expected = radiosity[f] - rho[f] * factors @ radiosity
        assert weights[mine] @ values == pytest.approx(expected, abs=0.004 * radiosity.max())
