"""Unfit sheets: what to say of texels that cannot be fitted, where they may come in parts. Imports no bpy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bake.faces import triangle_areas
from ..bake.texel_parts import TexelParts
from ..bake.unfit import UnfitCells, UnfitTexels, crowded_shares, on_borders, unfit_warning
from ..solver.array_struct import ArrayStruct
from ..solver.geometry.planar import doubled_areas
from .job import Job
from .layout import Layout
from .seam_fit import Charts, SeamFit


@dataclass(frozen=True)
class _MeasuredCells(ArrayStruct):
    """Cells (c,): the number of the texel among all, the island, its part [texels] and surface [m²], and its middle
    (c, 2) [texels]."""

    texel: np.ndarray
    island: np.ndarray
    part: np.ndarray
    surface: np.ndarray
    middle: np.ndarray

    def judged(self, crowded: np.ndarray) -> UnfitCells:
        """With the share of each that is ``crowded`` (c,)."""
        return UnfitCells(self.texel, self.island, self.part, self.surface, crowded)


class UnfitSheets:
    """Texels of a job's sheets that cannot be fitted; ``fit`` has its islands. Texels may come tile by tile. Only
    cells at the borders of islands are kept, as what lies around them may be in another tile."""

    def __init__(self, job: Job, fit: SeamFit):
        self._names, self._every = [target.name for target in job.targets], fit.every
        owner = np.repeat(np.arange(len(job.targets)), [t.stop - t.start for t in job.targets])
        pieces, self._island = np.unique(np.stack([owner, fit.island]), axis=1, return_inverse=True)
        self._island = self._island.reshape(-1)
        self._texels, self._borders = UnfitTexels(pieces[0]), []
        uv_area = np.abs(doubled_areas(fit.charted.uv))
        area = triangle_areas(fit.charted.vertices, fit.charted.triangles)
        self._scale = 2 * area / np.where(uv_area > 0, uv_area, 1)  # [m² per texel]

    def add(self, charts: Charts, layout: Layout, inside: np.ndarray | None = None) -> None:
        """Count the texels of a part; None or (count,) bool: of those ``inside``."""
        owner, parts = layout.receivers.receiver, charts.parts
        texel = self._every.texel(charts.sheet, charts.row, charts.column)[owner]
        surface = parts.area * self._scale[charts.triangle]
        cells = _MeasuredCells(texel, self._island[charts.triangle], parts.area, surface, parts.middle)
        sheets, number = self._numbered(texel)
        border = on_borders(sheets, number, cells.island)
        mine = np.ones(len(texel), bool) if inside is None else inside[owner]
        inner = cells.take(mine & ~border)
        self._texels.add(inner.judged(np.zeros(len(inner.texel))))
        self._borders.append(cells.take(mine & border))

    def _numbered(self, texel: np.ndarray):
        """Sheets in which only ``texel`` (c,) have numbers, and these."""
        some, number = np.unique(texel, return_inverse=True)
        return replace(self._every, some=some), number

    def warnings(self) -> list[str]:
        """One of all targets with enough such texels, if there are any, after all tiles were added."""
        cells = _MeasuredCells.join(self._borders)
        sheets, number = self._numbered(cells.texel)
        parts = TexelParts(cells.part, cells.middle)
        self._texels.add(cells.judged(crowded_shares(sheets, parts, number, cells.island)))
        found = [(name, *self._texels.shares(i)) for i, name in enumerate(self._names)]
        return list(filter(None, [unfit_warning(found)]))
