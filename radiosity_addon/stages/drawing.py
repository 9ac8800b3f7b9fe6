"""Drawing: the images of a bake in tiles, each done when its last part is. Imports no bpy."""

from __future__ import annotations

import time
from collections import Counter

import numpy as np

from .canvas import Canvas
from .job import Job
from .layout import Layout
from .sheets import sheets_of
from .spool import Spool
from .tiling import Window

IN_MEMORY = 1 << 30  # size [bytes] of images that are done: more go to a file
PIXEL = 16  # size [bytes] of a pixel: four float32


class Drawing:
    """The images that parts are drawn into, and those that are done. ``warnings`` are what to warn of,
    ``seconds`` what it took, ``texels`` those with light."""

    def __init__(self, job: Job, tiles: list[list[Window]]):
        """Raises OSError where images want a temporary file and there is none."""
        self._job, self._sheets = job, sheets_of(job)
        self._of = {index: n for n, sheet in enumerate(self._sheets) for index in sheet.targets}
        self._left = Counter(self._of[each.target] for tile in tiles for each in tile)
        total = sum(width * height for width, height in (sheet.size for sheet in self._sheets))
        self._spool = Spool(PIXEL * total, IN_MEMORY)
        self._open: dict[int, Canvas] = {}
        self._done: dict[int, np.ndarray] = {}
        self.warnings: list[str] = []
        self.seconds, self.texels = 0.0, 0

    def add(
        self, part: Job, layout: Layout, windows: list[Window], light: np.ndarray | None
    ) -> None:
        """Draw the ``light`` (count, 3) of a part's receivers, or None where it has none, into the
        images; those that get no more are finished."""
        began = time.perf_counter()
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
                image, warnings = canvas.finish(self._job)
                self._done[sheet] = self._spool.keep(image)
                self.warnings += warnings
        self.seconds += time.perf_counter() - began

    def images(self) -> tuple[np.ndarray, ...]:
        """(height, width, 4) float32 each, in the order of the sheets."""
        return tuple(self._done[sheet] for sheet in range(len(self._sheets)))
