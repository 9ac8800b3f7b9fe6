"""How much of a surface its image holds: the rest lies outside of the tile or has no UVs. NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..figures import percent
from ..solver.geometry.planar import cell_areas, doubled_areas
from ..solver.receivers import Receivers

FLAT = 1e-12  # area [of the tile]: a triangle with less UV area has none
NOTABLE = 1e-3  # share [of the surface]: where more gets no texel, a warning says so


@dataclass(frozen=True)
class Missed:
    """Shares of a surface that get no texel: with UVs outside the 0-1 tile, with UVs that are
    infinite or not a number, and without area in the UV map."""

    outside: float = 0.0
    unreal: float = 0.0
    flat: float = 0.0


def missed_shares(receivers: Receivers, uv: np.ndarray, start: int, area: np.ndarray) -> Missed:
    """What gets no texel.

    ``uv`` (n, 3, 2) and ``area`` (n,) [m²] of the scene triangles from ``start`` on. The cells of receivers
    in a triangle are shares of it that add up to the part that lies in the tile.
    """
    total = float(area.sum())
    if total == 0:
        return Missed()
    shares = cell_areas(receivers.corners, receivers.square)
    inside = np.bincount(receivers.triangle - start, shares, len(uv))
    real = np.isfinite(uv).all(axis=(1, 2))
    extent = np.abs(doubled_areas(np.where(real[:, None, None], uv, 0.0))) / 2
    flat = real & (extent <= FLAT)
    outside = np.where(real & ~flat, np.clip(1 - inside, 0, 1), 0.0)
    return Missed(*(float((share * area).sum() / total) for share in (outside, ~real, flat)))


def missed_warning(name: str, missed: Missed, modifiers: tuple[str, ...]) -> str:
    """One sentence on what the image of ``name`` lacks; "" when it lacks next to nothing."""
    sentences = []
    if missed.outside > NOTABLE:
        sentences.append(
            f"{percent(missed.outside)} of its surface has UVs outside the tile from 0 to 1 (or on other "
            "UDIM tiles) and gets no texel: move the UVs inside, or bake to a map made for it"
        )
    cause = f" (its modifiers make faces: {', '.join(modifiers)})" if modifiers else ""
    if missed.unreal > NOTABLE:
        sentences.append(
            f"{percent(missed.unreal)} of its surface has UVs that are infinite or not a number{cause}, and gets no "
            "texel: unwrap it, or bake to a map made for it"
        )
    if missed.flat > NOTABLE:
        sentences.append(
            f"{percent(missed.flat)} of its surface has no area in the UV map{cause}, and gets no texel: give it UVs, "
            "apply the modifiers and bake again, or bake vertex colors"
        )
    return f"{name!r}: " + "; ".join(sentences) if sentences else ""
