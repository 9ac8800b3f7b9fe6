"""Texel parts: the share of each texel that lies on the surface, the middle of that part, and the island it belongs
to. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.geometry.planar import cell_areas, cell_middles, doubled_areas
from ..solver.receivers import Receivers
from .shown import SEEN, Sheets, Stencils

NONE, SEVERAL = -1, -2  # codes [islands] of texels without, and with more than one, island
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
    """The parts of ``receivers``, whose cells lie in triangles ``uv`` (n, 3, 2) [texels]; ``triangle`` (n_cells,) int
    is which of these."""
    corners, square = receivers.corners, receivers.square
    scale = np.abs(doubled_areas(uv))[triangle]
    area = cell_areas(corners, square) / 2 * scale
    middle = cell_middles(corners, square)
    a, b, c = uv[triangle].transpose(1, 0, 2)
    return TexelParts(area, a + middle[:, :1] * (b - a) + middle[:, 1:] * (c - a))


def anchored_texels(
    sheets: Sheets, texel: np.ndarray, covered: np.ndarray, cell_texel: np.ndarray, island: np.ndarray
) -> np.ndarray:
    """(k,) bool: which of ``texel`` (k,) int belong to one island alone, have a texel of that island beside them that
    is ``covered`` (k,) bool, and none of another island. Only there is the light around known to be of one surface,
    and does the picture between texels show this surface alone.

    ``cell_texel`` and ``island`` (c,) int are the texel and the island of each cell.
    """
    owner = islands_of_texels(sheets, cell_texel, island)
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


def islands_of_texels(sheets: Sheets, texel: np.ndarray, island: np.ndarray) -> np.ndarray:
    """(n,) the island of each texel of the images, from those of cells (c,); or NONE, or SEVERAL."""
    owner = np.full(sheets.count, NONE)
    owner[texel] = island
    owner[texel[owner[texel] != island]] = SEVERAL
    return owner


def shows_own(
    sheets: Sheets, points: Stencils, island: np.ndarray, cell_texel: np.ndarray, cell_island: np.ndarray
) -> np.ndarray:
    """(k,) bool: the picture at ``points`` (k,) on borders of ``island`` (k,) int mixes in no texel of another
    island. So it shows the light of that island, or may be made to.

    ``cell_texel`` and ``cell_island`` (c,) int are the texel and the island of each cell.
    """
    owner = islands_of_texels(sheets, cell_texel, cell_island)[points.texel]
    return ((owner == NONE) | (owner == island[:, None]) | (points.weight <= SEEN)).all(1)
