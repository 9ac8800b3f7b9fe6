"""Far polygons: flat lights that light only what is far from them for their size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import row_squares
from .light_batch import Sample
from .polygons import Polygons


@dataclass(frozen=True)
class FarPolygons(Polygons):
    """Polygons each of which lights points from a distance ``nearest`` (k,) [unit box] on."""

    nearest: np.ndarray

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """See ``Polygons``. Places nearer than that bring nothing."""
        found = super().sample(which, position, normal, xi)
        return found.darkened(row_squares(found.segment.astype(float)) <= self.nearest[which] ** 2)
