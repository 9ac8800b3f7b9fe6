"""Points: where rays start. On footprints, stratified by area; on elements, where rays met them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Protocol

import numpy as np

from ..geometry.footprints import Footprints
from ..geometry.triangles import OFFSET, Geometry
from ..geometry.vectors import columns, dot
from .shade import Shade, shade_of_cells
from .sobol import GROUPS, MOST_GROUPS, sobol, tangent_axes

FLAT = 1e-6  # difference [of 1] between normals: below it they are the same
LEAST = 64  # number [owners] in a group, at least
LARGE = 2048  # number [owners] of a group: where there are more, groups get more, as longer chunks are no quicker


@dataclass(frozen=True)
class Points:
    """``per`` points for each of R owners, point-major so that rays stay coherent."""

    position: np.ndarray  # (per, R, 3) float32, lifted off the surface
    normal: np.ndarray  # (per, R, 3) float32, on the side that is lit
    triangle: np.ndarray  # (per, R) int32
    barycentric: np.ndarray | Callable[[], np.ndarray]  # (per, R, 2) float32, or what makes it: few ask
    shift: np.ndarray  # (R, 3) float32: the owners' random shifts
    shade: Shade | None = None  # where ``normal`` is not the triangles'

    def __reduce__(self) -> tuple:
        """For another process: with barycentric coordinates, not with what makes them."""
        parts = self.position, self.normal, self.triangle, self.uv, self.shift, self.shade
        return type(self), parts

    @property
    def shape(self) -> tuple[int, int]:
        """(per, R)."""
        return self.triangle.shape

    @property
    def uv(self) -> np.ndarray:
        """(per, R, 2) float32 barycentric."""
        return self.barycentric() if callable(self.barycentric) else self.barycentric

    def take(self, chosen: np.ndarray) -> Points:
        """The points of some owners."""
        arrays = (owned(array, chosen) for array in (self.position, self.normal, self.triangle))
        shade = self.shade and self.shade.take(chosen)
        uv = self.barycentric
        uv = (lambda: owned(self.uv, chosen)) if callable(uv) else owned(uv, chosen)
        return Points(*arrays, uv, self.shift[chosen], shade)

    @classmethod
    def join(cls, parts: list[Points]) -> Points:
        """The owners of all parts, which have as many points each and no shade."""
        names = ("position", "normal", "triangle", "uv")
        arrays = (np.concatenate([getattr(p, name) for p in parts], axis=1) for name in names)
        return cls(*arrays, np.concatenate([p.shift for p in parts]))

    def single(self) -> Points:
        """Every point an owner of its own, in the order of (per, R) flattened."""
        per, count = self.shape
        stagger = (np.arange(per, dtype=np.float32) / per)[:, None, None]
        shift = ((self.shift + stagger) % 1.0).reshape(-1, 3)
        return Points(
            self.position.reshape(1, -1, 3), self.normal.reshape(1, -1, 3),
            self.triangle.reshape(1, -1), lambda: self.uv.reshape(1, -1, 2), shift,
            self.shade and self.shade.single(),
        )

    def middles(self) -> Middles:
        """Where each owner's points lie, taken together."""
        mean, half = self.position[0], 0.0
        if len(self.position) > 1:
            mean = self.position.mean(axis=0)
            half = np.maximum(self.position.max(axis=0) - mean, mean - self.position.min(axis=0))
        flat = np.ones(len(mean), bool)
        if self.normal.strides[0] != 0:
            flat = (np.abs(self.normal - self.normal[0]) < FLAT).all(axis=(0, 2))
        parts = mean, self.normal[0], np.broadcast_to(half, mean.shape)
        return Middles(*(columns(part.astype(float)) for part in parts), flat)

    def axes(self, rotation: np.ndarray | float = 0.0) -> np.ndarray:
        """(3, per or 1, R, 3) float32 tangents, bitangents and normals, an owner's all rotated alike
        by ``rotation`` (R,) revolutions; 1 where an owner's points lie in one plane."""
        flat = self.normal.strides[0] == 0
        return tangent_axes(self.normal[:1] if flat else self.normal, rotation)


class PointSampler(Protocol):
    """What makes points on some owners, ``chosen`` (k,) int or a slice, when they are asked for;
    each ``group`` of owners has Sobol sets of its own."""

    def __call__(self, chosen: np.ndarray | slice, group: int, /) -> Points: ...


@dataclass(frozen=True)
class PointsGiven:
    """A PointSampler of ``points`` that are there, all of one owner each."""

    points: Points

    def __call__(self, chosen: np.ndarray | slice, group: int) -> Points:
        numbers = np.arange(self.points.shape[1])  # Embree wants copies, not views by slices
        return self.points.take(numbers[chosen])


@dataclass(frozen=True)
class PointsOnFootprints:
    """A PointSampler of ``per`` points on ``footprints`` of ``owners`` (n,) int, shifted by ``shift``
    (n, 3)."""

    footprints: Footprints
    owners: np.ndarray
    shift: np.ndarray
    per: int
    key: tuple[int, ...]

    def __call__(self, chosen: np.ndarray | slice, group: int) -> Points:
        return footprint_points(
            self.footprints, self.owners[chosen], self.shift[chosen], self.per, *self.key, group
        )


@dataclass(frozen=True)
class Middles:
    """The points of R owners, each owner's as one position. Its points lie within ``half`` of that along each axis, and
    all have the ``normal`` where they are ``flat``."""

    position: np.ndarray  # (3, R) float64: their mean
    normal: np.ndarray  # (3, R) float64 unit
    half: np.ndarray  # (3, R) float64
    flat: np.ndarray  # (R,) bool

    @property
    def extent(self) -> np.ndarray:
        """(R,) no point is further from the position."""
        return np.sqrt(dot(self.half, self.half))

    def depth(self, axis: np.ndarray) -> np.ndarray:
        """(R,) no point is further from it along unit ``axis`` (3,) or (3, R)."""
        return dot(np.abs(axis), self.half)


