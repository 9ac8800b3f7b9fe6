"""Rays: bundles of cosine-distributed rays from points, what they meet, and means over them.

Rows of form factors and the final gather shoot, follow transmission and look up what was met here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..direct.transmission import followed
from ..lights.context import Context
from ..lights.sky import Skylight
from ..sampling.guide import Guide
from ..sampling.points import Points, shifted
from ..sampling.sobol import cosine_directions, cosine_lifted, sobol
from ..tracing.embree import Hits
from .patches import Patches

RAYS_PER_CHUNK = 1 << 16  # number [rays] that are shot together


@dataclass(frozen=True)
class Met:
    """What rays met: all of them first, then those that went on through a surface.

    ``rays`` (k,) numbers the rays, ``weight`` (k, channels) the share of their light; both None for
    the first, which is every ray with weight 1.
    """

    hits: Hits
    rays: np.ndarray | None = None
    weight: np.ndarray | None = None

    def number(self, chosen: np.ndarray) -> np.ndarray:
        """(k,) int: the numbers of the rays whose hits ``chosen`` (k,) int are."""
        return chosen if self.rays is None else self.rays[chosen]

    @property
    def numbers(self) -> np.ndarray:
        """(n,) int: those of all hits."""
        return self.number(np.arange(len(self.hits.triangle)))


def shoot(context: Context, points: Points, rays: int, *key: int) -> tuple[list[Met], np.ndarray]:
    """``rays`` cosine-distributed rays from each owner, shared among its points.

    Returns what they met and their directions (rays, R, 3) float32; ray (m, r) has the number
    m·R + r. ``rays`` is a multiple of the points per owner.
    """
    return _trace(context, points, _shared_directions(points, sobol(rays, 2, *key)))


def shoot_shifted(
    context: Context, points: Points, rays: int, *key: int
) -> tuple[list[Met], np.ndarray]:
    """The same with a shift of the set for each owner, so that owners' errors are independent."""
    return _trace(context, points, _own_directions(points, *_own_samples(points, rays, *key)))


def shoot_guided(
    context: Context, points: Points, rays: int, guide: Guide, owners: np.ndarray, *key: int
) -> tuple[list[Met], np.ndarray, np.ndarray]:
    """The same as ``guide`` aims them for ``owners`` (R,), and its bins (rays, R) that they are in."""
    *xi, bins = guide.aim(owners, *_own_samples(points, rays, *key))
    return *_trace(context, points, _own_directions(points, *xi)), bins


def _own_samples(points: Points, rays: int, *key: int) -> list[np.ndarray]:
    """u and v, (rays, R) float32 each: a Sobol set, shifted for each owner by its ``shift``."""
    table = sobol(rays, 2, *key).astype(np.float32)
    return [shifted(table[:, axis, None], points.shift[:, axis]) for axis in (0, 1)]


def _trace(
    context: Context, points: Points, directions: np.ndarray
) -> tuple[list[Met], np.ndarray]:
    """Rays in ``directions`` (per, rays per point, R, 3) from the points: see ``shoot``."""
    origins = np.empty_like(directions)
    origins[:] = points.position[:, None]
    origins, flat = origins.reshape(-1, 3), directions.reshape(-1, 3)
    met = [Met(context.tracer.intersect(origins, flat))]
    if context.transmits.any():
        later = followed(context, origins, flat, met[0].hits)
        met += [Met(hits, number, weight) for number, hits, weight in later]
    return met, flat.reshape(-1, *directions.shape[2:])


def _shared_directions(points: Points, xi: np.ndarray) -> np.ndarray:
    """(per, rays per point, R, 3) float32 at places ``xi`` (rays, 2) of the square, the same for
    all owners but for a rotation. Matrix products make them."""
    # Consecutive Sobol points cover the hemisphere evenly by themselves; every n-th would not.
    per, count = points.shape
    axes = points.axes(points.shift[:, 2])
    axes = axes.reshape(3, -1, 3 * count).swapaxes(0, 1)
    local = cosine_directions(xi).reshape(len(axes), -1, 3)
    return (local @ axes).reshape(per, -1, count, 3)


def _own_directions(points: Points, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(per, rays per point, R, 3) float32 at places (rays, R) of the square."""
    per, count = points.shape
    axes = points.axes()
    local = [axis.reshape(per, -1, count) for axis in cosine_lifted(u, v)]
    directions = np.empty(local[0].shape + (3,), np.float32)
    for axis in range(3):  # inner loops over owners, not over three numbers
        x, y, z = (part * each[:, None, :, axis] for part, each in zip(local, axes))
        x += y
        np.add(x, z, out=directions[..., axis])
    return directions


def find_lost(entries: np.ndarray, patches: Patches, count: int) -> None:
    """Give rays that end on a cut of an element, on none of its parts for certain, the entry of the owner's
    next ray: ``entries`` (rays · count,) of all rays, changed in place. A ray that went on from there
    might start on the other side of a wall."""
    if patches.elements.has_cuts:
        lost = np.flatnonzero(entries == patches.nowhere)
        entries[lost] = entries[(lost + count) % len(entries)]


def mean_of_rays(
    values: np.ndarray, met: Met, rays: int, count: int, weight: np.ndarray | None = None
) -> np.ndarray:
    """(R, c) mean over each owner's ``rays`` of values (k, c) at what they met, of which the share
    ``met.weight`` comes through, of rays with ``weight`` (rays · R, 1), 1 where None."""
    if met.weight is not None:
        values = values * met.weight
    if weight is not None:
        values = values * np.repeat(of_first(weight, met), values.shape[1]).reshape(values.shape)
    if met.rays is None:
        return values.reshape(rays, count, -1).mean(axis=0)
    return sums_of(met.rays % count, values, count) / rays


def sums_of(owner: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """(count, c) float64 sums of values (k, c) by their ``owner`` (k,) int."""
    sums = [np.bincount(owner, column, count) for column in values.T]
    return np.stack(sums, 1).astype(float, copy=False)  # of no values they are integers


def of_first(weight: np.ndarray, met: Met) -> np.ndarray:
    """(k, 1) weights of rays (rays · R, 1) at what they met."""
    return weight if met.rays is None else weight[met.rays]


def sky_of(sky: Skylight, met: Met, missed: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(k, channels) the sky's radiosity where hits ``missed`` (k,) int met nothing, of rays in
    ``directions`` (rays, R, 3)."""
    return sky(directions.reshape(-1, 3)[met.number(missed)])


def sky_mean(
    sky: Skylight | None, missed: np.ndarray, met: Met, directions: np.ndarray
) -> np.ndarray | float:
    """(R, channels) mean over rays of the sky's radiosity where ``missed`` (k,); 0 without a
    sky."""
    if sky is None:
        return 0.0
    rays, count = directions.shape[:2]
    if sky.constant and met.rays is None:
        return missed.reshape(rays, count).mean(axis=0)[:, None] * sky.pixels[0, 0]
    light = np.zeros((len(missed), sky.pixels.shape[2]), np.float32)
    light[missed] = sky_of(sky, met, np.flatnonzero(missed), directions)
    return mean_of_rays(light, met, rays, count)
