"""Cones: round lights, sampled by the cosine law of the point that they light.

A sphere is seen under a cone of directions, and so is a disk that faces the point. Projected along
its axis the cone becomes a disk of radius sinσ: with (ρ cosφ, ρ sinφ) in there, dω = ρ dρ dφ / cosα,
ρ = sinα, and the receiver's cosine over cosα is cosθ + sinθ tanα cosφ. Over a circle its mean is cosθ.
So ρ² is uniform, and φ has a density ∝ 1 + e cosφ, e = tanθ tanα: its distribution is inverted by
solving Kepler's equation.
"""

from __future__ import annotations

import numpy as np

from ..geometry.vectors import cross, lengths, tangents

STEPS = 5  # number [iterations] of Newton's method: solves Kepler's equation to 1e-6


def cone_directions(
    axis: np.ndarray, normal: np.ndarray, slope: np.ndarray, square: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(3, n) unit directions in cones about unit ``axis`` (3, n) of half angles σ, ``square`` (n,)
    sin²σ, from ``xi`` (2, n) in [0, 1); and (n,) irradiance over density at ``normal`` (3, n), per
    π sin²σ of radiance 1: where the whole cone is above the horizon, the ``slope`` (n,) of its
    axis, the cosine with the normal, for every sample."""
    across = normal - slope * axis
    length = lengths(across)
    one = np.where(length > 1e-9, across / length, tangents(axis)[0])
    other = cross(axis, one)
    radius = np.sqrt(square * xi[0])
    cosine = np.sqrt(np.maximum(1 - square * xi[0], 1e-30))
    swing = length * radius / cosine
    part = np.where(slope > swing, swing / np.where(slope > swing, slope, 1), 1.0)
    azimuth = eccentric_azimuth(part, xi[1])
    x, y = radius * np.cos(azimuth), radius * np.sin(azimuth)
    facing = np.maximum(slope + swing * np.cos(azimuth), 0)
    ratio = np.where(slope > swing, slope, facing / np.maximum(1 + np.cos(azimuth), 1e-30))
    return cosine * axis + x * one + y * other, ratio


def eccentric_azimuth(eccentricity: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(n,) angles in [−π, π) of density (1 + e cosφ) / 2π, from ``xi`` (n,) in [0, 1).

    With φ = π − E it is Kepler's equation E − e sinE = M, M = π (1 − 2 ξ) + π wrapped to [−π, π);
    start and steps of Danby (1988, "Fundamentals of Celestial Mechanics", section 6.6).
    """
    mean = np.pi * (2 * xi - 1)
    found = mean + 0.85 * eccentricity * np.sign(mean)
    for _ in range(STEPS):
        sine, cosine = eccentricity * np.sin(found), eccentricity * np.cos(found)
        error, slope = found - sine - mean, np.maximum(1 - cosine, 1e-12)
        step = -error / slope
        step = -error / np.maximum(slope + 0.5 * step * sine, 1e-12)
        found = found + np.clip(step, -1, 1)
    return np.pi - found


def sphere_form_factor(cosine: np.ndarray, sine_square: np.ndarray) -> np.ndarray:
    """(n,) share of the hemisphere's cosine-weighted directions that meet a sphere seen under a
    half angle σ, sin²σ in (0, 1], whose center lies at ``cosine`` from the normal; horizon clipped
    (Snyder 1996, "Area light sources for real-time graphics", in the form of Lagarde & de
    Rousiers 2014, eq. 25)."""
    cut = cosine**2 < sine_square
    result = np.where(cut, 0.0, sine_square * np.maximum(cosine, 0))
    c, s2 = cosine[cut], sine_square[cut]
    sine = np.sqrt(np.maximum(1 - c * c, 1e-30))
    x = np.sqrt(np.maximum(1 / s2 - 1, 0))
    y = np.clip(-x * c / sine, -1, 1)
    w = sine * np.sqrt(1 - y * y)
    result[cut] = ((c * np.arccos(y) - x * w) * s2 + np.arctan2(w, x)) / np.pi
    return np.maximum(result, 0)
