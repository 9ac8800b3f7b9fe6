"""Suns: distant disks, that is sun lamps and the bright spots of a sky."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import SURROUND, Geometry
from ..geometry.vectors import columns, dot, lengths, tangents
from ..sampling.points import Middles
from ..sampling.sobol import tangent_frames
from ..scene import SunLamp
from .light_batch import Leaving, Sample, Unoccluded, combined, in_disk, no_cones
from .light_tree import Emitters

FAR = 1e3  # distance [unit box] at which suns lie in a tree of lights


@dataclass(frozen=True)
class Suns:
    """Distant disks: ``color`` the irradiance on a surface that faces them."""

    color: np.ndarray  # (k, 3)
    toward: np.ndarray  # (k, 3) unit, to the sun
    radius: np.ndarray  # (k,) tangent of the half angle

    @property
    def distant(self) -> bool:
        """True."""
        return True

    @property
    def power(self) -> np.ndarray:
        """(k, channels): irradiance · area of the disk that covers the scene."""
        return np.pi * SURROUND**2 * self.color

    def leave(self, which: np.ndarray, xi: np.ndarray) -> Leaving:
        """Through the disk that covers the scene, from the suns' middles."""
        return through_the_scene(self.toward[which], xi)

    def cones(self) -> tuple[np.ndarray, np.ndarray]:
        """None."""
        return no_cones(len(self.color))

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample a direction in the disk."""
        toward = columns(np.broadcast_to(self.toward[which], position.shape))
        one, other = tangents(toward)
        x, y = (self.radius[which] * position for position in in_disk(xi[:, 0], xi[:, 1]))
        direction = toward + x * one + y * other
        cosine = np.maximum(dot(direction, columns(normal)) / lengths(direction), 0)
        segment = np.ascontiguousarray(direction.T, np.float32)
        return Sample(cosine, segment, np.inf)

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """One sun where all of its disk is above the horizon, or none.

        Its directions (w + r d) / √(1 + r²d²), d uniform in the disk across w, have the mean
        2 (√(1 + r²) − 1) / r² w.
        """
        toward, radius = self.toward[which], self.radius[which]
        cosine = toward @ middles.normal
        slack = radius * np.sqrt(np.maximum(1 - cosine**2, 0))
        mean = 2 / (np.sqrt(1 + radius**2) + 1)
        axes = [radius * axis for axis in tangents(toward)]

        def segments(
            owners: np.ndarray | slice, position: np.ndarray, s: np.ndarray, t: np.ndarray
        ) -> np.ndarray:
            return combined(toward, axes, in_disk(s, t))

        def value(
            owners: np.ndarray | slice, segments: np.ndarray, s: np.ndarray, t: np.ndarray
        ) -> np.ndarray:
            along = np.einsum("pkj,jk->pk", segments, middles.normal[:, owners])
            return np.maximum(along, 0) / np.linalg.norm(segments, axis=2)

        return Unoccluded(
            mean * np.maximum(cosine, 0), middles.flat & (np.abs(cosine) >= slack),
            segments, value, np.inf,
        )

    def importance(
        self, which: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """See ``LightBatch``."""
        toward = self.toward.T.astype(position.dtype)[:, which]
        cosine = dot(toward, normal) + self.radius[which] + 1e-3
        return self.color.mean(axis=1)[which] * np.maximum(cosine, 0)

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: always."""
        return np.full(len(self.color), len(center) > 0)

    def emitters(self) -> Emitters:
        """How they shine, roughly: into all directions, from far away."""
        power = self.color.mean(axis=1) * FAR**2
        none = np.zeros(len(power))
        return Emitters(self.toward * FAR, none, self.toward, power, power, none == 0)


def through_the_scene(toward: np.ndarray, xi: np.ndarray) -> Leaving:
    """Particles from infinitely far, out of the unit directions ``toward`` (n, 3): uniform over a disk
    that covers the scene, by the last two of ``xi`` (n, 4)."""
    radius, azimuth = SURROUND * np.sqrt(xi[:, 2]), 2 * np.pi * xi[:, 3]
    disk = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), 0 * azimuth + SURROUND], 1)
    origin = np.einsum("ni,nij->nj", disk, tangent_frames(toward))
    return Leaving(origin, -toward, np.full(len(toward), np.pi * SURROUND**2))


def batch_of_suns(lamps: list[SunLamp], geometry: Geometry) -> Suns:
    """Of sun lamps."""
    toward = [-np.asarray(lamp.direction, float) for lamp in lamps]
    return Suns(
        np.array([np.asarray(lamp.irradiance, float) for lamp in lamps]),
        np.array([each / np.linalg.norm(each) for each in toward]),
        np.array([np.tan(lamp.angle / 2) for lamp in lamps]),
    )
