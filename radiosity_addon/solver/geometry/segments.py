"""Segments: straight lines from places on the surface to others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_struct import ArrayStruct


@dataclass(frozen=True)
class Segments(ArrayStruct):
    """From points on the surface to others [scene's length], with the faces' unit normals at both."""

    starts: np.ndarray  # (k, 3)
    start_up: np.ndarray  # (k, 3)
    ends: np.ndarray  # (k, 3)
    end_up: np.ndarray  # (k, 3)
