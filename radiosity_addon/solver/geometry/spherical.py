"""Spherical triangles: directions uniform in the solid angle under which a triangle is seen.

A light near by, sampled by its area, would bring a few very bright samples;
sampled by its solid angle each brings the same (Arvo 1995, "Stratified Sampling of Spherical
Triangles").
"""

from __future__ import annotations

import numpy as np

from .vectors import cross, dot


def solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(n,) steradians between unit vectors (3, n) (van Oosterom & Strackee 1983, eq. 8)."""
    return 2 * np.arctan2(np.abs(dot(a, cross(b, c))), 1 + dot(a, b) + dot(b, c) + dot(c, a))


def direction_within(a, b, c, angle: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(3, n) unit directions, uniform in the triangles of unit corners (3, n) and solid ``angle``
    (n,), from ``xi`` (n, 2) in [0, 1)."""
    alpha = _dihedral(a, b, c)
    cos_c = dot(a, b)
    part = xi[:, 0] * angle - alpha
    s, t = np.sin(part), np.cos(part)
    u = t - np.cos(alpha)
    v = s + np.sin(alpha) * cos_c
    below = (v * s + u * t) * np.sin(alpha)
    q = ((v * t - u * s) * np.cos(alpha) - v) / np.where(below == 0, 1, below)
    corner = _combined(np.clip(q, -1, 1), a, _perpendicular(c, a))
    z = 1 - xi[:, 1] * (1 - dot(corner, b))
    return _combined(np.clip(z, -1, 1), b, _perpendicular(corner, b))


def _dihedral(a, b, c) -> np.ndarray:
    """(n,) the angle at a between the arcs to b and c."""
    p, q = _perpendicular(b, a), _perpendicular(c, a)
    across = cross(p, q)
    return np.arctan2(np.sqrt(dot(across, across)), dot(p, q))


def _perpendicular(vector, axis) -> np.ndarray:
    """(3, n) unit: the part of ``vector`` across the unit ``axis``."""
    across = vector - dot(vector, axis) * axis
    length = np.sqrt(dot(across, across))
    return across / np.where(length > 0, length, 1)


def _combined(cosine, axis, across) -> np.ndarray:
    """(3, n) unit, at the angle of this cosine from ``axis`` toward ``across``."""
    return cosine * axis + np.sqrt(np.maximum(1 - cosine**2, 0)) * across
