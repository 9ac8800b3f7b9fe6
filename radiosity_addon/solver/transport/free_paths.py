"""Free paths: how far rays travel from receivers before they meet something, which says how much of them is seen.

In the picture of somebody at the distance r, a piece dA of a surface covers the solid angle cosθ dA / r². Summed over all
places in the air that see it, of which there are r² dr dω, that is dA ∫ cosθ d(ω) dω = π d̄ dA: d(ω) is the free path in
the direction ω, and d̄ the mean free path of cosine-distributed rays. So a piece counts in pictures taken from anywhere by
its area times its mean free path. Glass ends a path like any surface, which makes what lies close behind it count for less.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.footprints import Footprints, build_footprints
from ..lights.context import Context
from ..receivers import Receivers
from ..sampling.points import footprint_points, grouped_chunks
from ..sampling.sobol import uniform
from ..sampling.streams import Stream
from .rays import RAYS_PER_CHUNK, shared_directions

# Mean free path [edge of a square as large as the receiver]: where it is shorter, as where a floor goes on a millimeter
# under its tiles, something lies so close over the receiver, in the mean, that it is hidden.
HIDDEN = 0.1
# Numbers [rays, each from a point of its own] of a receiver, and of all receivers: each has FEWEST where MOST of each would be more than MANY.
FEWEST, MOST, MANY = 4, 32, 4_000_000
LONGEST = 1.0  # length [unit box] of rays that meet nothing: about the size of the scene
LEAST = 1e-6  # mean free path [unit box] of a receiver, at least


@dataclass(frozen=True)
class FreePaths:
    """Of receivers: ``mean`` (count,) float64 [unit box] >= LEAST, the mean free path over each, and ``hidden`` (count,) bool,
    whether something covers it closely."""

    mean: np.ndarray
    hidden: np.ndarray


def find_free_paths(context: Context, receivers: Receivers) -> FreePaths:
    """Those of the receivers, by the same random numbers for every seed."""
    footprints = build_footprints(context.geometry, replace(receivers, shading=None))
    lengths = np.empty(footprints.count)
    rays = MOST if MOST * footprints.count <= MANY else FEWEST
    work = _PathTracing(context, footprints, uniform((footprints.count, 3), Stream.FREE_PATHS, 1), rays)
    chunks = grouped_chunks(footprints.count, RAYS_PER_CHUNK // rays)
    for chosen, found in context.map_chunks(work, chunks, "elements"):
        lengths[chosen] = found
    return FreePaths(np.maximum(lengths, LEAST), lengths < HIDDEN * np.sqrt(footprints.area))


@dataclass(frozen=True)
class _PathTracing:
    """Traces ``rays`` from each of a (group, slice) of the ``footprints``, which have a ``shift`` (3,) each."""

    context: Context
    footprints: Footprints
    shift: np.ndarray
    rays: int

    def __call__(self, chunk: tuple[int, slice]) -> tuple[slice, np.ndarray]:
        group, chosen = chunk
        key = (Stream.FREE_PATHS, 0, group)
        owners = np.arange(self.footprints.count)[chosen]
        points = footprint_points(self.footprints, owners, self.shift[chosen], self.rays, *key)
        directions = shared_directions(points, self.rays, *key, 1)
        origins = np.empty_like(directions)
        origins[:] = points.position[:, None]
        hits = self.context.tracer.intersect(origins.reshape(-1, 3), directions.reshape(-1, 3))
        lengths = np.where(hits.triangle >= 0, hits.distance, np.float32(LONGEST))
        return chosen, lengths.reshape(self.rays, len(owners)).mean(axis=0, dtype=float)