def masked(chosen: np.ndarray) -> slice | np.ndarray:
    """What indexes those that are ``chosen`` (R,) bool: a slice where all are."""
    return slice(None) if chosen.all() else np.flatnonzero(chosen)


def owned(array: np.ndarray, some: np.ndarray | slice) -> np.ndarray:
    """(a, k, ...) what the owners ``some``, (k,) int or a slice of them, have of (a, R, ...)."""
    return array[:, some] if isinstance(some, slice) else np.take(array, some, axis=1)


def footprint_points(
    footprints: Footprints, chosen: np.ndarray, shift: np.ndarray, per: int, *key: int
) -> Points:
    """``per`` points, stratified by area, on each of the ``chosen`` footprints (R,) int,
    shifted by ``shift`` (R, 3) in [0, 1)."""
    table = sobol(per, 5, *key).astype(np.float32)  # the lights' coordinates take 2 and 3
    s, t = (shifted(table[:, axis, None], shift[:, axis]) for axis in (0, 1))
    cell = np.take(footprints.start, chosen)
    several = np.flatnonzero(np.take(footprints.start, chosen + 1) - cell > 1)
    if len(several):
        cell = np.repeat(cell[None], per, axis=0)
        cell[:, several] = _sample_cells(
            footprints, chosen[several], table[:, 4:], shift[several, 2]
        )
    square = np.take(footprints.square, cell)
    if not square.all():
        fold = ~square & (s + t > 1)
        s, t = (np.where(fold, 1 - axis, axis) for axis in (s, t))
    position = np.empty(s.shape + (3,), np.float32)
    for axis in range(3):  # inner loops over owners, not over three numbers
        along = s * footprints.u[cell, axis]
        along += t * footprints.v[cell, axis]
        np.add(along, footprints.origin[cell, axis], out=position[..., axis])
    shade = shade_of_cells(footprints.shading, footprints.normal, cell, position.shape[:2])
    return Points(
        position,
        np.broadcast_to(np.take(footprints.normal, cell, axis=0), position.shape)
        if shade is None else shade.normal,
        np.broadcast_to(np.take(footprints.triangle, cell), position.shape[:2]),
        lambda: _barycentric(footprints.corners[cell], s[..., None], t[..., None]),
        shift, shade,
    )  # fmt: skip


def light_coordinates(points: Points, *key: int) -> tuple[np.ndarray, np.ndarray]:
    """(s, t), (per, R) float32 each, uniform in the unit square: for each point, where on a light.
    They take the dimensions 2 and 3 of their set; the points' own coordinates have 0, 1 and 4."""
    table = sobol(len(points.position), 4, *key).astype(np.float32)
    return tuple(
        shifted(table[:, axis, None], points.shift[:, own]) for axis, own in ((2, 2), (3, 0))
    )


def shifted(table: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """The sums of numbers in [0, 1) modulo 1: in [0, 1)."""
    total = table + shift
    total -= total >= 1
    return total


def _barycentric(corners: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(per, R, 2) barycentric places of (s, t) in cells ``corners`` (..., 3, 2)."""
    return s * corners[..., 1, :] + t * corners[..., 2, :] + corners[..., 0, :]


def _sample_cells(
    footprints: Footprints, chosen: np.ndarray, target: np.ndarray, shift: np.ndarray
) -> np.ndarray:
    """(per, R) int: a cell of each footprint for each ``target`` (per, 1) in [0, 1), by area; each
    footprint shifts the targets by its ``shift`` (R,)."""
    first, last = footprints.start[chosen], footprints.start[chosen + 1]
    low, high = footprints.cumulative[first], footprints.cumulative[last]
    target = (target + shift) % 1.0
    found = np.searchsorted(footprints.cumulative, low + target * (high - low), "right") - 1
    return np.clip(found, first, last - 1)


def points_on(
    geometry: Geometry, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, front: np.ndarray,
    shift: np.ndarray,
) -> Points:
    """Points at barycentric (u, v) of triangles, (per, R) each, on the side ``front`` tells, of owners
    with random shifts ``shift`` (R, 3)."""
    shrink = geometry.shrink[triangle][..., None]
    uv = np.stack([u, v], -1).astype(float) * (1 - shrink) + shrink / 3
    normal = np.where(front[..., None], 1.0, -1.0) * geometry.normal[triangle]
    position = geometry.at(triangle, uv) + OFFSET * normal
    return Points(
        position.astype(np.float32), normal.astype(np.float32), triangle, uv.astype(np.float32),
        shift,
    )


def grouped_chunks(count: int, size: int, groups: int | None = None) -> list[tuple[int, slice]]:
    """(group, slice) pairs that cover ``range(count)``; neighbors fall into different groups.

    Each group uses a Sobol set of its own, each chunk has at most ``size`` owners. The groups of
    one stretch of owners follow each other, so that what is read of its footprints is in the cache.
    A few owners are not worth many groups. The error of a set is all its owners', however many they are and
    however widely their light is averaged, so many owners have many groups: ``groups`` of them, None: by ``count``.
    """
    groups = min(max(GROUPS, count // LARGE), MOST_GROUPS) if groups is None else groups
    groups = min(groups, 1 + count // LEAST)
    return [
        (group, slice(start + group, min(start + groups * size, count), groups))
        for start in range(0, count, groups * size)
        for group in range(min(groups, count - start))
    ]
