"""Unfit sheets: what to say of texels that cannot be fitted, where they may come in parts. Imports no bpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..bake.faces import triangle_areas
from ..bake.unfit import UnfitCells, UnfitTexels, crowded_shares, unfit_warning
from ..solver.geometry.planar import doubled_areas
from .job import Job
from .layout import Layout
from .seam_fit import Charts, SeamFit


class UnfitSheets:
    """Texels of a job's sheets that cannot be fitted; ``fit`` knows its islands."""

    def __init__(self, job: Job, fit: SeamFit):
        self._names, self._every = [target.name for target in job.targets], fit.every
        owner = np.repeat(np.arange(len(job.targets)), [t.stop - t.start for t in job.targets])
        pieces, self._island = np.unique(np.stack([owner, fit.island]), axis=1, return_inverse=True)
        self._island = self._island.reshape(-1)
        self._texels = UnfitTexels(pieces[0])
        uv_area = np.abs(doubled_areas(fit.charted.uv))
        area = triangle_areas(fit.charted.vertices, fit.charted.triangles)
        self._scale = 2 * area / np.where(uv_area > 0, uv_area, 1)  # [m² per texel]

    def add(self, charts: Charts, layout: Layout, inside: np.ndarray | None = None) -> None:
        """Count the texels of a part; None or (count,) bool: of those ``inside``."""
        owner, island, parts = layout.receivers.receiver, self._island[charts.triangle], charts.parts
        texel = self._every.texel(charts.sheet, charts.row, charts.column)
        sheets = replace(self._every, some=np.unique(texel))
        own = sheets.texel(charts.sheet, charts.row, charts.column)
        crowded = crowded_shares(sheets, parts, own[owner], island)
        surface = parts.area * self._scale[charts.triangle]
        cells = UnfitCells(texel[owner], island, parts.area, surface, crowded)
        self._texels.add(cells if inside is None else cells.take(inside[owner]))

    def warnings(self) -> list[str]:
        """One for each target of which it matters."""
        every = (unfit_warning(name, *self._texels.shares(i)) for i, name in enumerate(self._names))
        return [text for text in every if text]
