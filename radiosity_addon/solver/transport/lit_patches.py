"""Lit patches: patches with their points and the direct light there, the source of the linear system."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..array_struct import ArrayStruct
from ..direct.irradiance import direct_at
from ..geometry.footprints import Footprints
from ..lights.context import Context
from ..sampling.points import Points, footprint_points, points_on
from ..sampling.sobol import uniform
from .places import Places

PHASE = "transport"


@dataclass(frozen=True)
class LitPatches(ArrayStruct):
    """R patches and what is known of them from their points."""

    patch: np.ndarray  # (R,) int64
    points: Points  # (per, R)
    reflectance: np.ndarray  # (R, channels)
    lit: np.ndarray  # (R, channels): reflectance × direct irradiance, mean over the points
    deviation: np.ndarray  # (R,): standard deviation of that over the points, mean of channels
    share: np.ndarray  # (R,): of all places, those on this patch


def light_patches(
    context: Context, places: Places, patch: np.ndarray, per: int, key: tuple[int, ...]
) -> LitPatches:
    """The patches that places lie on, lit directly at ``per`` of these places each.

    ``patch`` (n,) are the places' patches.
    """
    order = np.argsort(patch, kind="stable")
    patches, first, number = np.unique(patch[order], return_index=True, return_counts=True)
    evenly = ((np.arange(per)[:, None] + 0.5) / per * number).astype(np.int64)
    chosen = places.take(order[first + evenly])
    shift = uniform((len(patches), 3), *key, 7)
    points = points_on(
        context.geometry, chosen.triangle, chosen.u, chosen.v, chosen.front, shift
    )
    reflectance, lit, deviation = light_points(context, points, key)
    return LitPatches(
        patches, points, reflectance.mean(axis=0), lit, deviation, number / max(len(patch), 1)
    )


def light_receivers(
    context: Context, footprints: Footprints, per: int, key: tuple[int, ...]
) -> LitPatches:
    """The patches of receivers, lit directly at ``per`` points on each of their ``footprints``."""
    everyone = np.arange(footprints.count)
    points = _points_on(footprints, everyone, per, key)
    reflectance, lit, deviation = light_points(context, points, key)
    total = max(footprints.area.sum(), 1e-300)
    return LitPatches(
        everyone, points, reflectance.mean(axis=0), lit, deviation, footprints.area / total
    )


def brightness_and_noise(
    context: Context, footprints: Footprints, some: np.ndarray, per: int, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Of ``some`` (k,) int footprints the mean (k,) of reflectance × direct irradiance over ``per`` points and all
    channels, and its standard deviation (k,) at a point by the choice among many lights."""
    _, lit, noise = _lit_at(context, _points_on(footprints, some, per, key), key)
    return lit.mean(axis=(0, 2)), np.sqrt(noise.mean(axis=0))


def mean_light(
    context: Context, footprints: Footprints, some: np.ndarray, per: int, key: tuple[int, ...]
) -> np.ndarray:
    """(k, channels) mean of reflectance × direct irradiance over ``per`` points on ``some`` (k,) int footprints."""
    return lit_on(context, footprints, some, per, key)[1].mean(axis=0)


def lit_on(
    context: Context, footprints: Footprints, some: np.ndarray, per: int, key: tuple[int, ...]
) -> tuple[Points, np.ndarray]:
    """``per`` points on each of ``some`` (k,) int footprints, and reflectance × direct irradiance (per, k, channels) there."""
    points = _points_on(footprints, some, per, key)
    return points, _lit_at(context, points, key)[1]


def _points_on(
    footprints: Footprints, some: np.ndarray, per: int, key: tuple[int, ...]
) -> Points:
    shift = uniform((len(some), 3), *key, 7)
    points = footprint_points(footprints, some, shift, per, *key, 6)
    return replace(points, barycentric=points.uv)


def light_points(
    context: Context, points: Points, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reflectance (per, R, channels) at points (per, R), the mean (R, channels) of reflectance ×
    direct irradiance, and its standard deviation (R,) over the points, mean of channels, less what
    the choice among many lights adds."""
    reflectance, lit, noise = _lit_at(context, points, key)
    deviation = np.sqrt(np.maximum(lit.std(axis=0).mean(axis=1) ** 2 - noise.mean(axis=0), 0))
    return reflectance, lit.mean(axis=0), deviation


def _lit_at(
    context: Context, points: Points, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reflectance and reflectance × direct irradiance (per, R, channels) at points (per, R), and the variance
    (per, R) of that by the choice among many lights."""
    per, count = points.shape
    irradiance, variance = direct_at(context, points.single(), (*key, 8), PHASE)
    triangle = points.triangle.ravel()
    faces = context.geometry.normal[triangle]
    front = np.einsum("nc,nc->n", points.normal.reshape(-1, 3), faces) > 0
    reflectance = context.reflectance(triangle, points.uv.reshape(-1, 2), front)
    lit = (reflectance * irradiance).reshape(per, count, context.channels)
    noise = (reflectance.mean(axis=1) ** 2 * variance).reshape(per, -1)
    return reflectance.reshape(lit.shape), lit, noise
