"""Scaled beam: what of a spot's light goes where if its object is scaled differently along its axes. NumPy only.

Cycles looks at directions in the lamp's own scale: with axes û, v̂, ẑ of the lengths s, the direction ω is (ω·û/s_u, ω·v̂/s_v,
ω·ẑ/s_z), made a unit vector, whose cosine with the lamp's axis falls off by a smoothstep (kernel/light/spot.h).
"""

from __future__ import annotations

import numpy as np

from ..solver.lights.sky import pixel_directions

ACROSS = 128  # number [pixels] across the narrowest side of the beam
FEWEST, MOST = 1024, 2880  # widths [pixels] of the picture, at least and at most; at most, a pixel is an eighth of a degree


def scaled_beam(axes: np.ndarray, cone: float, blend: float) -> np.ndarray:
    """(w / 2, w) float32 in [0, 1], laid out as a ``Sky``'s pixels: the share of its intensity with
    which a spot of the full angle ``cone`` [rad] and a ``blend`` in [0, 1] shines, whose own axes are the columns of ``axes``
    (3, 3). It shines along its -z."""
    width = _width(np.linalg.norm(axes, axis=0), cone)
    directions = pixel_directions(width // 2, width)
    across, up, back = np.moveaxis(directions @ (axes / (axes**2).sum(axis=0)), -1, 0)
    cosine = -back / np.sqrt(across**2 + up**2 + back**2)
    edge = np.cos(min(cone, 2 * np.pi) / 2)
    step = np.clip((cosine - edge) / max((1 - edge) * blend, 1e-9), 0, 1)
    return (step * step * (3 - 2 * step)).astype(np.float32)


def widest_cone(scale: np.ndarray, cone: float) -> float:
    """The full angle [rad] of a round cone around what a spot of the full angle ``cone`` [rad] and the ``scale`` (3,) lights."""
    pixel = 2 * np.pi / _width(scale, cone)  # the picture is linear between middles of pixels
    return min(_angle(scale[:2].max() / scale[2], cone) + 2 * pixel, 2 * np.pi)


def _width(scale: np.ndarray, cone: float) -> int:
    """Of the picture [pixels], an even number."""
    narrowest = _angle(scale[:2].min() / scale[2], cone)
    return 2 * int(np.clip(np.pi * ACROSS / narrowest, FEWEST / 2, MOST / 2))


def _angle(stretch: float, cone: float) -> float:
    """The full angle [rad] of a ``cone`` [rad] that is stretched across its axis; from half of all directions on, all."""
    return 2 * float(np.arctan(np.tan(cone / 2) * stretch)) if cone < np.pi else 2 * np.pi
