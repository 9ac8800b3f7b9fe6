"""Exact solutions: what the solver is judged against. Each verified by independent quadrature.

Form factors F are from the first surface named to the second. Lengths in any unit; q is the
exitance emitted and B the radiosity, both [W/m²]; rho the reflectance.
"""

from __future__ import annotations

import numpy as np

CUBE_OPPOSITE = 0.199824895698387
CUBE_ADJACENT = 0.200043776075403

# A box 1 × 2 × 3 (x, y, z) seen from its floor 1 × 2: the top, each wall standing on an edge of
# length 1, each standing on an edge of length 2.
BOX_123 = {"top": 0.0603313854, "edge1": 0.1616940143, "edge2": 0.3081402930}

# Sparrow's facing strips of width 1 and gap 1, infinitely long, emitting q = 1: B in the middle, at
# the edge and in the mean (Sparrow 1960 gives the equation; values by Nyström to 12 digits).
STRIPS = {
    0.5: (1.282483765254, 1.223055443892, 1.261528754200),
    0.9: (1.644038662684, 1.508054914016, 1.596059842672),
    0.99: (1.753635030578, 1.594380633196, 1.697437877680),
}


def parallel_rectangles(a: float, b: float, c: float) -> float:
    """Equal, directly opposed rectangles a × b at distance c (Howell 1982, C-11)."""
    x, y = a / c, b / c
    u, v = np.sqrt(1 + x * x), np.sqrt(1 + y * y)
    total = np.log(u * v / np.sqrt(1 + x * x + y * y))
    total += x * v * np.arctan(x / v) + y * u * np.arctan(y / u)
    total -= x * np.arctan(x) + y * np.arctan(y)
    return 2 / (np.pi * x * y) * total


def perpendicular_rectangles(a: float, b: float, c: float) -> float:
    """From c × a to c × b standing on it, common edge of length c (Howell 1982, C-14)."""
    w, h = a / c, b / c
    r = np.hypot(w, h)
    total = w * np.arctan(1 / w) + h * np.arctan(1 / h) - r * np.arctan(1 / r)
    w2, h2 = w * w, h * h
    s = 1 + w2 + h2
    total += 0.25 * np.log((1 + w2) * (1 + h2) / s)
    total += 0.25 * w2 * np.log(w2 * s / ((1 + w2) * (w2 + h2)))
    total += 0.25 * h2 * np.log(h2 * s / ((1 + h2) * (w2 + h2)))
    return total / (np.pi * w)


def coaxial_disks(r1: float, r2: float, h: float) -> float:
    """From the disk of radius r1 to that of radius r2 at distance h (Howell 1982, C-41)."""
    s = 1 + (1 + (r2 / h) ** 2) / (r1 / h) ** 2
    return 0.5 * (s - np.sqrt(s * s - 4 * (r2 / r1) ** 2))


def wedge(angle: float) -> float:
    """Two infinitely long strips of equal width that share an edge under ``angle`` [rad]
    (crossed strings, Hottel and Sarofim 1967)."""
    return 1 - np.sin(angle / 2)


def point_to_polygon(points, normals, polygon) -> np.ndarray:
    """From points (..., 3) with unit normals to a flat polygon (k, 3) wholly above their horizons
    (Lambert 1760): 1/2π Σ Γₖ·n. The sign tells which way the polygon turns; it is dropped."""
    ray = np.asarray(polygon, float) - np.asarray(points, float)[..., None, :]
    after = np.roll(ray, -1, axis=-2)
    cross = np.cross(ray, after)
    sine = np.linalg.norm(cross, axis=-1)
    angle = np.arctan2(sine, np.sum(ray * after, axis=-1))
    gamma = cross * (angle / np.where(sine > 0, sine, 1.0))[..., None]
    return np.abs(np.sum(gamma.sum(axis=-2) * normals, axis=-1)) / (2 * np.pi)


def sphere_interior(area: float, radius: float) -> float:
    """From anywhere inside a sphere to a part of it of that area: cosθ/|x−z| is 1/2R throughout."""
    return area / (4 * np.pi * radius**2)


def concentric_spheres(r1: float, r2: float) -> tuple[float, float, float]:
    """F12, F21, F22 of the inner sphere (1) in the outer (2): the inner is convex, reciprocity."""
    ratio = (r1 / r2) ** 2
    return 1.0, ratio, 1 - ratio


def concentric_radiosity(r1: float, r2: float, q, rho) -> tuple[float, float]:
    """B of both spheres with q = (q1, q2), rho likewise; constant on each by symmetry."""
    f12, f21, f22 = concentric_spheres(r1, r2)
    matrix = np.array([[1.0, -rho[0] * f12], [-rho[1] * f21, 1 - rho[1] * f22]])
    return tuple(np.linalg.solve(matrix, q))


def closed_sphere(q: np.ndarray, rho: np.ndarray, area: np.ndarray) -> np.ndarray:
    """B on parts of a closed sphere with any q and rho (n,): the irradiance φ is the same
    everywhere, φ = Σ q A / (A_total − Σ rho A) (Sparrow and Cess 1978)."""
    irradiance = np.sum(q * area) / (np.sum(area) - np.sum(rho * area))
    return q + rho * irradiance


def furnace(q: float, rho: float) -> float:
    """Any closed scene with uniform q and rho and any occluders inside: B = q / (1 − rho)."""
    return q / (1 - rho)


def infinite_plates(q1: float, q2: float, rho1: float, rho2: float) -> float:
    """B of the first of two infinite parallel plates."""
    return (q1 + rho1 * q2) / (1 - rho1 * rho2)


def facing_strips(rho: float, n: int = 64) -> tuple[float, float, float]:
    """Mid, edge and mean radiosity of Sparrow's strips, by Nyström's method with n Gauss points:
    B(x) = 1 + rho ∫ B(y) / (2 (1 + (x−y)²)^1.5) dy on [−½, ½]. Smooth kernel, so n = 64 is exact
    to rounding."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    y, w = nodes / 2, weights / 2

    def transport(x):
        return rho * w / (2 * (1 + (np.asarray(x)[:, None] - y) ** 2) ** 1.5)

    b = np.linalg.solve(np.eye(n) - transport(y), np.ones(n))
    middle, edge = 1 + transport([0.0, 0.5]) @ b
    return middle, edge, float(w @ b)


def manufactured_emission(points, normals, own, radiosity, rho, faces) -> np.ndarray:
    """E (n,) that makes the radiosity of a convex closed polyhedron constant on each face.

    E(x) = B(x) − rho Σ_f B_f F(x→f) with Lambert's formula: ``faces`` are polygons (k, 3), ``own``
    (n,) the face each point lies on, which does not see itself; ``radiosity`` and ``rho`` are
    (n_faces,). Piecewise constants then represent the exact solution. Points must not lie on
    other faces.
    """
    emission = radiosity[own].astype(float)
    for f, polygon in enumerate(faces):
        other = np.flatnonzero(own != f)
        factor = point_to_polygon(points[other], normals[other], polygon)
        emission[other] -= rho[own[other]] * radiosity[f] * factor
    return emission
