"""Principled BSDF: what share of its base color is diffuse, and what its coating mirrors.

Cycles dims the diffuse layer below the dielectric coating by the coating's albedo for the viewing
direction; a bake looks along the normal. That albedo is F0 · g(F0, roughness), where F0 =
((n-1)/(n+1))² is the reflectance at normal incidence and g the single-scatter loss of a rough
surface. g was measured with Cycles 5.2 (4.5 agrees to 1e-6) by baking the diffuse color.
"""

from __future__ import annotations

import numpy as np

from .microfacets import albedos, dielectric

ROUGHNESS = np.linspace(0.0, 1.0, 11)  # roughnesses [of 1] of the columns below
INDEX = np.array([1.2, 1.6, 3.0])  # indices of refraction of the rows below
# Shares [of the light] that a coat takes, by index of refraction and roughness.
LOSS = np.array(
    (
        (1.00364, 1.00362, 1.00286, 0.99922, 0.98447, 0.94571, 0.86761, 0.74825, 0.60499, 0.46229,
         0.33982),
        (1.00103, 1.00097, 0.99988, 0.99457, 0.97696, 0.93460, 0.85517, 0.73873, 0.60156, 0.46580,
         0.34836),
        (1.00020, 1.00013, 0.99898, 0.99351, 0.97681, 0.93820, 0.86778, 0.76507, 0.64222, 0.51704,
         0.40397),
    )
)  # fmt: skip


def normal_reflectance(index: float) -> float:
    """F0 of an interface of this index of refraction (Fresnel)."""
    return ((index - 1.0) / (index + 1.0)) ** 2


def diffuse_share(index: float, roughness: float, level: float = 0.5) -> float:
    """The share of light that passes the coating, in [0, 1].

    ``level`` is the Specular IOR Level, which scales F0 by twice its value.
    """
    f0 = _coating_reflectance(index, level)
    return float(np.clip(1.0 - f0 * _loss(f0, roughness), 0.0, 1.0))


def coating_albedo(
    index: float, roughness: float, level: float = 0.5, compensated: bool = True
) -> tuple[float, float]:
    """The share of light from all around that the coating mirrors, and the share by which it dims what
    comes back from all of the base below, both in [0, 1]; see ``microfacets.albedos``."""
    f0 = _coating_reflectance(index, level)
    if f0 == 0:
        return 0.0, 0.0
    root = min(np.sqrt(f0), 0.999)
    coating = dielectric((1 + root) / (1 - root) if index >= 1 else (1 - root) / (1 + root))
    return tuple(float(each[0]) for each in albedos(coating, roughness, compensated))


def _coating_reflectance(index: float, level: float) -> float:
    return min(normal_reflectance(max(index, 1e-3)) * 2.0 * max(level, 0.0), 1.0)


def _loss(f0: float, roughness: float) -> float:
    rows = [np.interp(np.clip(roughness, 0.0, 1.0), ROUGHNESS, row) for row in LOSS]
    return float(np.interp(f0, normal_reflectance(INDEX), rows))
