"""The exact solutions against quadrature that knows nothing of them."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from verification import exact


def gauss(n):
    """Nodes and weights on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    return (nodes + 1) / 2, weights / 2


def parallel_by_quadrature(a, b, c, n=48):
    """F = 1/ab ∫∫∫∫ c² / (π (dx² + dy² + c²)²): in the differences dx, dy with weight a − |dx|."""
    x, w = gauss(n)
    dx, dy = a * x[:, None], b * x[None, :]
    kernel = c**2 / (np.pi * (dx**2 + dy**2 + c**2) ** 2)
    weight = (a - dx) * (b - dy) * (w[:, None] * a) * (w[None, :] * b)
    return 4 * np.sum(kernel * weight) / (a * b)


@pytest.mark.parametrize("a, b, c", [(1, 1, 1), (1, 2, 3), (2, 0.5, 1)])
def test_parallel_rectangles(a, b, c):
    expected = parallel_by_quadrature(a, b, c)
    assert exact.parallel_rectangles(a, b, c) == pytest.approx(expected, rel=1e-10)


def test_perpendicular_rectangles():
    """Mean of Lambert's formula over the floor, midpoint rule with h = 1/60."""
    a, b, c = 2.0, 3.0, 1.0
    wall = np.array([[0, 0, 0], [0, 1, 0], [0, 1, b], [0, 0, b]])
    u, v = np.meshgrid((np.arange(120) + 0.5) / 60, (np.arange(60) + 0.5) / 60)
    points = np.column_stack([u.ravel(), v.ravel(), 0 * u.ravel()])
    mean = exact.point_to_polygon(points, np.array([0, 0, 1.0]), wall).mean()
    assert exact.perpendicular_rectangles(a, b, c) == pytest.approx(mean, rel=2e-5)


def test_cube():
    assert exact.parallel_rectangles(1, 1, 1) == pytest.approx(exact.CUBE_OPPOSITE, abs=1e-14)
    assert exact.perpendicular_rectangles(1, 1, 1) == pytest.approx(exact.CUBE_ADJACENT, abs=1e-14)
    assert exact.CUBE_OPPOSITE + 4 * exact.CUBE_ADJACENT == pytest.approx(1, abs=1e-14)


def test_box_of_1_by_2_by_3():
    box = exact.BOX_123
    assert exact.parallel_rectangles(1, 2, 3) == pytest.approx(box["top"], abs=1e-10)
    # an edge of length 1 has the floor's 2 across it, and the other way round
    assert exact.perpendicular_rectangles(2, 3, 1) == pytest.approx(box["edge1"], abs=1e-10)
    assert exact.perpendicular_rectangles(1, 3, 2) == pytest.approx(box["edge2"], abs=1e-10)
    assert box["top"] + 2 * box["edge1"] + 2 * box["edge2"] == pytest.approx(1, abs=2e-10)


def test_slab():
    """1 × 100 plates 0.01 apart; as plates of infinite length: √(1 + 1e-4) − 0.01 = 0.99005."""
    assert exact.parallel_rectangles(1, 100, 0.01) == pytest.approx(0.9899535671, abs=1e-10)


@pytest.mark.parametrize("r1, r2, h", [(1, 1, 1), (0.5, 2, 1), (2, 1, 3)])
def test_coaxial_disks(r1, r2, h):
    """Point to disk in closed form (Howell 1982, B-16), the mean over the first by quadrature."""

    def point(r):
        z = 1 + (h / r) ** 2 + (r2 / r) ** 2
        return 0.5 * (1 - (1 + (h / r) ** 2 - (r2 / r) ** 2) / np.sqrt(z * z - 4 * (r2 / r) ** 2))

    mean = quad(lambda r: point(r) * 2 * r / r1**2, 1e-9, r1)[0]
    assert exact.coaxial_disks(r1, r2, h) == pytest.approx(mean, rel=1e-7)


@pytest.mark.parametrize("degrees", [0.1, 30, 90, 150, 179.9])
def test_wedge(degrees):
    """A strip seen from x on the other, both in a plane: F(x) = (1 − sin φ)/2 with φ the elevation
    of the far edge above the strip's normal; ends at x = (cos α, sin α) of the far edge."""
    alpha = np.radians(degrees)

    def point(x):  # from (x, 0) with normal (0, 1) to the strip from (0, 0) to (cos α, sin α)
        far = np.array([np.cos(alpha) - x, np.sin(alpha)])
        return 0.5 * (far[0] / np.hypot(*far) + 1)

    mean = quad(point, 0, 1, points=[min(np.cos(alpha), 1) if alpha < np.pi / 2 else 0.5])[0]
    assert exact.wedge(alpha) == pytest.approx(mean, abs=1e-9)


