"""Spherical triangles: directions to a polygon that are uniform in its solid angle.

Solid angles by Van Oosterom and Strackee 1983, "The Solid Angle of a Plane Triangle"; directions by
Arvo 1995, "Stratified Sampling of Spherical Triangles".
"""

from __future__ import annotations

import numpy as np

from .vectors import cross, dot, lengths


def uniform_toward(rays: list, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) solid angles of convex polygons, and (3, n) unit directions to them, uniform in there,
    from ``xi`` (2, n) in [0, 1). ``rays`` (3, n) run to their corners, in order."""
    corners = [ray / lengths(ray) for ray in rays]
    fan = list(zip(corners[1:], corners[2:]))
    angles = np.stack([_solid_angle(corners[0], b, c) for b, c in fan])
    total = angles.sum(axis=0)
    target = xi[0] * total
    b, c = (np.array(corner) for corner in fan[0])
    angle, before = angles[0].copy(), np.zeros(len(total))
    reached = angles[0].copy()
    for mine, (second, third) in zip(angles[1:], fan[1:]):
        later = (target >= reached) & (mine > 0)
        np.copyto(before, reached, where=later)
        np.copyto(angle, mine, where=later)
        np.copyto(b, second, where=later)
        np.copyto(c, third, where=later)
        reached += mine
    return total, _toward(corners[0], b, c, np.clip(target - before, 0, angle), xi[1])


def _solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(n,) of the triangles between unit vectors (3, n)."""
    volume = np.abs(dot(a, cross(b, c)))
    return 2 * np.arctan2(volume, 1 + dot(a, b) + dot(b, c) + dot(c, a))


def _toward(
    a: np.ndarray, b: np.ndarray, c: np.ndarray, part: np.ndarray, xi: np.ndarray
) -> np.ndarray:
    """(3, n) directions in spherical triangles: the triangle a, b, d, with d on the side from a to
    c, has the solid angle ``part`` (n,); on the arc from b to d the place follows from ``xi`` (n,)."""
    along, across = _axes(a, c)
    _, planar = _axes(a, b)
    cosine = np.clip(dot(planar, across), -1, 1)  # of the angle at a
    sine = np.sqrt(1 - cosine * cosine)
    swept_sine, swept_cosine = np.sin(part), np.cos(part)
    s = swept_sine * cosine - swept_cosine * sine
    t = swept_cosine * cosine + swept_sine * sine
    u, v = t - cosine, s + sine * dot(a, b)
    below = (v * s + u * t) * sine
    above = (v * t - u * s) * cosine - v
    fits = below != 0
    q = np.clip(np.where(fits, above, 1) / np.where(fits, below, 1), -1, 1)
    d = q * along + np.sqrt(1 - q * q) * across
    start, toward = _axes(b, d)
    z = 1 - xi * (1 - dot(d, b))
    return z * start + np.sqrt(np.maximum(1 - z * z, 0)) * toward


def _axes(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``a`` (3, n), unit, and the unit vector across it toward ``b`` (3, n)."""
    across = b - dot(a, b) * a
    return a, across / lengths(across)
