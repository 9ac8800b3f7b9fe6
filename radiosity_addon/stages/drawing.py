"""Drawing: the images of a bake in tiles, each done when its last part is. Imports no bpy."""

from __future__ import annotations

import time
from collections import Counter

import numpy as np

from ..solver.lights.context import Context
from ..solver.solution import Solution, compose
from .canvas import Canvas
from .job import Job
from .layout import Layout
from .seam_fit import SeamFit
from .sheets import sheets_of
from .spool import Spool
from .tiling import Window
from .unfit_sheets import UnfitSheets

IN_MEMORY = 1 << 30  # size [bytes] of images that are done: more go to a file
PIXEL = 16  # size [bytes] of a pixel: four float32


class Drawing:
    """The images that tiles are drawn into, and those that are done. ``warnings`` are collected from all tiles;
    ``seconds`` is the time that drawing took; ``texels`` is the number of texels with light."""

    def __init__(self, job: Job, tiles: list[list[Window]]):
        """Raises OSError where images want a temporary file and there is none."""
        self._job, self._sheets = job, sheets_of(job)
        self._of = {index: n for n, sheet in enumerate(self._sheets) for index in sheet.targets}
        self._left = Counter(self._of[each.target] for tile in tiles for each in tile)
        total = sum(width * height for width, height in (sheet.size for sheet in self._sheets))
        self._spool = Spool(PIXEL * total, IN_MEMORY)
        self._open: dict[int, Canvas] = {}
        self._done: dict[int, np.ndarray] = {}
        self._fit = SeamFit(job, self._sheets) if job.settings.margin else None
        self._unfit = UnfitSheets(job, self._fit) if self._fit else None
        self.warnings: list[str] = []
        self.seconds, self.texels = 0.0, 0

    def add(
        self, part: Job, layout: Layout, windows: list[Window], solution: Solution | None
    ) -> None:
        """Draw the light of a tile's receivers by the ``solution``, None where it has none, into the images. Images
        of which this is the last tile are finished."""
        began = time.perf_counter()
        light = None if solution is None else compose(solution, self._job.settings.passes)
        if self._fit is not None and solution is not None:
            charts = self._fit.charts(part, layout, [window.target for window in windows])
            inside = _owned(layout, windows)
            self._fit.add(charts, layout, solution, inside)
            self._unfit.add(charts, layout, inside)
        for index, window in enumerate(windows):
            sheet = self._of[window.target]
            canvas = self._open.get(sheet) or Canvas(self._sheets[sheet])
            self._open[sheet] = canvas
            mine = None if light is None else light[slice(*layout.spans[index : index + 2])]
            canvas.add(part, layout, index, window, mine)
            self._left[sheet] -= 1
            if not self._left[sheet]:
                self._open.pop(sheet)
                self.texels += canvas.texels
                drawn, warnings = canvas.finish(self._job)
                if self._fit is not None:
                    self._fit.draw(sheet, drawn)
                self._done[sheet] = self._spool.keep(drawn.image)
                self.warnings += warnings
        self.seconds += time.perf_counter() - began

    def images(self, context: Context) -> tuple[np.ndarray, ...]:
        """(height, width, 4) float32 each, in the order of the sheets, fitted beside seams."""
        began = time.perf_counter()
        images = tuple(self._done[sheet] for sheet in range(len(self._sheets)))
        if self._fit is not None and self.texels:
            self._fit.fit(images, context)
            self.warnings += self._unfit.warnings()
        self.seconds += time.perf_counter() - began
        return images


def _owned(layout: Layout, windows: list[Window]) -> np.ndarray:
    """(count,) bool: receivers of which no other tile has a larger share."""
    grid = layout.receivers.grid
    spans = zip(layout.spans, layout.spans[1:])
    own = [window.owns(*grid[low:high, 1:].T) for window, (low, high) in zip(windows, spans)]
    return np.concatenate(own)
