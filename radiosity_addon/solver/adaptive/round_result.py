"""Round result: what a replicate tells of a round, and of its linear system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..gather.lighting import Lighting


@dataclass(frozen=True)
class SolveFigures:
    """Figures of a replicate's linear system: unknowns, iterations, residual, seconds it took."""

    unknowns: int
    iterations: int
    residual: float
    seconds: float


@dataclass(frozen=True)
class RoundResult:
    """What a replicate knows after a round: all its light so far."""

    light: Lighting
    figures: SolveFigures
    uncorrected: np.ndarray | None  # (count,) float32: squared relative bias that is not corrected
    # Relative bias, root mean square, that paths along the residual found on elements; and the share of
    # what rows' rays met that are elements.
    found_on_elements: float = 0.0
    share_of_elements: float = 0.0
