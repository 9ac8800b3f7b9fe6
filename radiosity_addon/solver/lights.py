"""Lights: what the kinds of explicitly sampled light have in common.

Depends on ``sampling``. The kinds are ``polygons``, ``spheres`` and ``suns``. A kind holds arrays,
one entry a light. It gives, at points: the irradiance that would arrive without obstacles, and rays
that test whether it does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .sampling import tangent_frames


@dataclass(frozen=True)
class Sample:
    """One sampled place of one light for each of n points.

    ``segment`` (n, 3) float32 runs to it, ``length`` (n,) or one number limits it (inf: a sun).
    Where ``exact``, ``irradiance`` is the whole light's, without noise, and is to be multiplied by
    the visible share of ``weight`` over an owner's points; else it is this sample's alone.
    """

    irradiance: np.ndarray  # (n,) float64, unoccluded, per unit of the light's colour
    weight: np.ndarray  # (n,) float64, the integrand at the sample
    segment: np.ndarray
    length: float
    exact: bool
    surface: tuple | None = None  # (k,) which of the n, (k,) triangles, (k, 2) barycentric: places
    # whose own emission takes the place of the light's colour


def length(vectors: np.ndarray) -> np.ndarray:
    """(n,) Euclidean lengths of (n, 3), never 0."""
    return np.sqrt(np.maximum(np.einsum("ij,ij->i", vectors, vectors), 1e-30))


def partly_above(cosine: np.ndarray, slack: np.ndarray) -> np.ndarray:
    """About the mean of max(cosine, 0) over a light whose cosines spread by ``slack`` both ways:
    above 0 wherever a part of the light is above the horizon."""
    part = np.maximum(cosine + slack, 0) ** 2 / (4 * np.maximum(slack, 1e-9))
    return np.where(cosine > slack, cosine, part + 1e-4 * (cosine > -slack))


def disc(axis: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(n, 3) points uniform in the unit disc across unit ``axis`` (n, 3)."""
    frames = tangent_frames(axis)
    radius, turn = np.sqrt(xi[:, 0]), 2 * np.pi * xi[:, 1]
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    points = np.empty((len(xi), 3))
    for k in range(3):  # inner loops over points, not over three numbers
        points[:, k] = x * frames[:, 0, k] + y * frames[:, 1, k]
    return points
