"""Canvas: an image that is put together from the light of tiles. Imports no bpy."""

from __future__ import annotations

import numpy as np

from ..bake.dilate import dilated
from ..bake.texels import OVERLAP, coverage
from .draw_sheets import buried_texels, keep_others, overlap_warning, texels_of
from .job import Job
from .layout import Layout
from .seam_fit import Drawn
from .sheets import Sheet, rect_of
from .tiling import Window

NOBODY = -1  # code [targets]: a texel that is none's


class Canvas:
    """The image of a sheet under way: the sums of light, weighted by the share of the texel that each part has, and
    the sums of these shares."""

    def __init__(self, sheet: Sheet):
        texels = sheet.size[0] * sheet.size[1]
        self._sheet, self._several = sheet, len(sheet.targets) > 1
        self._light = np.zeros((texels, 3), np.float32)
        self._share = np.zeros(texels, np.float32)
        self._buried = np.zeros(texels, bool)
        owners = texels if self._several else 0
        self._first, self._last = (np.full(owners, NOBODY, np.int32) for _ in range(2))

    def add(
        self, part: Job, layout: Layout, index: int, window: Window, light: np.ndarray | None
    ) -> None:
        """Add the ``light`` (count, 3) of the receivers of the ``window`` that is the target
        ``index`` of a part; None where it has none."""
        rect, receivers = rect_of(part, index), layout.part(index)
        self._buried[buried_texels(layout, index, rect)] = True
        if light is None or receivers.count == 0:
            return
        texels, grid = texels_of(receivers.grid, rect), receivers.grid
        share = window.weight(grid[:, 1], grid[:, 2])
        if self._several:  # in a texel of several objects each counts by how much of it is its own
            target = part.targets[index]
            size = rect.width, rect.height
            share = share * coverage(receivers, target.uv, target.start, size).astype(np.float32)
            fresh = texels[self._first[texels] == NOBODY]
            self._first[fresh] = window.target
            self._last[texels] = window.target
        self._share[texels] += share
        self._light[texels] += share[:, None] * light

    @property
    def texels(self) -> int:
        """The number of texels with light."""
        return int((self._share > 0).sum())

    def finish(self, job: Job) -> tuple[Drawn, list[str]]:
        """The sheet before the fit, and warnings."""
        covered = self._share > 0
        np.divide(self._light, self._share[:, None], out=self._light, where=covered[:, None])
        warnings = self._overlaps(job)
        keep_others(self._sheet, self._light, covered, self._buried)
        width, height = self._sheet.size
        image, filled = dilated(
            self._light.reshape(height, width, 3), covered.reshape(height, width), job.settings.margin
        )
        image[self._buried.reshape(height, width), 3] = 1
        return Drawn(image, filled.ravel() & ~covered), warnings

    def _overlaps(self, job: Job) -> list[str]:
        """A warning where several objects overlap in the image."""
        if not self._several:
            return []
        over = (self._first != self._last) & (self._share > OVERLAP)
        if not over.any():
            return []
        mine = np.unique(np.concatenate([self._first[over], self._last[over]]))
        names = [job.targets[i].name for i in mine]
        return [overlap_warning(self._sheet.name, names, int(over.sum()))]
