"""Scaled beam: what of a spot's light goes where if its object is scaled differently along its axes. NumPy only.

Cycles looks at directions in the lamp's own scale: with axes û, v̂, ẑ of the lengths s, the direction ω is (ω·û/s_u, ω·v̂/s_v,
ω·ẑ/s_z), made a unit vector, whose cosine with the lamp's axis falls off by a smoothstep (kernel/light/spot.h).
"""

from __future__ import annotations

import numpy as np

from ..solver.lights.sky import pixel_directions

WIDTH = 2880  # width [pixels] of the picture: an eighth of a degree each


def scaled_beam(axes: np.ndarray, cone: float, blend: float) -> np.ndarray:
    """(WIDTH / 2, WIDTH) float32 in [0, 1], laid out as ``solver.scene.PointLamp.distribution``: the share of its intensity with
    which a spot of the full angle ``cone`` [rad] and a ``blend`` in [0, 1] shines, whose own axes are the columns of ``axes``
    (3, 3). It shines along its -z."""
    directions = pixel_directions(WIDTH // 2, WIDTH)
    across, up, back = np.moveaxis(directions @ (axes / (axes**2).sum(axis=0)), -1, 0)
    cosine = -back / np.sqrt(across**2 + up**2 + back**2)
    edge = np.cos(min(cone, 2 * np.pi) / 2)
    step = np.clip((cosine - edge) / max((1 - edge) * blend, 1e-9), 0, 1)
    return (step * step * (3 - 2 * step)).astype(np.float32)


def widest_cone(scale: np.ndarray, cone: float) -> float:
    """The full angle [rad] of a round cone around what a spot of the full angle ``cone`` and the ``scale`` (3,) lights."""
    if cone >= np.pi:
        return 2 * np.pi
    pixel = 2 * np.pi / WIDTH
    return min(2 * (float(np.arctan(np.tan(cone / 2) * scale[:2].max() / scale[2])) + pixel), 2 * np.pi)
