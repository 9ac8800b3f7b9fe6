"""Texel parts: how much of each texel lies on the surface, and where the middle of that is; and
texels that cannot show what they should, because islands share them or are too thin. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..figures import percent
from ..solver.geometry.planar import cell_areas, cell_middles, doubled_areas
from ..solver.receivers import Receivers
from .shown import Sheets

NOTABLE = 0.01  # share [of the surface] of texels that cannot be fitted: less is not warned of
TOUCH = 0.01  # share [of a texel]: an island that has less of one does not count there
NONE, SEVERAL = -1, -2  # codes [islands] of texels without, and with more than one, island
# Directions [quarters of a texel]: up and right of its middle.
QUARTERS = (-1, -1), (-1, 1), (1, -1), (1, 1)
COVERED = 0.999  # share [of a texel] covered: its mean is its value, and its island is not thinner


@dataclass(frozen=True)
class TexelParts:
    """Cells of receivers in an image: ``area`` (c,) [texels] and ``middle`` (c, 2) [texels]."""

    area: np.ndarray
    middle: np.ndarray

    def of_receivers(self, receivers: Receivers) -> tuple[np.ndarray, np.ndarray]:
        """(count,) share of the texel and (count, 2) the middle of its part."""
        owner, count = receivers.receiver, receivers.count
        share = np.bincount(owner, self.area, count)
        total = np.maximum(share, 1e-300)
        middle = [np.bincount(owner, self.area * x, count) / total for x in self.middle.T]
        return share, np.stack(middle, 1)


def texel_parts(receivers: Receivers, uv: np.ndarray, triangle: np.ndarray) -> TexelParts:
    """Of ``receivers``, whose cells lie in triangles ``uv`` (n, 3, 2) [texels]; ``triangle``
    (n_cells,) is which of these."""
    corners, square = receivers.corners, receivers.square
    scale = np.abs(doubled_areas(uv))[triangle]
    area = cell_areas(corners, square) / 2 * scale
    middle = cell_middles(corners, square)
    a, b, c = uv[triangle].transpose(1, 0, 2)
    return TexelParts(area, a + middle[:, :1] * (b - a) + middle[:, 1:] * (c - a))


def anchored_texels(
    sheets: Sheets, texel: np.ndarray, covered: np.ndarray, cell_texel: np.ndarray, island: np.ndarray
) -> np.ndarray:
    """(k,) bool: of ``texel`` (k,), those of one island alone, beside a ``covered`` (k,) bool one of that
    island and none of another island: only there is the light around known to be that of one surface,
    and the picture between texels to be its own.

    ``cell_texel`` and ``island`` (c,) int are the texel and the island of each cell.
    """
    owner = _owners(sheets, cell_texel, island)
    inside = np.full(sheets.count, NONE)
    inside[texel[covered]] = owner[texel[covered]]
    own = owner[texel]
    beside, alone = np.zeros(len(texel), bool), own != SEVERAL
    sheet, row, column = sheets.locate(texel)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = sheets.texel(sheet, row + dy, column + dx)
            there = near >= 0
            beside |= there & (inside[near] == own)
            alone &= ~there | (owner[near] == NONE) | (owner[near] == own)
    return beside & alone


def _owners(sheets: Sheets, texel: np.ndarray, island: np.ndarray) -> np.ndarray:
    """(n,) the island of each texel of the images, from those of cells (c,); or NONE, or SEVERAL."""
    owner = np.full(sheets.count, NONE)
    owner[texel] = island
    owner[texel[owner[texel] != island]] = SEVERAL
    return owner


def crowded_shares(
    sheets: Sheets, parts: TexelParts, texel: np.ndarray, island: np.ndarray
) -> np.ndarray:
    """(c,) of each cell the share where the picture between texels is mixed with a texel of another
    island: in each quarter of a texel it is that of this texel and of three around.

    ``texel`` and ``island`` (c,) int are of cells; those of half a texel or less are taken to lie where
    their middles do, larger ones all over it.
    """
    owner = _owners(sheets, texel, island)
    sheet, row, column = sheets.locate(texel)
    mixed = np.zeros((4, len(texel)), bool)
    for dy, dx in ((y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y):
        near = sheets.texel(sheet, row + dy, column + dx)
        other = (near >= 0) & (owner[near] != NONE) & (owner[near] != SEVERAL)
        other &= owner[near] != island
        for quarter, (up, right) in enumerate(QUARTERS):
            if dy in (0, up) and dx in (0, right):
                mixed[quarter] |= other
    x, y = (parts.middle - np.stack([column, row], 1)).T
    own = mixed[2 * (y > 0.5) + (x > 0.5), np.arange(len(texel))]
    return np.where(parts.area > 0.5, mixed.mean(axis=0), own)


def unfit_shares(
    texel: np.ndarray, island: np.ndarray, part: np.ndarray, surface: np.ndarray,
    crowded: np.ndarray,
) -> tuple[int, float, float]:
    """(texels, share, thin): how many texels islands share, are mixed with those of others, or are of
    islands thinner than a texel; and the shares of the surface that the former, and the last, have.

    ``texel``, ``island``, ``part`` [texels], ``surface`` [m²] and the share of it that is ``crowded``
    (c,) are of cells.
    """
    order = np.lexsort((island, texel))
    columns = texel, island, part, surface, crowded * surface
    texel, island, part, surface, crowded = (x[order] for x in columns)
    new = (np.diff(texel, prepend=-1) != 0) | (np.diff(island, prepend=-1) != 0)
    first = np.flatnonzero(new)
    if not len(first):
        return 0, 0.0, 0.0
    texel, island = texel[first], island[first]
    part, surface, crowded = (np.add.reduceat(x, first) for x in (part, surface, crowded))
    number = np.unique(texel, return_inverse=True)[1]
    several = np.bincount(number, part > TOUCH) > 1
    shared = several[number]
    most = np.zeros(int(island.max()) + 1)
    np.maximum.at(most, island, part)
    thin = (most < COVERED)[island] & ~shared
    close = np.where(shared, surface, np.where(thin, 0.0, crowded))
    total = max(float(surface.sum()), 1e-300)
    count = len(np.unique(texel[(close > 0) | thin]))
    return count, float(close.sum()) / total, float(surface[thin].sum()) / total


def unfit_warning(name: str, texels: int, shared: float, thin: float) -> str:
    """One sentence on the texels of ``name`` that cannot show its light; "" for next to none."""
    if shared + thin < NOTABLE:
        return ""
    causes = []
    if shared >= NOTABLE / 2:
        causes.append(f"islands less than a texel apart ({percent(shared)} of the surface)")
    if thin >= NOTABLE / 2:
        causes.append(f"islands thinner than a texel ({percent(thin)})")
    return (
        f"{name!r}: {texels} texels could not be fitted to the light beside seams: its UV map has "
        + " and ".join(causes)
        + "; bake more texels, or lay the map out with fewer islands and wider gaps"
    )
