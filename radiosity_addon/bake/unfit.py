"""Unfit: texels that cannot show what they should, because islands share them, lie too near, or are too thin.
NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..figures import percent, quoted
from ..solver.array_struct import ArrayStruct
from .shown import Sheets
from .texel_parts import COVERED, NONE, SEVERAL, TexelParts, islands_of_texels

HALF_TEXEL = 0.5 + 1e-6  # part [texels]: one up to it lies in one quarter of its texel, half a texel with rounding, too
NOTABLE = 0.01  # share [of the surface] of texels that cannot be fitted, from which on a warning says so
TOUCH = 0.01  # share [of a texel]: an island that has less of one does not count there
# Distance [texels] to others' texels: a texel of two islands may be known as one's where the other's are of another part.
BORDER = 2
# Directions [quarters of a texel]: up and right of its middle.
QUARTERS = (-1, -1), (-1, 1), (1, -1), (1, 1)


@dataclass(frozen=True)
class UnfitCells(ArrayStruct):
    """Cells (c,): the number of the texel, the island, its ``part`` [texels] and ``surface`` [m²], and the share of it
    that is ``crowded``."""

    texel: np.ndarray
    island: np.ndarray
    part: np.ndarray
    surface: np.ndarray
    crowded: np.ndarray


class UnfitTexels:
    """Counts texels that islands share, that are mixed with those of others, or that are of islands thinner than a
    texel. Texels may come in parts, each texel's cells at once. ``target`` (n,) int is whose each island is."""

    def __init__(self, target: np.ndarray):
        self._target, n = target, len(target)
        self._most = np.zeros(n)  # [texels] the largest part of one that each island has
        self._texels = np.zeros((3, n))  # shared, alone, and of these crowded, by the island that has most of each
        self._surface = np.zeros((3, n))  # [m²] the same

    def add(self, cells: UnfitCells) -> None:
        """Count these, too."""
        if not len(cells.texel):
            return
        group = cells.texel * (int(self._target.max()) + 1) + self._target[cells.island]
        cells, group = _by_island(cells, group)
        number = np.unique(group, return_inverse=True)[1]
        shared = (np.bincount(number, cells.part > TOUCH) > 1)[number]
        owner = np.diff(number, append=-1) != 0
        np.maximum.at(self._most, cells.island, cells.part)
        counted = owner & shared, owner & ~shared, owner & ~shared & (cells.crowded > 0)
        surface = shared * cells.surface, ~shared * cells.surface, ~shared * cells.crowded * cells.surface
        for table, rows in ((self._texels, counted), (self._surface, surface)):
            table += [np.bincount(cells.island, row, len(self._target)) for row in rows]

    def shares(self, target: int) -> tuple[int, float, float]:
        """(texels, share, thin) of a target: the number of its texels that cannot be fitted; the share of its surface
        in texels that islands share or mix; the share of its surface in texels of islands thinner than a texel."""
        own = self._target == target
        thin = self._most[own] < COVERED
        texels, surface = self._texels[:, own], self._surface[:, own]
        total = max(float(surface[:2].sum()), 1e-300)
        count = texels[0].sum() + np.where(thin, texels[1], texels[2]).sum()
        close = surface[0].sum() + np.where(thin, 0, surface[2]).sum()
        return int(count), float(close) / total, float(surface[1, thin].sum()) / total


def _by_island(cells: UnfitCells, group: np.ndarray) -> tuple[UnfitCells, np.ndarray]:
    """Cells of one island in one ``group`` (c,) int joined to one cell; and the groups of these cells. Both are in
    the order of groups, the largest part of each group last."""
    order = np.lexsort((cells.island, group))
    cells, group = cells.take(order), group[order]
    first = np.flatnonzero((np.diff(group, prepend=-1) != 0) | (np.diff(cells.island, prepend=-1) != 0))
    part, surface, crowded = (
        np.add.reduceat(x, first) for x in (cells.part, cells.surface, cells.crowded * cells.surface)
    )
    share = crowded / np.maximum(surface, 1e-300)
    order = np.lexsort((part, group[first]))
    cells = UnfitCells(cells.texel[first], cells.island[first], part, surface, share)
    return cells.take(order), group[first][order]


def on_borders(sheets: Sheets, texel: np.ndarray, island: np.ndarray) -> np.ndarray:
    """(c,) bool: which cells lie in a texel of several islands, or within BORDER texels of a texel that is not of
    their own island alone."""
    owner, found = islands_of_texels(sheets, texel, island), np.zeros(len(texel), bool)
    sheet, row, column = sheets.locate(texel)
    for dy in range(-BORDER, BORDER + 1):
        for dx in range(-BORDER, BORDER + 1):
            near = sheets.texel(sheet, row + dy, column + dx)
            found |= (near < 0) | (owner[near] != island)
    return found


def crowded_shares(
    sheets: Sheets, parts: TexelParts, texel: np.ndarray, island: np.ndarray
) -> np.ndarray:
    """(c,) float64: the share of each cell where the picture between texels mixes in a texel of another island. In
    each quarter of a texel the picture is made of this texel and three around it.

    ``texel`` and ``island`` (c,) int are those of cells. A cell of half a texel or less is taken to lie in the
    quarter of its middle, a larger one in all four.
    """
    owner = islands_of_texels(sheets, texel, island)
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
    return np.where(parts.area > HALF_TEXEL, mixed.mean(axis=0), own)


def unfit_warning(found: list[tuple[str, int, float, float]]) -> str:
    """One sentence on the texels of objects that cannot show their light, those with most of them first; "" for next
    to none. ``found`` has the name of each and its ``UnfitTexels.shares``."""
    found = [each for each in found if each[2] + each[3] >= NOTABLE]
    if not found:
        return ""
    names, texels, shared, thin = zip(*sorted(found, key=lambda each: -each[1]))
    have, most, of, the_map = "its UV map has", "", "the surface", "the map"
    if len(names) > 1:
        have, most, of, the_map = "their UV maps have", "up to ", "a surface", "the maps"
    causes = []
    if max(shared) >= NOTABLE / 2:
        share = f"{most}{percent(max(shared))} of {of}"
        causes.append(f"islands that overlap or lie less than a texel apart ({share})")
    if max(thin) >= NOTABLE / 2:
        causes.append(f"islands thinner than a texel ({most}{percent(max(thin))})")
    return (
        f"{quoted(names)}: {sum(texels)} texels could not be fitted to the light beside seams: {have} "
        + " and ".join(causes)
        + f"; bake more texels, or lay {the_map} out with fewer islands and wider gaps"
    )
