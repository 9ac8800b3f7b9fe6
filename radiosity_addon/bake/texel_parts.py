"""Texel parts: how much of each texel lies on the surface, and where the middle of that is; and
texels that cannot show what they should, because islands share them or are too thin. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..figures import percent
from ..solver.receivers import Receivers
from .clip import doubled_areas
from .shown import Sheets

NOTABLE = 0.01  # share of the surface: of fewer texels that cannot be fitted nobody is told
TOUCH = 0.01  # of a texel: an island that has less of one does not count there
NONE, SEVERAL = -1, -2  # codes for texels without, and with more than one, island
WHOLE = 0.999  # share [of a texel] covered: its mean is its value, and its island is not thinner


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
        middle = [np.bincount(owner, self.area * place, count) / total for place in self.middle.T]
        return share, np.stack(middle, 1)


def texel_parts(receivers: Receivers, uv: np.ndarray, triangle: np.ndarray) -> TexelParts:
    """Of ``receivers``, whose cells lie in triangles ``uv`` (n, 3, 2) [texels]; ``triangle``
    (n_cells,) is which of these."""
    corners, square = receivers.corners, receivers.square
    scale = np.abs(doubled_areas(uv))[triangle]
    area = np.abs(doubled_areas(corners)) * np.where(square, 1.0, 0.5) * scale
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    place = corners[:, 0] + np.where(square, 0.5, 1 / 3)[:, None] * (u + v)
    a, b, c = uv[triangle].transpose(1, 0, 2)
    return TexelParts(area, a + place[:, :1] * (b - a) + place[:, 1:] * (c - a))


def anchored_texels(
    sheets: Sheets, texel: np.ndarray, whole: np.ndarray, cell_texel: np.ndarray, island: np.ndarray
) -> np.ndarray:
    """(k,) bool: of ``texel`` (k,), those of one island alone, beside a ``whole`` (k,) bool one of that
    island and none of another island: only there is the light around known to be that of one surface,
    and the picture between texels to be its own.

    ``cell_texel`` and ``island`` (c,) are of cells.
    """
    owner = np.full(int(sheets.first[-1]), NONE)
    owner[cell_texel] = island
    owner[cell_texel[owner[cell_texel] != island]] = SEVERAL
    inside = np.full(int(sheets.first[-1]), NONE)
    inside[texel[whole]] = owner[texel[whole]]
    own = owner[texel]
    beside, alone = np.zeros(len(texel), bool), own != SEVERAL
    sheet, row, column = sheets.place(texel)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = sheets.texel(sheet, row + dy, column + dx)
            there = near >= 0
            beside |= there & (inside[near] == own)
            alone &= ~there | (owner[near] == NONE) | (owner[near] == own)
    return beside & alone


def unfit_shares(
    texel: np.ndarray, island: np.ndarray, part: np.ndarray, surface: np.ndarray
) -> tuple[int, float, float]:
    """(texels, share, thin): how many texels islands share or are of islands thinner than a texel,
    and the shares of the surface that these have.

    ``texel``, ``island``, ``part`` [texels] and ``surface`` [m²] (c,) are of cells.
    """
    order = np.lexsort((island, texel))
    texel, island, part, surface = (x[order] for x in (texel, island, part, surface))
    new = (np.diff(texel, prepend=-1) != 0) | (np.diff(island, prepend=-1) != 0)
    first = np.flatnonzero(new)
    if not len(first):
        return 0, 0.0, 0.0
    texel, island = texel[first], island[first]
    part, surface = (np.add.reduceat(x, first) for x in (part, surface))
    number = np.unique(texel, return_inverse=True)[1]
    several = np.bincount(number, part > TOUCH) > 1
    shared = several[number]
    most = np.zeros(int(island.max()) + 1)
    np.maximum.at(most, island, part)
    thin = (most < WHOLE)[island] & ~shared
    total = max(float(surface.sum()), 1e-300)
    count = len(np.unique(texel[shared | thin]))
    return count, float(surface[shared].sum()) / total, float(surface[thin].sum()) / total


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
