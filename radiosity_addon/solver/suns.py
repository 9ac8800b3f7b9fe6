"""Suns: distant discs, that is sun lamps and the bright spots of a sky.

Depends on ``lights``, ``light_tree``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .light_tree import Emitters
from .lights import Sample, disc

FAR = 1e3  # scenes away: where a tree of lights thinks suns are


@dataclass(frozen=True)
class Suns:
    """Distant discs: ``color`` the irradiance on a surface that faces them."""

    color: np.ndarray  # (k, 3)
    toward: np.ndarray  # (k, 3) unit, to the sun
    radius: np.ndarray  # (k,) tangent of the half angle

    def sample(
        self, which, position: np.ndarray, normal: np.ndarray, xi: np.ndarray, per: int = 1
    ) -> Sample:
        """Sample a direction in the disc."""
        toward = np.broadcast_to(self.toward[which], position.shape)
        direction = toward + disc(toward, xi) * np.reshape(self.radius[which], (-1, 1))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        cosine = np.maximum(np.einsum("ij,ij->i", direction, normal), 0)
        return Sample(cosine, (cosine > 0) * 1.0, direction.astype(np.float32), np.inf, False)

    def strength(self, which, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(n,) rough irradiance of lights at points, above 0 wherever any may arrive."""
        cosine = np.einsum("...j,...j->...", self.toward[which], normal) + self.radius[which] + 1e-3
        return self.color.mean(axis=1)[which] * np.maximum(cosine, 0)

    def reaches(self, center: np.ndarray, half: np.ndarray) -> np.ndarray:
        """(k,) bool: always."""
        return np.full(len(self.color), len(center) > 0)

    def emitters(self) -> Emitters:
        """How they shine, roughly: into all directions, from far away."""
        power = self.color.mean(axis=1) * FAR**2
        none = np.zeros(len(power))
        return Emitters(self.toward * FAR, none, self.toward, power, power, none == 0)
