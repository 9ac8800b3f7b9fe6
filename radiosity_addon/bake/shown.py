"""Shown: what engines show between texels. NumPy only.

Texels have their values at the middles of their squares; between them the picture is bilinear,
and beyond the outermost middles constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..solver.array_struct import ArrayStruct

DENSE = 4  # factor [texels that have numbers]: where all between the first and the last are no more, a table finds them
SEEN = 1e-6  # weight [of 1]: a texel with less is not seen at a place


@dataclass(frozen=True)
class Stencils(ArrayStruct):
    """Points in images as weighted sums of four texels each: ``texel`` and ``weight`` (k, 4)."""

    texel: np.ndarray  # int64, through all images
    weight: np.ndarray  # float64

    def of(self, values: np.ndarray) -> np.ndarray:
        """(k, c) what is shown of texels' values (n, c)."""
        return np.einsum("ij,ijc->ic", self.weight, values[self.texel])


@dataclass(frozen=True)
class Sheets:
    """The images' sizes. Texels are numbered image after image, row by row: all, or some alone."""

    width: np.ndarray  # (s,) int
    height: np.ndarray  # (s,) int
    some: np.ndarray | None = None  # (n,) int64 ascending: of all texels those that have numbers; None: all

    @property
    def count(self) -> int:
        """How many texels have numbers."""
        return int(self._first[-1]) if self.some is None else len(self.some)

    @property
    def _first(self) -> np.ndarray:
        """(s + 1,) number among all of each image's first texel, and how many there are."""
        return np.concatenate([[0], np.cumsum(self.width.astype(np.int64) * self.height)])

    def texel(self, sheet: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """Numbers of texels; -1 outside of the image, and of those without."""
        inside = (row >= 0) & (column >= 0)
        inside &= (row < self.height[sheet]) & (column < self.width[sheet])
        texel = np.where(inside, self._first[sheet] + row * self.width[sheet] + column, -1)
        if self.some is None or not len(self.some):
            return texel if self.some is None else np.full_like(texel, -1)
        if self._table is not None:
            return self._table[np.clip(texel - self.some[0] + 1, 0, len(self._table) - 1)]
        at = np.minimum(np.searchsorted(self.some, texel), len(self.some) - 1)
        return np.where(self.some[at] == texel, at, -1)

    @cached_property
    def _table(self) -> np.ndarray | None:
        """Numbers of the texels from before the first of ``some`` to behind the last, -1 of those without; None where most have none."""
        span = int(self.some[-1] - self.some[0]) + 1
        if span > DENSE * len(self.some):
            return None
        table = np.full(span + 2, -1, np.int64)
        table[self.some - self.some[0] + 1] = np.arange(len(self.some))
        return table

    def locate(self, texel: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(sheet, row, column) of texels' numbers."""
        texel, first = (texel if self.some is None else self.some[texel]), self._first
        sheet = np.searchsorted(first, texel, "right") - 1
        row, column = np.divmod(texel - first[sheet], self.width[sheet])
        return sheet, row, column

    def around(self, texel: np.ndarray, steps: int) -> np.ndarray:
        """Numbers, ascending, of ``texel`` (n,) and of those up to ``steps`` rows and columns away."""
        for _ in range(steps):
            sheet, row, column = self.locate(texel)
            near = [self.texel(sheet, row + dy, column + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
            texel = np.unique(np.concatenate(near))
            texel = texel[texel >= 0]
        return texel

    def stencils(self, sheet: np.ndarray, at: np.ndarray) -> Stencils:
        """Of points ``at`` (k, 2) [texels from the lower left corner] in images ``sheet`` (k,) int."""
        low = np.floor(at - 0.5)
        share = at - 0.5 - low
        texels, weights = [], []
        for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
            column = np.clip(low[:, 0] + dx, 0, self.width[sheet] - 1).astype(np.int64)
            row = np.clip(low[:, 1] + dy, 0, self.height[sheet] - 1).astype(np.int64)
            texels.append(self.texel(sheet, row, column))
            weights.append(np.abs(1 - dx - share[:, 0]) * np.abs(1 - dy - share[:, 1]))
        return Stencils(np.stack(texels, 1), np.stack(weights, 1))
