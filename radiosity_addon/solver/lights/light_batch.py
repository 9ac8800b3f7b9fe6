"""Light batch: what all types of explicitly sampled light have in common.

The types are ``polygons``, ``facing_disks``, ``spheres``, ``suns`` and ``sky_spots``. A batch holds
arrays, one entry a light. It gives, at points: the irradiance that would arrive without obstacles,
and rays that test whether it does. Where that irradiance is the same at all of an owner's points it
is found once, and only the rays are made for each. A new type of light is one more class that has
what ``LightBatch`` asks for, and a line in ``sources.BATCHES``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..geometry.vectors import row_squares
from ..sampling.points import Middles
from .light_tree import Emitters


@dataclass(frozen=True)
class Sample:
    """One sampled place of one light for each of n points.

    ``segment`` (n, 3) float32 runs to it, ``length`` (n,) or one number limits it (inf: a sun).
    ``irradiance`` is the integrand over the density at that place: its mean is the whole light's,
    and times the visibility, without bias, what arrives. ``exact`` is that mean where it is known
    and the samples differ; None where they do not, or nothing better is known.
    """

    irradiance: np.ndarray  # (n,) float64, unoccluded, per unit of the light's color
    segment: np.ndarray
    length: float
    exact: np.ndarray | None = None  # (n,) float64
    surface: tuple | None = None  # (k,) which of the n, (k,) triangles, (k, 2) barycentric: places
    # whose own emission takes the place of the light's color
    tint: np.ndarray | None = None  # (n, channels): multiplies the light's color; None: 1

    def darkened(self, dark: np.ndarray) -> Sample:
        """The same, but nothing arrives at the points that are ``dark`` (n,) bool."""
        exact = None if self.exact is None else np.where(dark, 0, self.exact)
        return replace(self, irradiance=np.where(dark, 0, self.irradiance), exact=exact)


Owners = np.ndarray | slice  # (k,) int, or a slice of all
Segments = Callable[[Owners, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
Value = Callable[[Owners, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
Warp = Callable[[Owners, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Unoccluded:
    """One light over all of an owner's points, for R owners, where that is ``known``.

    ``segments(owners, position, s, t)`` gives what runs to its places (s, t) (per, k) in the unit
    square from ``position`` (per, k, 3) float32 of the ``owners``, (k,) or a slice: (per, k, 3)
    float32, which ``length`` limits; ``value(owners, segments, s, t)`` is the irradiance that each
    of them stands for, (per, k), the integrand over the density of ``warp(owners, s, t)``: (s, t)
    from numbers uniform in the unit square, where these themselves will not do.
    """

    irradiance: np.ndarray  # (R,) float64, unoccluded, per unit of the light's color
    known: np.ndarray  # (R,) bool
    segments: Segments | None  # None: nothing is known
    value: Value | None
    length: float = 1.0
    warp: Warp | None = None


@dataclass(frozen=True)
class Leaving:
    """n particles that leave lights: where, in which unit direction, and the ``power`` per unit of the
    light's color that each stands for: its mean over the particles of a light is all that it sends
    out."""

    origin: np.ndarray  # (n, 3)
    direction: np.ndarray  # (n, 3)
    power: np.ndarray  # (n,)


class LightBatch(Protocol):
    """k lights of one type."""

    @property
    def color(self) -> np.ndarray:
        """(k, channels) what the irradiances are multiplied by; [W/m²] then."""

    @property
    def distant(self) -> bool:
        """Whether they are infinitely far away: no distance compares them with others."""

    @property
    def power(self) -> np.ndarray:
        """(k, channels) in normalized lengths; of distant lights what passes the scene."""

    def leave(self, which: np.ndarray, xi: np.ndarray) -> Leaving:
        """Particles of lights ``which`` (n,), from ``xi`` (n, 4) in [0, 1): the first two are for the
        direction, the others for the place."""

    def cones(self) -> tuple[np.ndarray, np.ndarray]:
        """Of lights that shine from one place into a cone, its solid angle (k,) [sr], inf for others,
        and the radius (k,) of that place."""

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """One place on light ``which``, one or (n,), for each of points (n, 3) that face as
        ``normal`` (n, 3) tells, from ``xi`` (n, 2) in [0, 1)."""

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """One light over all of the owners' points, where that is known."""

    def importance(
        self, which: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """Rough irradiance of lights ``which`` (...) at owners' ``position`` (3, ...), facing as
        ``normal`` (3, ...) tells: above 0 wherever any may arrive within ``extent`` (...) of it."""

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: light may arrive in some box, of these centers and half edges (g, 3)."""

    def emitters(self) -> Emitters:
        """How they shine, roughly: a tree of lights is made of that."""


def no_cones(count: int) -> tuple[np.ndarray, np.ndarray]:
    """``LightBatch.cones`` of ``count`` lights that shine into none."""
    return np.full(count, np.inf), np.zeros(count)


def unknown(middles: Middles) -> Unoccluded:
    """The Unoccluded of a light of which nothing is known at owners: it is sampled from every point."""
    count = len(middles.flat)
    return Unoccluded(np.zeros(count), np.zeros(count, bool), None, None)


def combined(
    origin: Sequence[float] | np.ndarray, axes: tuple, steps: tuple,
    position: np.ndarray | None = None,
) -> np.ndarray:
    """(per, k, 3) float32: from ``position`` (per, k, 3), or nowhere, to two ``steps`` (per, k)
    from ``origin`` along two ``axes``, each (3,) or (3, k)."""
    found = np.empty(steps[0].shape + (3,), np.float32)
    for k in range(3):  # inner loops over points, not over three numbers
        (one, other), (s, t) = (axis[k].astype(np.float32) for axis in axes), steps
        along = s * one
        along += t * other
        along += origin[k].astype(np.float32)
        np.subtract(along, 0 if position is None else position[..., k], out=found[..., k])
    return found


def length(vectors: np.ndarray) -> np.ndarray:
    """(n,) Euclidean lengths of (n, 3), never 0."""
    return np.sqrt(np.maximum(row_squares(vectors), 1e-30))


def partly_above(cosine: np.ndarray, slack: np.ndarray) -> np.ndarray:
    """About the mean of max(cosine, 0) over a light whose cosines spread by ``slack`` both ways:
    above 0 wherever a part of the light is above the horizon."""
    part = np.maximum(cosine + slack, 0) ** 2 / (4 * np.maximum(slack, 1e-9))
    least = (cosine >= -slack) * cosine.dtype.type(1e-4)  # equal: where slack is cut off at 1
    return np.where(cosine > slack, cosine, part + least)


def chord(sine: np.ndarray) -> np.ndarray:
    """The most by which the cosine with any axis changes where a direction turns by an angle β of this ``sine`` in
    [0, 1]: 2 sin(β/2) = sinβ / cos(β/2)."""
    return sine / np.sqrt(0.5 + 0.5 * np.sqrt(np.maximum(1 - sine * sine, 0)))


def in_disk(s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(x, y) uniform in the unit disk from (s, t) in the unit square."""
    radius, azimuth = np.sqrt(s), 2 * np.pi * t
    return radius * np.cos(azimuth), radius * np.sin(azimuth)