def test_point_to_polygon():
    """A unit square straight above, off center, by two-dimensional quadrature."""
    square = np.array([[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
    point, normal = np.array([0.3, -0.4, 0.0]), np.array([0.0, 0.0, 1.0])
    kernel = lambda y, x: 1 / (np.pi * ((x - 0.3) ** 2 + (y + 0.4) ** 2 + 1) ** 2)  # noqa: E731
    expected = dblquad(kernel, 0, 1, 0, 1)[0]
    assert exact.point_to_polygon(point, normal, square) == pytest.approx(expected, abs=1e-10)
    assert exact.point_to_polygon(point, normal, square[::-1]) == pytest.approx(expected, abs=1e-10)


def test_sphere_interior():
    """From the pole of the unit sphere to a cap of half-angle 1 around the other pole:
    ∫ cosθ cosθ' / (π r²) dA with r = 2 cosθ is 1/4π times the cap's area 2π (1 − cos 1)."""
    area = 2 * np.pi * (1 - np.cos(1.0))

    def ring(t):  # t from the far pole; chord r = 2 cos(t/2), both cosines cos(t/2)
        r, cosine = 2 * np.cos(t / 2), np.cos(t / 2)
        return cosine**2 / (np.pi * r**2) * 2 * np.pi * np.sin(t)

    assert exact.sphere_interior(area, 1.0) == pytest.approx(quad(ring, 0, 1)[0], rel=1e-12)


def test_concentric_spheres():
    """F21 is what an outer point sees: the inner sphere fills a cone of sine r1/r2, and the
    cosine-weighted share of a cone around the normal is sin²."""
    f12, f21, f22 = exact.concentric_spheres(1.0, 2.5)
    cone = np.arcsin(1 / 2.5)
    share = quad(lambda t: 2 * np.cos(t) * np.sin(t), 0, cone)[0]
    assert f21 == pytest.approx(share, rel=1e-12)
    assert f12 == 1.0 and f21 + f22 == pytest.approx(1.0)
    b1, b2 = exact.concentric_radiosity(1.0, 2.5, (0.4, 0.4), (0.6, 0.6))
    assert b1 == pytest.approx(exact.furnace(0.4, 0.6)) == pytest.approx(b2)


def test_closed_sphere_solves_its_equation():
    random = np.random.default_rng(0)
    q, rho, area = random.uniform(0, 1, (3, 7))
    b = exact.closed_sphere(q, rho, area)
    np.testing.assert_allclose(b, q + rho * np.sum(b * area) / np.sum(area), rtol=1e-12)


def test_infinite_plates_by_summed_bounces():
    q1, q2, rho1, rho2 = 1.0, 0.3, 0.8, 0.6
    b1, b2 = 0.0, 0.0
    for _ in range(200):  # (0.8 · 0.6)^100 is below rounding
        b1, b2 = q1 + rho1 * b2, q2 + rho2 * b1
    assert exact.infinite_plates(q1, q2, rho1, rho2) == pytest.approx(b1, rel=1e-14)


@pytest.mark.parametrize("rho", exact.STRIPS)
def test_facing_strips(rho):
    np.testing.assert_allclose(exact.facing_strips(rho), exact.STRIPS[rho], atol=2e-12)
    np.testing.assert_allclose(exact.facing_strips(rho, 24), exact.STRIPS[rho], atol=2e-12)


def test_strip_kernel_is_the_infinitely_long_strip():
    """∫ 1/(π (d² + 1 + z²)²) dz over the length, d across: 1 / (2 (1 + d²)^1.5)."""
    d = 0.7
    along = quad(lambda z: 1 / (np.pi * (d**2 + 1 + z**2) ** 2), -np.inf, np.inf)[0]
    assert along == pytest.approx(1 / (2 * (1 + d**2) ** 1.5), rel=1e-10)


def test_manufactured_cube_in_the_mean():
    """The mean of E over a face is B_i − rho_i Σ F_ij B_j with the cube's form factors."""
    from verification.meshes import box_polygons

    faces, normals = box_polygons((1, 1, 1))
    radiosity = np.array([1.0, 2.0, 0.5, 0.7, 1.5, 3.0])
    rho = np.array([0.5, 0.1, 0.9, 0.3, 0.2, 0.7])
    x, w = gauss(16)
    for f in range(6):
        origin, u, v = faces[f][0], faces[f][1] - faces[f][0], faces[f][3] - faces[f][0]
        points = (origin + x[:, None, None] * u + x[None, :, None] * v).reshape(-1, 3)
        own = np.full(len(points), f)
        emission = exact.manufactured_emission(
            points, normals[own], own, radiosity, rho, faces
        )
        opposite = f ^ 1
        factors = np.full(6, exact.CUBE_ADJACENT)
        factors[[f, opposite]] = 0.0, exact.CUBE_OPPOSITE
        expected = radiosity[f] - rho[f] * factors @ radiosity
        assert np.outer(w, w).ravel() @ emission == pytest.approx(expected, abs=2e-5)
