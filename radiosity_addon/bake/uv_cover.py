"""How much of a surface its image holds: the rest lies outside of the tile or has no UVs. NumPy."""

from __future__ import annotations

import numpy as np

from ..figures import percent
from ..solver.geometry.planar import cell_areas, doubled_areas
from ..solver.receivers import Receivers

FLAT = 1e-12  # area [of the tile]: a triangle with less UV area has none
NOTABLE = 1e-3  # share [of the surface]: what lacks more is warned of


def missed_shares(
    receivers: Receivers, uv: np.ndarray, start: int, area: np.ndarray
) -> tuple[float, float]:
    """Shares of the surface that get no texel: (UVs outside the 0-1 tile, no UV area at all).

    ``uv`` (n, 3, 2) and ``area`` (n,) [m²] of the scene triangles from ``start`` on. A receiver's
    cells are given in a triangle's own coordinates, so that their areas, doubled, add up to the
    part of the triangle that lies in the tile.
    """
    total = float(area.sum())
    if total == 0:
        return 0.0, 0.0
    cells = cell_areas(receivers.corners, receivers.square)
    inside = np.bincount(receivers.triangle - start, cells, len(uv))
    extent = np.abs(doubled_areas(np.asarray(uv, float))) / 2
    flat = ~(extent > FLAT)  # NaN too
    outside = np.where(flat, 0.0, np.clip(1 - inside, 0, 1))
    return float((outside * area).sum() / total), float(area[flat].sum() / total)


def missed_warning(name: str, outside: float, flat: float, modifiers: tuple[str, ...]) -> str:
    """One sentence on what the image of ``name`` lacks; "" when it lacks next to nothing."""
    reasons = []
    if outside > NOTABLE:
        reasons.append(
            f"{percent(outside)} of its surface has UVs outside the tile from 0 to 1 (or on other "
            "UDIM tiles) and gets no texel: move them inside, or bake to a map made for it"
        )
    if flat > NOTABLE:
        cause = f" that its modifiers make ({', '.join(modifiers)})" if modifiers else ""
        reasons.append(
            f"{percent(flat)} of its surface are faces without area in the UV map{cause} and get "
            "no texel: give them UVs, apply the modifiers and bake again, or bake vertex colors"
        )
    return f"{name!r}: " + "; ".join(reasons) if reasons else ""
