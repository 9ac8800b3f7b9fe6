"""Spheres: point and spot lamps, hard or soft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import columns, dot, size, tangents
from ..sampling.points import Middles
from .light_batch import Sample, Unoccluded, combined, in_disc, length
from .light_tree import Emitters

NODES = 24  # of the quadrature across a soft spot
FAR = 32  # times the reach of a footprint: an irradiance's curvature across it is < 0.1 % there
NEAR = 1e-3  # of the scene: float32 does not tell directions well from nearer than that


@dataclass(frozen=True)
class FacingDiscs:
    """Point and spot lamps: ``color`` radiant intensity [W/sr] in normalised lengths."""

    color: np.ndarray  # (k, 3)
    position: np.ndarray  # (k, 3)
    radius: np.ndarray  # (k,)
    axis: np.ndarray  # (k, 3) direction a spot shines in
    edge: np.ndarray  # (k,) cosine of the cone's half angle; -2 for a point lamp
    smooth: np.ndarray  # (k,) width of the spot's blend, in cosines

    def middle(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres (k, 3) and radii (k,)."""
        return self.position, self.radius

    def sample(
        self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample the disc of the lamp's radius r that faces the point, as Cycles' soft lamps do.

        Seen whole from a distance d it brings I cosθ / (d² + r²): a uniform disc's irradiance
        vector on its axis. A soft spot's beam is that of the sampled place; its mean over the disc
        is known beforehand, so that only the shadows are sampled.
        """
        toward = -columns(position)
        toward += np.take(self.position, np.atleast_1d(which), axis=0).T
        distance, radius = size(toward), self.radius[which]
        unit = toward / distance
        irradiance = np.maximum(dot(unit, columns(normal)), 0) / (distance**2 + radius**2)
        segment = toward
        if np.any(radius > 0):
            one, other = tangents(unit)
            x, y = in_disc(xi[:, 0], xi[:, 1])
            segment = toward + (x * radius) * one + (y * radius) * other
        arriving = np.ascontiguousarray(segment.T, np.float32)
        if np.ndim(which) > 0 or radius == 0 or self.edge[which] < -1:
            irradiance = irradiance * self.beam(which, segment / size(segment))
            return Sample(irradiance, (irradiance > 0) * 1.0, arriving, 1.0, False)
        irradiance = irradiance * self._mean_beam(which, toward.T, distance)
        weight = np.maximum(self.beam(which, segment / size(segment)), 1e-3)
        weight = np.where(irradiance > 0, weight, 0.0)
        return Sample(irradiance, weight, arriving, 1.0, True)

    def whole(self, which: int, middles: Middles) -> Unoccluded:
        """One lamp from owners that are far from it for their size, above or below their horizon,
        and inside or outside of its beam with all of their points."""
        toward, radius = self.position[which][:, None] - middles.place, self.radius[which]
        distance, reach = size(toward), middles.reach
        unit = toward / distance
        height = dot(toward, middles.normal)
        slack = (radius + reach) / distance
        beam = self.beam(which, unit, -slack)
        known = middles.flat & (distance > radius + np.maximum(FAR * reach, NEAR))
        known &= np.abs(height) > middles.depth(middles.normal)
        known &= beam == self.beam(which, unit, slack)
        irradiance = beam * np.maximum(height / distance, 0) / (distance**2 + radius**2)

        def segments(owners, position, s, t):
            if radius == 0:
                return self.position[which].astype(np.float32) - position
            axes = [radius * axis for axis in tangents(unit[:, owners])]
            return combined(self.position[which], axes, in_disc(s, t), position)

        return Unoccluded(irradiance, known, segments, None)

    def _mean_beam(self, which: int, toward: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """(n,) a soft spot's beam averaged over its disc, for ``toward`` (n, 3) its centre.

        The beam changes along one direction g across the disc only, in which the disc's points are
        spread by 2/π √(1−x²): Gauss-Chebyshev quadrature of the second kind, nodes cos(kπ/(K+1)),
        weights ∝ sin². Where the whole disc lies inside or outside the cone its centre suffices.
        """
        unit, radius = toward / distance[:, None], self.radius[which]
        slack = radius / distance
        result = self.beam(which, unit.T)
        partly = self.beam(which, unit.T, slack) > self.beam(which, unit.T, -slack)
        near = np.flatnonzero(partly)
        along = unit[near] @ self.axis[which]
        across = self.axis[which] - along[:, None] * unit[near]
        across *= radius / np.maximum(length(across), 1e-9)[:, None]
        angle = np.arange(1, NODES + 1) * np.pi / (NODES + 1)
        share = np.sin(angle) ** 2 / np.sum(np.sin(angle) ** 2)
        mean = np.zeros(len(near))
        for x, part in zip(np.cos(angle), share):
            place = toward[near] + x * across
            mean += part * self.beam(which, (place / length(place)[:, None]).T)
        result[near] = mean
        return result

    def beam(self, which, unit: np.ndarray, slack=0.0) -> np.ndarray:
        """Cycles' spot: a smoothstep between the cone's edge and its blended inside, for unit
        directions (3, ...) to the sampled point; ``slack`` is added to the cosine with the axis."""
        edge = self.edge[which]
        if np.max(edge, initial=-2) < -1:  # no spot among them
            return np.ones(unit.shape[1:])
        cosine = slack - dot(unit, self.axis.T[:, which].astype(unit.dtype))
        t = np.clip((cosine - edge) / np.maximum(self.smooth[which], 1e-9), 0, 1)
        return np.where(edge < -1, 1.0, t * t * (3 - 2 * t))

    def strength(self, which, place: np.ndarray, normal: np.ndarray, reach) -> np.ndarray:
        """See ``lights``."""
        kind = place.dtype
        toward = [center[which] - x for center, x in zip(self.position.T.astype(kind), place)]
        square = np.maximum(dot(toward, toward), 1e-30)
        inverse = 1 / np.sqrt(square)
        slack = np.minimum((self.radius.astype(kind)[which] + reach) * inverse, 1) + kind.type(1e-3)
        cosine = dot(toward, normal) * inverse + slack
        rough = self.color.mean(axis=1).astype(kind)[which] * np.maximum(cosine, 0) / square
        if self.edge[which].max() > -1:
            rough *= self.beam(which, np.stack(toward) * inverse, slack)
        return rough

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: some box, centre and half edges (g, 3), has a part in the lamp's cone."""
        toward = center[:, None] - self.position
        distance = np.linalg.norm(toward, axis=2)
        around = np.linalg.norm(half, axis=1)[:, None] + self.radius
        distant = np.maximum(distance, 1e-300)
        cosine = np.einsum("gki,ki->gk", toward, self.axis) / distant
        angle = np.arccos(np.clip(cosine, -1, 1)) - np.arcsin(np.clip(around / distant, 0, 1))
        return ((angle <= np.arccos(np.clip(self.edge, -1, 1))) | (distance <= around)).any(axis=0)

    def emitters(self) -> Emitters:
        """How they shine, roughly: a spot into the half-space before it."""
        power = self.color.mean(axis=1)
        spot = self.edge > -1
        return Emitters(self.position, self.radius, self.axis, np.where(spot, 1, 0.5) * power * 2,
                        np.where(spot, 0, power), ~spot)  # fmt: skip
