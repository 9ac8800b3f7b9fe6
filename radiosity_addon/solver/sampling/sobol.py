"""Sobol: randomized quasi-Monte Carlo numbers, directions and tangent frames.

Every number follows from (seed, stream), never from threads or the clock.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..geometry.vectors import tangents
from .sobol_set import BITS, SobolSet

SCRAMBLES = 4  # number [scrambled sets]: each key shifts one of them
# Numbers [Sobol sets, whose errors are independent] that neighboring receivers share among them: usually, and of many receivers.
GROUPS, MOST_GROUPS = 8, 64


@lru_cache(maxsize=128)  # those of thousands of rays are large
def sobol(count: int, dimensions: int, *key: int) -> np.ndarray:
    """(count, dimensions) float64 in [0, 1), read only: a Sobol set, shifted digitally by this key.

    What is sampled together must take different dimensions of sets of one length: the same ones
    have equal digits, whatever their shifts, and however many points there are they lie on a plane.
    The shift is uniform, so that means over sets are unbiased (L'Ecuyer & Lemieux 2002, section
    4.2); one of a few scrambled sets (Owen 1995) is shifted.
    """
    *shift, which = np.random.SeedSequence(key).generate_state(dimensions + 1)
    exponent = max(0, int(np.ceil(np.log2(count))))
    net = _scrambled(exponent, dimensions, int(which) % SCRAMBLES)
    table = (net[:count] ^ np.array(shift, np.uint32)) * 2.0**-32
    table.flags.writeable = False
    return table


@lru_cache(maxsize=256)
def _scrambled(exponent: int, dimensions: int, which: int) -> np.ndarray:
    """(2^exponent, dimensions) uint32: the leading digits of a scrambled Sobol set."""
    found = SobolSet(dimensions, np.random.default_rng(which)).points(0, 1 << exponent)
    return found << np.uint32(32 - BITS)


def uniform(shape: tuple[int, ...], *key: int) -> np.ndarray:
    """Independent float32 numbers in [0, 1) for this key."""
    bits = np.random.Philox(np.random.SeedSequence(key))
    return np.random.Generator(bits).random(shape, np.float32)


def cosine_directions(xi: np.ndarray) -> np.ndarray:
    """(n, 3) float32 unit vectors about +z with density cosθ/π, from ``xi`` (n, 2) in [0, 1)."""
    return np.stack(cosine_lifted(xi[:, 0], xi[:, 1]), 1).astype(np.float32)


def cosine_lifted(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(...) the coordinates x, y and z of such vectors, from (u, v) in [0, 1).

    Malley's method on a polar map: an (x, y) uniform in the disk, lifted to the hemisphere.
    """
    radius, angle = np.sqrt(u), v * u.dtype.type(2 * np.pi)
    z = np.sqrt(np.maximum(1 - u, u.dtype.type(1e-12)))
    return radius * np.cos(angle), radius * np.sin(angle), z


def tangent_frames(normal: np.ndarray) -> np.ndarray:
    """(..., 3, 3) float32: rows tangent, bitangent, normal of unit ``normal`` (..., 3)."""
    return np.moveaxis(tangent_axes(normal), 0, -2)


def tangent_axes(normal: np.ndarray, rotation: np.ndarray | float = 0.0) -> np.ndarray:
    """(3, ..., 3) float32: all tangents, then all bitangents, then all normals of unit ``normal`` (..., 3). The
    tangents are turned about the normals by ``rotation`` (...) revolutions."""
    normal = np.asarray(normal, np.float32)
    tangent, bitangent = tangents(np.ascontiguousarray(np.moveaxis(normal, -1, 0)))
    angle = np.asarray(rotation, np.float32) * np.float32(2 * np.pi)
    c, s = np.cos(angle), np.sin(angle)
    axes = np.empty((3,) + normal.shape, np.float32)
    for k in range(3):
        axes[0, ..., k] = c * tangent[k] + s * bitangent[k]
        axes[1, ..., k] = c * bitangent[k] - s * tangent[k]
    axes[2] = normal
    return axes
