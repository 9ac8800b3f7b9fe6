"""Rays: bundles of cosine-distributed rays from points, what they meet, and means over them.

Seeds, rows of form factors, the final gather and paths shoot, follow transmission and look up what was
met in one function: ``shoot``.
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

RAYS_PER_CHUNK = 1 << 16  # number [rays] of a chunk


@dataclass(frozen=True)
class Met:
    """What rays met: all of them first, or all that those met behind it that went on through surfaces.

    ``rays`` (k,) numbers the rays, ``weight`` (k, channels) the share of their light; both None for
    the first, which is every ray with weight 1. ``entry`` (k,) int32 is the hits' (see ``patches``).
    """

    hits: Hits
    entry: np.ndarray
    rays: np.ndarray | None = None
    weight: np.ndarray | None = None

    def number(self, chosen: np.ndarray) -> np.ndarray:
        """(k,) int: the numbers of the rays whose hits ``chosen`` (k,) int are."""
        return chosen if self.rays is None else self.rays[chosen]

    @property
    def numbers(self) -> np.ndarray:
        """(n,) int: those of all hits."""
        return self.number(np.arange(len(self.entry)))


@dataclass(frozen=True)
class Shot:
    """Rays that were shot, equally many from each of R owners; ray m of owner r has the number m·R + r.

    A ray that ends on a cut of an element, so near that either part may be meant, is replaced by its owner's
    next ray in every respect: the ``lost`` (k,) int by the rays ``by`` (k,) int.
    """

    met: list[Met]
    directions: np.ndarray  # (rays, R, 3) float32
    lost: np.ndarray
    by: np.ndarray

    def replaced(self, values: np.ndarray) -> np.ndarray:
        """Values of all rays, of any shape, with those of lost rays replaced as these were."""
        if len(self.lost) == 0:
            return values
        flat = values.reshape(-1).copy()
        flat[self.lost] = flat[self.by]
        return flat.reshape(values.shape)


def shoot(
    context: Context, patches: Patches, points: Points, directions: np.ndarray,
    near_goes_onward: bool = False,
) -> Shot:
    """Shoot rays in ``directions`` (per, rays per point, R, 3) float32 from ``points`` (per, R), follow them
    through surfaces that transmit, and look up which of ``patches`` they meet, as ``Patches.hit`` does."""
    origins = np.empty_like(directions)
    origins[:] = points.position[:, None]
    origins, flat = origins.reshape(-1, 3), directions.reshape(-1, 3)
    hits = context.tracer.intersect(origins, flat)
    entry = patches.hit(hits, near_goes_onward)
    lost, by = _lost(entry, patches, points.shape[1])
    if len(lost):
        origins[lost], flat[lost], entry[lost] = origins[by], flat[by], entry[by]
        for array in (hits.triangle, hits.u, hits.v, hits.front, hits.distance):
            array[lost] = array[by]
    met = [Met(hits, entry)]
    layers = list(followed(context, origins, flat, hits)) if context.transmits.any() else []
    if layers:
        # All layers at once: there may be dozens, most of few rays.
        number, hits, weight = zip(*layers)
        behind = Hits.join(hits)
        met.append(Met(behind, patches.hit(behind, near_goes_onward), *map(np.concatenate, (number, weight))))
    return Shot(met, flat.reshape(-1, *directions.shape[2:]), lost, by)


def _lost(entry: np.ndarray, patches: Patches, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The rays (k,) int that ended nowhere, of all rays (rays · count,) with the entries ``entry``; and of each
    the next (k,) of the same owner that ended somewhere. They cannot be followed from where they ended: that
    may be the other side of a wall."""
    nothing = np.zeros(0, np.int64)
    if not patches.elements.has_cuts:
        return nothing, nothing
    lost = np.flatnonzero(entry == patches.nowhere)
    by = lost
    for _ in range(len(entry) // count - 1 if len(lost) else 0):
        by = np.where(entry[by] == patches.nowhere, (by + count) % len(entry), by)
    return lost, by


def shared_directions(points: Points, rays: int, *key: int) -> np.ndarray:
    """(points, rays per point, R, 3) float32: ``rays`` cosine-distributed rays of each of R owners, shared
    among its points; the same for all owners but for a rotation. Matrix products make them. ``rays`` is a
    multiple of the points per owner."""
    # Consecutive Sobol points cover the hemisphere evenly by themselves; every n-th would not.
    per, count = points.shape
    axes = points.axes(points.shift[:, 2])
    axes = axes.reshape(3, -1, 3 * count).swapaxes(0, 1)
    local = cosine_directions(sobol(rays, 2, *key)).reshape(len(axes), -1, 3)
    return (local @ axes).reshape(per, -1, count, 3)


def own_directions(points: Points, rays: int, *key: int) -> np.ndarray:
    """The same with a shift of the set for each owner, so that owners' errors are independent."""
    return _lifted(points, *_own_samples(points, rays, *key))


def guided_directions(
    points: Points, rays: int, guide: Guide, owners: np.ndarray, *key: int
) -> tuple[np.ndarray, np.ndarray]:
    """The same as ``guide`` aims them for ``owners`` (R,), and its bins (rays, R) that they are in."""
    *xi, bins = guide.aim(owners, *_own_samples(points, rays, *key))
    return _lifted(points, *xi), bins


def _own_samples(points: Points, rays: int, *key: int) -> list[np.ndarray]:
    """u and v, (rays, R) float32 each: a Sobol set, shifted for each owner by its ``shift``."""
    table = sobol(rays, 2, *key).astype(np.float32)
    return [shifted(table[:, axis, None], points.shift[:, axis]) for axis in (0, 1)]


def _lifted(points: Points, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(points, rays per point, R, 3) float32 at ``u`` and ``v`` (rays, R) of the square."""
    per, count = points.shape
    axes = points.axes()
    local = [axis.reshape(per, -1, count) for axis in cosine_lifted(u, v)]
    directions = np.empty(local[0].shape + (3,), np.float32)
    for axis in range(3):  # inner loops over owners, not over three numbers
        x, y, z = (part * each[:, None, :, axis] for part, each in zip(local, axes))
        x += y
        np.add(x, z, out=directions[..., axis])
    return directions


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
