"""Microfacets: the share of light that rough mirrors send back, as Cycles has it.

Light that arrives from all around alike leaves a layer with the mean by the cosine of its
*directional albedo* E(μ), which is integrated here over the normals of facets that are seen (GGX:
Walter et al. 2007; sampled as in Heitz 2018). What the facets keep by hiding one another comes back
after further reflections where a shader says so (Multiscatter GGX: Kulla and Conty 2017; Turquin 2019).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

COSINES = 16  # number [cosines of the direction] of Gauss' rule
STRATA = 32  # number [strata along either axis] of the facets' normals
SMOOTHEST = 1e-4  # slope [of facets]: less is the same
X, W = np.polynomial.legendre.leggauss(COSINES)
COSINE = (X + 1) / 2  # cosines [of 1] between the normal and the direction
WEIGHT = W * COSINE
NODES = np.linspace(0.0, 1.0, 33)  # reflectances [of 1]: albedos of others lie between theirs
Fresnel = Callable[[np.ndarray], np.ndarray]  # from cosines (...) to reflectances (..., c)


@dataclass(frozen=True)
class Facets:
    """What is seen of rough facets from each of COSINES directions: the cosine (k, n) at which, and the
    share (k, n) of it that no other facet hides."""

    cosine: np.ndarray
    unhidden: np.ndarray

    def mean(self, fresnel: np.ndarray) -> np.ndarray:
        """(k, ...) directional albedos without further reflections, of ``fresnel`` (k, n, ...) at the
        cosines."""
        return np.einsum("kn,kn...->k...", self.unhidden, fresnel) / self.unhidden.shape[1]


@functools.lru_cache(64)
def facets(roughness: float) -> Facets:
    """Those of a roughness, whose square is the slope α of Trowbridge and Reitz: sampled by how much of
    each is seen (Heitz 2018), with the shadowing of Smith (Heitz 2014, equation 99)."""
    slope = max(float(np.clip(roughness, 0, 1)) ** 2, SMOOTHEST)
    middle = (np.arange(STRATA) + 0.5) / STRATA
    radius, angle = (x.ravel() for x in np.meshgrid(np.sqrt(middle), 2 * np.pi * middle))
    sine = np.sqrt(1 - COSINE**2)
    length = np.sqrt((slope * sine) ** 2 + COSINE**2)
    x, z = slope * sine / length, COSINE / length  # the direction, where facets are a hemisphere
    first, second = radius * np.cos(angle), radius * np.sin(angle)
    tilt = ((1 + z) / 2)[:, None]
    second = (1 - tilt) * np.sqrt(1 - first**2) + tilt * second
    third = np.sqrt(np.maximum(1 - first**2 - second**2, 0))
    normal = np.stack([
        slope * (x[:, None] * third - z[:, None] * second), slope * first + 0 * second,
        np.maximum(z[:, None] * third + x[:, None] * second, 0),
    ])  # fmt: skip
    normal /= np.linalg.norm(normal, axis=0)
    cosine = sine[:, None] * normal[0] + COSINE[:, None] * normal[2]
    leaving = 2 * cosine * normal[2] - COSINE[:, None]
    one, other = _hidden(slope, COSINE)[:, None], _hidden(slope, np.maximum(leaving, 1e-9))
    return Facets(cosine, np.where(leaving > 0, (1 + one) / (1 + one + other), 0.0))


def _hidden(slope: float, cosine: np.ndarray) -> np.ndarray:
    """Smith's Λ of facets, seen at a cosine (Heitz 2014, equation 72)."""
    return (np.sqrt(1 + slope**2 * (1 / cosine**2 - 1)) - 1) / 2


def hemispherical(albedo: np.ndarray) -> np.ndarray:
    """Means (...,) by the cosine, ∫ 2 μ E(μ) dμ, of directional albedos (COSINES, ...)."""
    return np.einsum("k,k...->...", WEIGHT, albedo)


def albedos(fresnel: Fresnel, roughness: float, compensated: bool) -> tuple[np.ndarray, np.ndarray]:
    """Hemispherical albedo (c,) of a rough mirror whose facets reflect ``fresnel``, and of the one by
    which Cycles dims what lies under it. ``compensated``: with the light of further reflections.

    A share E of white light leaves after one reflection, in the mean Ē; of what stays, facets that reflect
    F̄ in the mean send back F̄ Ē / (1 - F̄ (1 - Ē)) (Kulla and Conty 2017).
    """
    seen = facets(roughness)
    white = seen.mean(np.ones_like(seen.cosine))[:, None]
    once = seen.mean(fresnel(seen.cosine))
    if not compensated:
        return hemispherical(once), hemispherical(once / white)
    facet, mean = hemispherical(fresnel(COSINE)), hemispherical(white)
    further = facet * mean / (1 - facet * (1 - mean))
    both = hemispherical(once * (1 + further * (1 - white) / white))
    return both, both


def dielectric(index: float) -> Fresnel:
    """Fresnel's reflectance of an interface of this index of refraction, for unpolarized light."""

    def reflectance(cosine: np.ndarray) -> np.ndarray:
        below = np.sqrt(np.maximum(1 - (1 - cosine**2) / index**2, 0))
        across = (cosine - index * below) / (cosine + index * below)
        along = (index * cosine - below) / (index * cosine + below)
        return ((across**2 + along**2) / 2)[..., None]

    return reflectance


def metal(color: np.ndarray, edge: float = 1.0) -> Fresnel:
    """Schlick's (1994) reflectance of metals of ``color`` (c,) along the normal; ``edge`` is the share of it that
    is left at 82° (Hoffman 2019)."""
    color = np.clip(color, 0, 1)
    at_82 = color + (1 - color) * (6 / 7) ** 5
    dip = at_82 * (1 - np.clip(edge, 0, 1)) * 7 / (6 / 7) ** 6

    def reflectance(cosine: np.ndarray) -> np.ndarray:
        c, grazing = cosine[..., None], (1 - cosine[..., None]) ** 5
        return np.clip(color + (1 - color) * grazing - dip * c * (1 - c) * grazing, 0, 1)

    return reflectance


def even(color: np.ndarray) -> Fresnel:
    """A mirror that reflects ``color`` (c,) at every angle."""
    return lambda cosine: np.broadcast_to(color, (*cosine.shape, len(color)))


def albedo_of(
    values: np.ndarray, fresnels: Sequence[Callable[[np.ndarray], Fresnel]], roughness: float, compensated: bool
) -> np.ndarray:
    """Hemispherical albedos (k, c) of mirrors of colors ``values`` (k, c) in [0, 1], of which each channel has a
    function that gives the reflectance of colors (n,)."""
    found = np.empty_like(values)
    for channel, fresnel in enumerate(fresnels):
        known, _ = albedos(fresnel(NODES), roughness, compensated)
        found[:, channel] = np.interp(values[:, channel], NODES, known)
    return found
