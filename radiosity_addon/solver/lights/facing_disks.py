"""Facing disks: point and spot lamps, hard or soft."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import Geometry
from ..geometry.vectors import columns, dot, lengths, tangents
from ..sampling.points import Middles
from ..sampling.sobol import tangent_frames
from ..scene import PointLamp
from .cones import cone_directions, sphere_form_factor
from .distributions import FINE, Distributions, make_distributions
from .light_batch import Leaving, Sample, Unoccluded, chord, combined, in_disk, unknown
from .light_tree import Emitters

NODES = 24  # number [nodes] of the quadrature across a soft spot
FAR = 32  # distance [radii of a footprint]: from it on, curvature across it is < 0.1 %
# Radius [of a lamp's height above the horizon]: all parts of a smaller disk bring about the same.
EVEN = 0.2
NEAR = 1e-3  # distance [unit box] of a lamp: float32 is too coarse for directions to a nearer one


@dataclass(frozen=True)
class FacingDisks:
    """Point and spot lamps: ``color`` radiant intensity [W/sr] in normalized lengths."""

    color: np.ndarray  # (k, 3)
    position: np.ndarray  # (k, 3)
    radius: np.ndarray  # (k,)
    axis: np.ndarray  # (k, 3) direction a spot shines in
    edge: np.ndarray  # (k,) cosine of the cone's half angle; -2 for a point lamp
    smooth: np.ndarray  # (k,) width of the spot's blend, in cosines
    shapes: Distributions | None = None  # how intensity varies with direction; None: it does not

    @property
    def distant(self) -> bool:
        """False."""
        return False

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample the disk of the lamp's radius r that faces the point, as Cycles' soft lamps do.

        Of a distance d it is seen under a half angle σ, sin²σ = r² / (d² + r²), and above the
        horizon brings I cosθ / (d² + r²), cut by it less (``sphere_form_factor``). A soft spot's
        beam is that of the sampled place; its mean over the disk is known beforehand.
        """
        toward = -columns(position)
        toward += np.take(self.position, np.atleast_1d(which), axis=0).T
        normal, distance = columns(normal), lengths(toward)
        radius, unit = self.radius[which], toward / distance
        slope = dot(unit, normal)
        square = distance**2 + radius**2
        if np.all(radius == 0):
            value = np.maximum(slope, 0) / square * self.leaving(which, unit)
            return Sample(value, np.ascontiguousarray(toward.T, np.float32), 1.0)
        direction, ratio = cone_directions(unit, normal, slope, radius**2 / square, xi.T)
        segment = direction * (distance / np.maximum(dot(direction, unit), 1e-30))
        bright = ratio / square
        value = bright * self.leaving(which, direction)
        segment = np.ascontiguousarray(segment.T, np.float32)
        if np.ndim(which) > 0 or self.edge[which] < -1 or self.uneven(which):
            return Sample(value, segment, 1.0)
        factor = sphere_form_factor(slope, radius**2 / square) / radius**2
        mean = self._mean_beam(which, toward, normal, distance)
        known = np.where(slope > radius / np.sqrt(square), factor * mean, value)
        return Sample(value, segment, 1.0, known)

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """One lamp from owners that are far from it for their size and its own, above or below
        their horizon, and inside or outside of its beam with all of their points; one that shines
        unevenly is looked at from each."""
        if self.uneven(which):
            return unknown(middles)
        toward, radius = self.position[which][:, None] - middles.position, self.radius[which]
        distance, extent = lengths(toward), middles.extent
        unit = toward / distance
        height = dot(toward, middles.normal)
        slack = chord(np.minimum((radius + extent) / distance, 1))
        beam = self.beam(which, unit, -slack)
        known = middles.flat & (distance > radius + np.maximum(FAR * extent, NEAR))
        known &= np.abs(height) > middles.depth(middles.normal) + radius
        known &= (height < 0) | (radius < EVEN * height)
        known &= beam == self.beam(which, unit, slack)
        irradiance = beam * np.maximum(height / distance, 0) / (distance**2 + radius**2)

        def segments(
            owners: np.ndarray | slice, position: np.ndarray, s: np.ndarray, t: np.ndarray
        ) -> np.ndarray:
            if radius == 0:
                return self.position[which].astype(np.float32) - position
            axes = [radius * axis for axis in tangents(unit[:, owners])]
            return combined(self.position[which], axes, in_disk(s, t), position)

        def value(
            owners: np.ndarray | slice, segments: np.ndarray, s: np.ndarray, t: np.ndarray
        ) -> np.ndarray:
            along = np.einsum("pkj,jk->pk", segments, middles.normal[:, owners])
            facing = np.einsum("pkj,jk->pk", segments, unit[:, owners])
            square = np.einsum("pkj,pkj->pk", segments, segments, dtype=float)
            return beam[owners] * np.maximum(along, 0) * facing / square**2

        return Unoccluded(irradiance, known, segments, value)

    @property
    def power(self) -> np.ndarray:
        """(k, channels): 4π·intensity, and of a spot the same with the integral of its beam, a
        smoothstep, over the directions; of uneven lamps their mean in directions all over it."""
        beam = np.where(self.edge < -1, 2.0, 1 - self.edge - self.smooth / 2)
        xi = np.stack([(axis.ravel() + 0.5) / FINE for axis in np.indices((FINE, FINE))], 1)
        for light in range(len(beam)):
            if self.uneven(light):
                direction = self._directions(np.full(len(xi), light), xi)
                brightness = self.leaving(np.full(len(xi), light), -direction.T)
                beam[light] = (1 - max(self.edge[light], -1)) * brightness.mean()
        return self.color * (2 * np.pi * beam)[:, None]

    def leave(self, which: np.ndarray, xi: np.ndarray) -> Leaving:
        """Uniformly into the lamps' cones, from the disks across the particles' ways."""
        direction = self._directions(which, xi)
        x, y = self.radius[which] * np.stack(in_disk(xi[:, 2], xi[:, 3]))
        one, other = tangents(np.ascontiguousarray(direction.T))
        power = 2 * np.pi * (1 - np.maximum(self.edge[which], -1)) * self.leaving(which, -direction.T)
        return Leaving(self.position[which] + (x * one + y * other).T, direction, power)

    def cones(self) -> tuple[np.ndarray, np.ndarray]:
        """Those of spots."""
        return np.where(self.edge > -1, 2 * np.pi * (1 - self.edge), np.inf), self.radius

    def _directions(self, which: np.ndarray, xi: np.ndarray) -> np.ndarray:
        """(n, 3) unit, uniform in the lamps' cones, from the first two of ``xi`` (n, m)."""
        edge = np.maximum(self.edge[which], -1)
        z = 1 - (1 - edge) * xi[:, 0]
        flat, azimuth = np.sqrt(np.maximum(1 - z**2, 0)), 2 * np.pi * xi[:, 1]
        local = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], 1)
        return np.einsum("ni,nij->nj", local, tangent_frames(self.axis[which]))

    def _mean_beam(
        self, which: int, toward: np.ndarray, normal: np.ndarray, distance: np.ndarray
    ) -> np.ndarray | float:
        """(n,) a soft spot's beam averaged over its disk, all of it above the horizons of unit
        ``normal`` (3, n); ``toward`` (3, n) runs to its center.

        Directions to it, sinα (cosφ, sinφ) about the center's, are uniform in a disk of radius sinσ
        times the receiver's cosine. The beam changes along one direction g across it only. Along
        that they are spread by 2/π √(1−x²): Gauss-Chebyshev quadrature of the second kind, nodes
        cos(kπ/(K+1)), weights ∝ sin². Across it cosα is even: Gauss's two points, y² = (1−x²)/3.
        """
        unit, sine = toward / distance, np.sqrt(1 / (1 + (distance / self.radius[which]) ** 2))
        result, slack = self.beam(which, unit), chord(sine)
        partly = self.beam(which, unit, slack) > self.beam(which, unit, -slack)
        near = np.flatnonzero(partly)
        unit, sine, normal = unit[:, near], sine[near], normal[:, near]
        across = self.axis[which][:, None] - (self.axis[which] @ unit) * unit
        across /= np.maximum(lengths(across), 1e-9)
        tilt = dot(across, normal) / np.maximum(dot(unit, normal), 1e-30)
        angle = np.arange(1, NODES + 1) * np.pi / (NODES + 1)
        share = np.sin(angle) ** 2 / np.sum(np.sin(angle) ** 2)
        mean, total = np.zeros((2, len(near)))
        for x, part in zip(np.cos(angle), share):
            cosine = np.sqrt(1 - sine**2 * (x * x + (1 - x * x) / 3))
            weight = part * np.maximum(1 + tilt * sine * x / cosine, 0)
            mean += weight * self.beam(which, cosine * unit + sine * x * across)
            total += weight
        result[near] = mean / np.maximum(total, 1e-30)
        return result

    def beam(
        self, which: int | np.ndarray, unit: np.ndarray, slack: float | np.ndarray = 0.0
    ) -> np.ndarray:
        """Cycles' spot: a smoothstep between the cone's edge and its blended inside, for unit
        directions (3, ...) to the sampled point; ``slack`` is added to the cosine with the axis."""
        edge = self.edge[which]
        if np.max(edge, initial=-2) < -1:  # no spot among them
            return np.ones(unit.shape[1:])
        cosine = slack - dot(unit, self.axis.T[:, which].astype(unit.dtype))
        t = np.clip((cosine - edge) / np.maximum(self.smooth[which], 1e-9), 0, 1)
        return np.where(edge < -1, 1.0, t * t * (3 - 2 * t))

    def uneven(self, which: int | np.ndarray) -> bool:
        """Whether the intensity of any of the lights ``which`` varies with direction, but for a
        spot's beam."""
        return self.shapes is not None and self.shapes.uneven(which)

    def leaving(self, which: int | np.ndarray, unit: np.ndarray) -> np.ndarray:
        """(...) the share of the intensity that leaves against unit directions (3, ...), those to
        the sampled point: of the beam and the distribution."""
        beam = self.beam(which, unit)
        return beam * self.shapes.at(which, -unit) if self.uneven(which) else beam

    def importance(
        self, which: np.ndarray, position: np.ndarray, normal: np.ndarray, extent: np.ndarray
    ) -> np.ndarray:
        """See ``LightBatch``."""
        dtype = position.dtype
        toward = [center[which] - x for center, x in zip(self.position.T.astype(dtype), position)]
        square = np.maximum(dot(toward, toward), 1e-30)
        inverse = 1 / np.sqrt(square)
        sine = np.minimum((self.radius.astype(dtype)[which] + extent) * inverse, 1)
        slack = chord(sine) + dtype.type(1e-3)
        cosine = dot(toward, normal) * inverse + slack
        rough = self.color.mean(axis=1).astype(dtype)[which] * np.maximum(cosine, 0) / square
        if self.edge[which].max() > -1:
            rough *= self.beam(which, np.stack(toward) * inverse, slack)
        if self.uneven(which):
            rough *= self.shapes.most(which, -np.stack(toward) * inverse, slack)
        return rough

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: some box, center and half edges (g, 3), has a part in the lamp's cone."""
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


def batch_of_point_lamps(
    lamps: list[PointLamp], geometry: Geometry, batch: type[FacingDisks] = FacingDisks
) -> FacingDisks:
    """A ``batch``, of disks or of spheres, of point and spot lamps."""
    spot = np.array([lamp.axis is not None for lamp in lamps])
    half = np.array([min(lamp.cone, 2 * np.pi) / 2 for lamp in lamps])
    edge = np.where(spot, np.cos(half), -2.0)
    return batch(
        np.array([np.asarray(lamp.intensity, float) / geometry.scale**2 for lamp in lamps]),
        np.array([geometry.normalized(lamp.position) for lamp in lamps]),
        np.array([lamp.radius / geometry.scale for lamp in lamps]),
        np.array([np.asarray((0, 0, -1) if lamp.axis is None else lamp.axis, float) for lamp in lamps]),
        edge,
        np.where(spot, (1 - edge) * np.array([lamp.blend for lamp in lamps]), 1.0),
        make_distributions([lamp.distribution for lamp in lamps]),
    )
