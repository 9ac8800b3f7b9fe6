"""Sourceless: how much of a surface shows colors of the user's corners: faces that modifiers make of
nothing show none. NumPy only."""

from __future__ import annotations

import numpy as np

from ..figures import percent
from .exported_object import CornerMap

NOTABLE = 1e-3  # share [of the surface]: what lacks more is warned of


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
        f"{name!r}: {percent(share)} of its surface are faces that its modifiers{cause} make of "
        "none of its own, and show no light, but what Blender puts there, white as a rule: apply "
        "the modifiers and bake again"
    )
