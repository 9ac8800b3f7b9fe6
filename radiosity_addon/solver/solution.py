"""Solution: what the solver gives back, per receiver, with the truth about its cost and error."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .passes import Pass


@dataclass(frozen=True)
class Statistics:
    """Figures for the report; see docs/theory.md for the error."""

    elements: int = 0
    rays: int = 0
    iterations: int = 0
    residual: float = 0.0
    target_error: float = 0.0
    estimated_error: float = 0.0
    error_95: float = 0.0  # 95 % of the surface is off by that much at most, estimated
    energy: dict = field(default_factory=dict)  # emitted, absorbed, escaped [W]
    seconds: dict = field(default_factory=dict)  # elements, transport, solve, gather, embree
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Solution:
    """Light at the receivers, (count, 3) float64 each: radiance ``emission``, irradiances
    ``direct`` (lamps, sky, emissive faces) and ``indirect`` (bounced) [W/m²], and the ``diffuse``
    reflectance."""

    emission: np.ndarray
    direct: np.ndarray
    indirect: np.ndarray
    diffuse: np.ndarray
    statistics: Statistics


def compose(solution: Solution, passes: tuple[Pass, ...]) -> np.ndarray:
    """Baked radiance (count, 3) of the asked passes, as Cycles' Diffuse (plus Emit) bake has it.

    Light is irradiance/π times the diffuse reflectance when ``color`` is asked; ``color`` without any
    light is that reflectance itself.
    """
    lighting = [name for name in (Pass.DIRECT, Pass.INDIRECT) if name in passes]
    if lighting:
        result = sum(getattr(solution, name) for name in lighting) / np.pi
        if Pass.COLOR in passes:
            result = result * solution.diffuse
    elif Pass.COLOR in passes:
        result = solution.diffuse.copy()
    else:
        result = np.zeros_like(solution.diffuse)
    return result + solution.emission if Pass.EMIT in passes else result
