"""From the file's working space to Rec.709, the primaries of glTF and of PNG files. bpy."""

from __future__ import annotations

import numpy as np


def to_rec709() -> np.ndarray:
    """(3, 3) float64 to multiply rows of linear colors with, by Blender's color management."""
    from mathutils import Color

    return np.array([Color(row).from_scene_linear_to_rec709_linear()[:] for row in np.eye(3)])
