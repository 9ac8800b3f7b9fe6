"""Solves that are compared with exact solutions."""

from __future__ import annotations

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import Scene
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from verification import meshes

ALL = ("emit", "direct", "indirect", "color")
SHARP = Settings(error=0.003)


def radiosity(
    scene: Scene, receivers: Receivers | None = None, settings: Settings = SHARP
) -> np.ndarray:
    """(count,) B of the first channel, one receiver a triangle unless given."""
    solution = solve(scene, receivers or meshes.triangle_receivers(scene), settings)
    return np.pi * compose(solution, ALL)[:, 0]


def deviation(found: np.ndarray, expected: np.ndarray) -> float:
    """The largest relative one."""
    return np.abs(found / expected - 1).max()
