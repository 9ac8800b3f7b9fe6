"""Residual: what gathered light lacks, followed along paths.

Rays look radiosities up in a table T that is constant on each element. The true reflected
radiosity B = ρ (D + K (B + F)), with direct irradiance D and light F first-hand, differs from it by
a solution of the same equation: B − T = r + ρ K (B − T), whose source is the residual
r = ρ (D + K (T + F)) − T. So a path that starts where a gather ray ends, and adds up the residual
at each place it comes to, times the reflectances on its way, brings the exact bias of that ray's
light in the mean, whatever the elements (the dual-weighted residual of Becker and Rannacher 2001,
"An optimal control approach to a posteriori error estimation in finite element methods").
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..array_struct import ArrayStruct
from ..direct.irradiance import direct_at
from ..geometry.footprints import Footprints
from ..lights.context import Context
from ..sampling.points import Points, footprint_points
from ..sampling.sobol import uniform
from ..transport.onward import Ends, ends_of, join_ends
from ..transport.places import Places, no_places
from ..transport.radiosity import Radiosity
from ..transport.rays import Shot, mean_of_rays, own_directions, shoot, sums_of
from ..workers.parallel import ranges
from .gather import first_hand, first_hand_table, follow_onward, light_at

NEXT_RAYS = 16  # number [rays] at each place of a path, which estimate K (T + F) there
LIGHT_SAMPLES = 2  # number [samples of each light] at each place of a path
MAX_BOUNCES = 64  # number [places] of a path, at most: chance ends nearly all long before
PATHS_PER_CHUNK = 4096  # number [paths] of a chunk
PHASE = "transport"


@dataclass(frozen=True)
class Paths(ArrayStruct):
    """n paths from receivers."""

    owner: np.ndarray  # (n,) int: the receiver a path starts at
    irradiance: np.ndarray  # (n, channels) float32: one sample of all light that is known there and baked
    lack: np.ndarray  # (n, channels) float32 irradiance: what the path adds up to


@dataclass(frozen=True)
class Visits(ArrayStruct):
    """k places that paths came to."""

    path: np.ndarray  # (k,) int
    places: Places
    value: np.ndarray  # (k, channels) float32: what the place added to the path


@dataclass(frozen=True)
class Residuals:
    """Paths along the residual, and where they came to."""

    paths: Paths
    visits: Visits

    def of_visits(self, chosen: np.ndarray) -> Residuals:
        """The same paths with what the ``chosen`` (k,) bool visits alone added to them."""
        visits = self.visits.take(chosen)
        lack = sums_of(visits.path, visits.value.astype(float), len(self.paths.owner))
        return replace(self, paths=replace(self.paths, lack=lack.astype(np.float32)))


def follow_residual(
    context: Context, footprints: Footprints, radiosity: Radiosity, paths: int, *key: int,
    direct: bool = True,
) -> Residuals:
    """``paths`` paths from receivers, as many from a receiver as its share of the area makes. ``direct``: light that comes
    straight from its source counts as irradiance, as it is baked, too."""
    target = (np.arange(paths) + uniform((paths,), *key, 1)) / paths * footprints.cumulative[-1]
    ends = footprints.cumulative[footprints.start[1:]]
    owners = np.minimum(np.searchsorted(ends, target, "right"), footprints.count - 1)
    table = first_hand_table(context, radiosity)
    work = _ResidualChunk(context, footprints, radiosity.table(), table, owners, direct, key)
    return join_residuals(context.map_chunks(work, ranges(paths, PATHS_PER_CHUNK), PHASE))


@dataclass(frozen=True)
class _ResidualChunk:
    """Follows the paths of a slice of ``owners`` (n,). ``table``: see ``first_hand_table``."""

    context: Context
    footprints: Footprints
    radiosity: Radiosity
    table: np.ndarray | None
    owners: np.ndarray
    direct: bool
    key: tuple[int, ...]

    def __call__(self, chunk: slice) -> Residuals:
        return _follow(self.context, self.footprints, self.radiosity, self.table,
                       self.owners[chunk], self.direct, (*self.key, chunk.start))  # fmt: skip


def join_residuals(parts: list[Residuals]) -> Residuals:
    """All paths of all parts."""
    first = np.cumsum([0, *(len(part.paths.owner) for part in parts)])
    visits = [replace(part.visits, path=part.visits.path + start) for part, start in zip(parts, first)]
    return Residuals(Paths.join([part.paths for part in parts]), Visits.join(visits))


def _follow(
    context: Context, footprints: Footprints, radiosity: Radiosity, table: np.ndarray | None,
    owners: np.ndarray, direct: bool, key: tuple[int, ...],
) -> Residuals:
    """Paths from ``owners`` (n,); ``direct`` as in ``follow_residual``."""
    count = len(owners)
    points = footprint_points(footprints, owners, uniform((count, 3), *key, 2), 1, *key)
    shot = _shoot(context, radiosity, points, 1, *key, 3)
    known, first, ends = _arrived(context, radiosity, table, shot, (*key, 6), near_goes_onward=True)
    if direct:
        known = known + first
    if points.shade is not None:
        share = points.shade.share_of_rays(shot.directions)
        known, ends = known * share, replace(ends, weight=ends.weight * share[ends.owner])
    if direct:
        known = known + _direct(context, points, (*key, 4))
    lack = np.zeros((count, context.channels))
    visits = []
    # Where rays of the gather end on sides without a row, these get one that lacks nothing
    # (``late_rows``).
    some = np.flatnonzero(~radiosity.unknown[ends.places.entry])
    ends = ends.take(some)
    for bounce in range(MAX_BOUNCES):
        if len(ends.owner) == 0:
            break
        value, ends_next = _step(context, radiosity, table, ends, (*key, 5, bounce))
        lack += sums_of(ends.owner, value, count)
        visits.append(Visits(ends.owner, ends.places, value.astype(np.float32)))
        ends = ends_next
    paths = Paths(owners, known.astype(np.float32), lack.astype(np.float32))
    nothing = Visits(np.zeros(0, np.int64), no_places(), np.zeros((0, context.channels), np.float32))
    return Residuals(paths, Visits.join(visits or [nothing]))


def _shoot(context: Context, radiosity: Radiosity, points: Points, rays: int, *key: int) -> Shot:
    """``rays`` from each owner of points, with a shift of its own."""
    directions = own_directions(points, rays, *key)
    return shoot(context, radiosity.patches, points, directions, near_goes_onward=True)


def _arrived(
    context: Context, radiosity: Radiosity, table: np.ndarray | None, shot: Shot,
    key: tuple[int, ...], near_goes_onward: bool = False,
) -> tuple[np.ndarray, np.ndarray, Ends]:
    """(R, channels) irradiance that rays bring by the table, reflected and first-hand, and where the first of each of the R owners' rays ended,
    with all that it met on its way. Those that go on do so ``near_goes_onward``, as rays of the gather; the residual
    is less noisy if they do not, and its mean is right either way."""
    patches, (rays, count) = radiosity.patches, shot.directions.shape[:2]
    reflected, emitted = np.zeros((2, count, context.channels))
    ends, onward = [], []
    for part in shot.met:
        light = np.take(radiosity.reflected, part.entry, axis=0)
        reflected += mean_of_rays(light, part, rays, count)
        direct = first_hand(context, radiosity, table, part, shot.directions)
        if direct is not None:
            emitted += mean_of_rays(direct, part, rays, count)
        number = part.numbers
        for parts, some in (
            (ends, (number < count) & patches.somewhere(part.entry)),
            (onward, part.entry == patches.onward),
        ):  # fmt: skip
            some = np.flatnonzero(some)
            weight = np.ones((len(some), context.channels))
            parts.append(ends_of(part, shot.directions, some, number[some], weight))
    onward = join_ends(onward, context.channels)
    light, first, after = follow_onward(
        context, radiosity, onward, rays * count, key, near_goes_onward
    )
    light += light_at(radiosity.reflected, after, rays * count)
    reflected += light.reshape(rays, count, -1).mean(axis=0)
    emitted += first.reshape(rays, count, -1).mean(axis=0)
    ends.append(after.take(np.flatnonzero(after.owner < count)))
    return reflected, emitted, join_ends(ends, context.channels)


def _step(
    context: Context, radiosity: Radiosity, table: np.ndarray | None, ends: Ends,
    key: tuple[int, ...],
) -> tuple[np.ndarray, Ends]:
    """The weighted residual (k, channels) where paths are, and where they go on to."""
    places = ends.places
    points = places.points(context.geometry, uniform((len(places.front), 3), *key, 1))
    reflectance = context.reflectance(places.triangle, places.uv, places.front)
    shot = _shoot(context, radiosity, points, NEXT_RAYS, *key, 2)
    reflected, emitted, after = _arrived(context, radiosity, table, shot, (*key, 7))
    arriving = reflected + emitted + _direct(context, points, (*key, 3))
    known = radiosity.reflected[places.entry]
    residual = reflectance * arriving - known
    back = after.weight * (ends.weight * reflectance)[after.owner]
    return ends.weight * residual, _surviving(
        replace(after, owner=ends.owner[after.owner], weight=back),
        uniform((len(back),), *key, 4),
    )


def _surviving(ends: Ends, xi: np.ndarray) -> Ends:
    """Those that go on, in proportion to their weight, at a weight of 1. With less of a chance weights
    would grow along a path, and the variance with them without end."""
    return ends.surviving(np.minimum(ends.weight.max(axis=1, initial=0), 1), xi)


def _direct(context: Context, points: Points, key: tuple[int, ...]) -> np.ndarray:
    """(R, channels) irradiance from explicit lights at one point of each owner."""
    shape = (LIGHT_SAMPLES, points.shape[1])
    repeated = Points(
        np.repeat(points.position, LIGHT_SAMPLES, axis=0),
        np.repeat(points.normal, LIGHT_SAMPLES, axis=0),
        np.broadcast_to(points.triangle, shape),
        lambda: np.broadcast_to(points.uv, (*shape, 2)),
        points.shift,
    ).single()  # owners of their own, as their numbers are independent
    light, _ = direct_at(context, repeated, key, PHASE)
    return light.reshape(*shape, -1).mean(axis=0)
