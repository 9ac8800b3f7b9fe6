"""Spherical triangles: directions uniform in the solid angle under which a triangle is seen.

Depends on NumPy. A light near by, sampled by its area, would bring a few very bright samples;
sampled by its solid angle each brings the same (Arvo 1995, "Stratified Sampling of Spherical
Triangles").
"""

from __future__ import annotations

import numpy as np


def solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(n,) steradians between unit vectors (n, 3) (van Oosterom & Strackee 1983, eq. 8)."""
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    ab, bc, ca = (np.einsum("ij,ij->i", p, q) for p, q in ((a, b), (b, c), (c, a)))
    return 2 * np.arctan2(volume, 1 + ab + bc + ca)


def direction_within(a, b, c, angle: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(n, 3) unit directions, uniform in the triangles of unit corners (n, 3) and solid ``angle``
    (n,), from ``xi`` (n, 2) in [0, 1)."""
    alpha = _dihedral(a, b, c)
    cos_c = np.einsum("ij,ij->i", a, b)
    part = xi[:, 0] * angle - alpha
    s, t = np.sin(part), np.cos(part)
    u = t - np.cos(alpha)
    v = s + np.sin(alpha) * cos_c
    below = (v * s + u * t) * np.sin(alpha)
    q = ((v * t - u * s) * np.cos(alpha) - v) / np.where(below == 0, 1, below)
    corner = _combined(np.clip(q, -1, 1), a, _perpendicular(c, a))
    z = 1 - xi[:, 1] * (1 - np.einsum("ij,ij->i", corner, b))
    return _combined(np.clip(z, -1, 1), b, _perpendicular(corner, b))


def _dihedral(a, b, c) -> np.ndarray:
    """(n,) the angle at a between the arcs to b and c."""
    p, q = _perpendicular(b, a), _perpendicular(c, a)
    return np.arctan2(np.linalg.norm(np.cross(p, q), axis=1), np.einsum("ij,ij->i", p, q))


def _perpendicular(vector, axis) -> np.ndarray:
    """(n, 3) unit: the part of ``vector`` across the unit ``axis``."""
    across = vector - np.einsum("ij,ij->i", vector, axis)[:, None] * axis
    length = np.linalg.norm(across, axis=1)
    return across / np.where(length > 0, length, 1)[:, None]


def _combined(cosine, axis, across) -> np.ndarray:
    """(n, 3) unit, at the angle of this cosine from ``axis`` toward ``across``."""
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    return cosine[:, None] * axis + sine[:, None] * across
