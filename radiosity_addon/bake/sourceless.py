"""Sourceless: the share of a surface whose faces modifiers make without a source among the user's faces, so that
they show no baked color. NumPy only."""

from __future__ import annotations

import numpy as np

from ..figures import percent
from .exported_object import CornerMap

NOTABLE = 1e-3  # share [of the surface]: where more has no color, a warning says so


def sourceless_share(corners: CornerMap, area: np.ndarray) -> float:
    """Share of the surface of triangles, ``area`` (n,) [m²], whose corners have no weights: a third
    of a triangle for each."""
    without = (np.diff(corners.start) == 0).reshape(-1, 3).mean(axis=1)
    return float(without @ area) / max(float(area.sum()), 1e-300)


def sourceless_warning(name: str, share: float, modifiers: tuple[str, ...]) -> str:
    """One sentence on the faces of ``name`` that get no color; "" for next to none."""
    if share <= NOTABLE:
        return ""
    cause = f" ({', '.join(modifiers)})" if modifiers else ""
    return (
        f"{name!r}: {percent(share)} of its surface consists of faces that its modifiers{cause} create without a source "
        "face. They get no baked colors, and Blender shows most of them white: apply the modifiers and bake again"
    )
