"""Balls: point and spot lamps whose soft falloff is off: glowing spheres, not facing discs.

Seen whole from a distance d such a lamp brings I cosθ / d², however large it is; partly below the
horizon the part above; from inside the same everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import dot
from ..sampling.points import Middles
from ..sampling.sobol import cosine_directions, tangent_frames
from .facing_discs import FacingDiscs
from .light_batch import Sample, Unoccluded, length, partly_above, unknown


@dataclass(frozen=True)
class SphereLights(FacingDiscs):
    """Spheres of constant radiance I / πr² (a spot's: within its beam), radius above 0."""

    def sample(
        self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample the solid angle of the ball, or from inside it the hemisphere, as Cycles does."""
        toward = self.position[which] - position
        distance, radius = length(toward), self.radius[which]
        inside = distance <= radius
        sine = np.where(inside, 1, np.minimum(radius / distance, 1)) ** 2
        drop = sine / (1 + np.sqrt(1 - sine))  # 1 − cos of the half angle it is seen under
        z, turn = 1 - drop * xi[:, 0], 2 * np.pi * xi[:, 1]
        flat = np.sqrt(np.maximum(1 - z * z, 0))
        local = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], 1)
        axis = np.where(inside[:, None], normal, toward / distance[:, None])
        local = np.where(inside[:, None], cosine_directions(xi), local)
        direction = np.einsum("ni,nij->nj", local, tangent_frames(axis))
        along = np.einsum("ij,ij->i", direction, toward)
        chord = np.sqrt(np.maximum(radius**2 - distance**2 + along**2, 0))
        segment = (np.maximum(along + np.where(inside, chord, -chord), 0)[:, None] * direction)
        cosine = np.maximum(np.einsum("ij,ij->i", direction, normal), 0)
        beam = np.where(inside, 1, self.beam(which, direction.T))
        segment = segment.astype(np.float32)
        if np.ndim(which) > 0 or self.edge[which] >= -1:
            value = np.where(inside, 1, 2 * drop * cosine) * beam / radius**2
            return Sample(value, (value > 0) * 1.0, segment, 1.0, False)
        slope = np.einsum("ij,ij->i", toward, normal) / distance
        whole = np.where(inside, 1, ball_form_factor(slope, sine)) / radius**2
        weight = np.where(inside, 1, cosine)
        return Sample(whole, np.where(whole > 0, weight, 0), segment, 1.0, True)

    def whole(self, which: int, middles: Middles) -> Unoccluded:
        """Looked at from every point."""
        return unknown(middles)

    def strength(self, which, place: np.ndarray, normal: np.ndarray, reach) -> np.ndarray:
        """See ``lights``."""
        toward = np.stack([center[which] - x for center, x in zip(self.position.T, place)])
        square = np.maximum(dot(toward, toward), 1e-30)
        distance, radius = np.sqrt(square), self.radius[which] + reach
        slack = np.minimum(radius / distance, 1) + 1e-3
        facing = dot(toward, normal) / distance
        beam = self.beam(which, toward / distance, slack)
        inside = square <= radius**2
        rough = np.where(inside, 1, partly_above(facing, slack) * beam)
        return self.color.mean(axis=1)[which] * rough / np.maximum(square, radius**2)


def ball_form_factor(cosine: np.ndarray, sine_square: np.ndarray) -> np.ndarray:
    """(n,) share of the hemisphere's cosine-weighted directions that meet a sphere seen under a
    half angle σ, sin²σ in (0, 1], whose centre lies at ``cosine`` from the normal; horizon clipped
    (Snyder 1996, "Area light sources for real-time graphics", in the form of Lagarde & de
    Rousiers 2014, eq. 25)."""
    cut = cosine**2 < sine_square
    result = np.where(cut, 0.0, sine_square * np.maximum(cosine, 0))
    c, s2 = cosine[cut], sine_square[cut]
    sine = np.sqrt(np.maximum(1 - c * c, 1e-30))
    x = np.sqrt(np.maximum(1 / s2 - 1, 0))
    y = np.clip(-x * c / sine, -1, 1)
    w = sine * np.sqrt(1 - y * y)
    result[cut] = ((c * np.arccos(y) - x * w) * s2 + np.arctan2(w, x)) / np.pi
    return np.maximum(result, 0)
