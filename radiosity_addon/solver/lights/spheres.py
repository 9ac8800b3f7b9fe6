"""Spheres: point and spot lamps whose soft falloff is off: glowing spheres, not facing disks.

Seen whole from a distance d such a lamp brings I cosθ / d², however large it is; partly below the
horizon the part above; from inside the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import Geometry
from ..geometry.vectors import columns, dot, lengths, tangents
from ..sampling.points import Middles
from ..sampling.sobol import cosine_lifted
from ..scene import PointLamp
from .cones import cone_directions
from .facing_disks import FacingDisks, batch_of_point_lamps
from .light_batch import Sample, Unoccluded, chord, partly_above, unknown


@dataclass(frozen=True)
class SphereLights(FacingDisks):
    """Spheres of constant radiance I / πr² (a spot's: within its beam), radius above 0."""

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample the cone of the sphere by the cosine law, or from inside it the hemisphere."""
        toward, normal = columns(self.position[which] - position), columns(normal)
        distance, radius = lengths(toward), self.radius[which]
        inside = distance <= radius
        unit = toward / distance
        sine = np.where(inside, 0, np.minimum(radius / distance, 1)) ** 2
        direction, ratio = cone_directions(unit, normal, dot(unit, normal), sine, xi.T)
        local = np.stack(cosine_lifted(*xi.T))
        around = local[0] * tangents(normal)[0] + local[1] * tangents(normal)[1]
        direction = np.where(inside, around + local[2] * normal, direction)
        along = dot(direction, toward)
        half = np.sqrt(np.maximum(radius**2 - distance**2 + along**2, 0))
        segment = np.maximum(along + np.where(inside, half, -half), 0) * direction
        beam = np.where(inside, 1, self.beam(which, direction))
        if self.uneven(which):
            beam = beam * self.shapes.at(which, -direction)
        value = np.where(inside, 1 / radius**2, ratio / distance**2) * beam
        return Sample(value, np.ascontiguousarray(segment.T, np.float32), 1.0)

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """Looked at from every point."""
        return unknown(middles)

    def importance(
        self, which: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """See ``LightBatch``."""
        toward = np.stack([center[which] - x for center, x in zip(self.position.T, position)])
        square = np.maximum(dot(toward, toward), 1e-30)
        distance, radius = np.sqrt(square), self.radius[which] + extent
        slack = chord(np.minimum(radius / distance, 1)) + 1e-3
        facing = dot(toward, normal) / distance
        beam = self.beam(which, toward / distance, slack)
        if self.uneven(which):
            beam = beam * self.shapes.most(which, -toward / distance, slack)
        inside = square <= radius**2
        rough = np.where(inside, 1, partly_above(facing, slack) * beam)
        return self.color.mean(axis=1)[which] * rough / np.maximum(square, radius**2)


def is_sphere(lamp: PointLamp) -> bool:
    """Whether it is one, not a disk."""
    return lamp.sphere and lamp.radius > 0


def batch_of_spheres(lamps: list[PointLamp], geometry: Geometry) -> FacingDisks:
    """Of point and spot lamps that are spheres."""
    return batch_of_point_lamps(lamps, geometry, SphereLights)
