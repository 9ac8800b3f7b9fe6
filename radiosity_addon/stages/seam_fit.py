"""Seam fit: texels beside seams that lie partly on a face, or in the margin, get the values that show the
light best, to both sides. All others keep their means. Imports no bpy.

Texels may come in parts. Only what is known of those near seams is kept of each; the fit comes when all
images are drawn, as a surface may go on in any of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..bake.border_samples import SeamSamples, sample_seams
from ..bake.continuations import find_seams
from ..bake.islands import Charted, cut_into_islands
from ..bake.shown import SEEN, Sheets
from ..bake.texel_fit import NEARBY, Known, fit_texels
from ..bake.texel_parts import COVERED, TexelParts, anchored_texels, shows_own, texel_parts
from ..solver.array_struct import ArrayStruct
from ..solver.direct.line_of_sight import are_free
from ..solver.lights.context import Context
from ..solver.passes import Pass
from ..solver.solution import Solution
from .job import Job
from .layout import Layout
from .sheets import Sheet, rect_of

# Difference [of the larger]: reflectances and emissions that differ by less are the same.
ALIKE = 0.02


@dataclass
class Drawn:
    """A sheet: its ``image`` (height, width, 4) float32, into which the fit is written; and ``margin`` (n,) bool, row
    by row: the texels that have no light of their own, in the margin or buried, and are filled with others' color."""

    image: np.ndarray
    margin: np.ndarray


@dataclass(frozen=True)
class Charts:
    """Where receivers lie in sheets: the sheet, row and column of each (count,) int; and for their cells the number
    of the triangle among all charted ones and the target (n_cells,) int, and the parts of texels."""

    sheet: np.ndarray
    row: np.ndarray
    column: np.ndarray
    triangle: np.ndarray
    target: np.ndarray
    parts: TexelParts


@dataclass(frozen=True)
class _Receivers(ArrayStruct):
    """Receivers near seams: the number of the texel, the share of it and its middle [texels], whether something
    stands on it, and the reflectance and emission that are shown (k, c)."""

    texel: np.ndarray
    share: np.ndarray
    middle: np.ndarray
    cut: np.ndarray
    material: np.ndarray


@dataclass(frozen=True)
class _Cells(ArrayStruct):
    """Their cells: number of the texel, and island."""

    texel: np.ndarray
    island: np.ndarray


class SeamFit:
    """The seams of a job's ``sheets``, and what is known so far of the texels near them."""

    def __init__(self, job: Job, sheets: Sequence[Sheet]):
        self._passes = job.settings.passes
        self._starts = [target.start for target in job.targets]
        sizes = [target.stop - target.start for target in job.targets]
        self._shift = np.cumsum([0, *sizes[:-1]]) - self._starts
        self._sheet_of = np.zeros(len(sizes), int)
        for number, sheet in enumerate(sheets):
            self._sheet_of[list(sheet.targets)] = number
        self.charted = _chart(job, np.repeat(self._sheet_of, sizes))
        self.island, self._edges = cut_into_islands(self.charted)
        self._seams = find_seams(self.charted, self._edges)
        self.every = Sheets(*np.array([sheet.size for sheet in sheets]).T)
        self._near = replace(self.every, some=self._texels_near())
        self._pixels = np.zeros((self._near.count, 3), np.float32)
        self._margin = np.zeros(self._near.count, bool)
        self._receivers: list[_Receivers] = []
        self._cells: list[_Cells] = []

    def _texels_near(self) -> np.ndarray:
        """Numbers of the texels that the fit looks at."""
        samples = sample_seams(self.charted, self._edges, self._seams, self.every)
        seen = [side.texel[side.weight > SEEN] for side in (samples.one, samples.other)]
        return self.every.around(np.unique(np.concatenate(seen)), NEARBY)

    def charts(self, part: Job, layout: Layout, targets: Sequence[int]) -> Charts:
        """Where the receivers of a ``part`` lie, whose targets are windows of the job's ``targets``."""
        receivers, rects = layout.receivers, [rect_of(part, index) for index in range(len(targets))]
        number = np.repeat(np.arange(len(targets)), np.diff(layout.spans))
        target = np.array(targets)[number]
        corner = np.array([(rect.row, rect.column) for rect in rects])[number]
        row, column = (receivers.grid[:, 1:].astype(np.int64) + corner).T
        cell_target = target[receivers.receiver]
        triangle = receivers.triangle + self._shift[cell_target]
        parts = texel_parts(receivers, self.charted.uv, triangle)
        return Charts(self._sheet_of[target], row, column, triangle, cell_target, parts)

    def add(self, charts: Charts, layout: Layout, solution: Solution, inside: np.ndarray | None = None) -> None:
        """Keep what is known of receivers near seams; None or (count,) bool: of those ``inside``."""
        texel = self._near.texel(charts.sheet, charts.row, charts.column)
        if inside is not None:
            texel[~inside] = -1
        some = np.flatnonzero(texel >= 0)
        share, middle = charts.parts.of_receivers(layout.receivers)
        cut = np.zeros(len(texel), bool) if layout.cut is None else layout.cut
        material = _shown_material(self._passes, solution, some)
        self._receivers.append(_Receivers(texel[some], share[some], middle[some], cut[some], material))
        texel = texel[layout.receivers.receiver]
        some = np.flatnonzero(texel >= 0)
        self._cells.append(_Cells(texel[some], self.island[charts.triangle[some]]))

    def draw(self, number: int, drawn: Drawn) -> None:
        """Take the colors of a sheet, the ``number``-th, without the fit."""
        sheet, row, column = self._near.locate(np.arange(self._near.count))
        own = sheet == number
        row, column = row[own], column[own]
        self._pixels[own] = drawn.image[row, column, :3]
        self._margin[own] = drawn.margin[row * drawn.image.shape[1] + column]

    def fit(self, images: Sequence[np.ndarray], context: Context) -> None:
        """Write the fit into the sheets' ``images``. Four kinds of texels stay as they are: those wholly on a face,
        those beside another island, those partly buried, and those of an earlier bake."""
        receivers, cells = _Receivers.join(self._receivers), _Cells.join(self._cells)
        known, first = _known(self._near, receivers, self._pixels)
        seams = sample_seams(self.charted, self._edges, self._seams, self._near)
        seams = seams.take(self._show_own(seams, cells))
        seams = seams.take(_same_material(seams, known, receivers.material[first]))
        seams = seams.take(are_free(context, seams.across))
        covered = known.share >= COVERED
        anchored = anchored_texels(self._near, known.texel, covered, cells.texel, cells.island)
        free = self._margin.copy()
        free[known.texel[anchored & ~covered]] = True
        free[receivers.texel[receivers.cut]] = False
        texel, value = fit_texels(self._near, known, seams, self._pixels, free)
        sheet, row, column = self._near.locate(texel)
        for number, image in enumerate(images):
            own = sheet == number
            if own.any():
                image[row[own], column[own], :3] = value[own]

    def _show_own(self, seams: SeamSamples, cells: _Cells) -> np.ndarray:
        """(k,) bool: on neither side the picture mixes in another island's texels, which no fit of these texels could
        change."""
        island = self.island[seams.triangle].T
        both = [shows_own(self._near, side, own, cells.texel, cells.island)
                for side, own in zip((seams.one, seams.other), island)]  # fmt: skip
        return both[0] & both[1]


def _chart(job: Job, sheet: np.ndarray) -> Charted:
    """All targets' triangles on the surface and in their sheets; ``sheet`` is that of each triangle."""
    scene = job.scene
    rects = [rect_of(job, index) for index in range(len(job.targets))]
    return Charted(
        scene.vertices,
        np.concatenate([scene.triangles[t.start : t.stop] for t in job.targets]),
        np.concatenate([
            np.asarray(target.uv, float) * (rect.width, rect.height) + (rect.column, rect.row)
            for target, rect in zip(job.targets, rects)
        ]),
        sheet,
        np.concatenate([_normals(job, target) for target in job.targets]),
    )  # fmt: skip


def _normals(job: Job, target) -> np.ndarray:
    """(n, 3, 3) shading normals of the triangles' corners; 0 where a face is shaded by its own normal."""
    if target.normals is None or not job.settings.shading_normals:
        return np.zeros((target.stop - target.start, 3, 3), np.float32)
    return target.normals


def _known(sheets: Sheets, receivers: _Receivers, pixels: np.ndarray) -> tuple[Known, np.ndarray]:
    """What is known of the light of each texel, and the number (k,) of its first receiver, as a texel may have
    several."""
    share = receivers.share
    texel, first, owner = np.unique(receivers.texel, return_index=True, return_inverse=True)
    total = np.bincount(owner, share, len(texel))
    middle = np.stack([np.bincount(owner, share * x, len(texel)) / total for x in receivers.middle.T], 1)
    sheet, _, _ = sheets.locate(texel)
    stencils = sheets.stencils(sheet, middle)
    return Known(texel, stencils, np.minimum(total, 1), pixels[texel].astype(float)), first


def _shown_material(passes: tuple[Pass, ...], solution: Solution, some: np.ndarray) -> np.ndarray:
    """(k, c) reflectance and emission that receivers show: where these are equal on both sides of a seam, so may the
    light be."""
    parts = [np.zeros((len(some), 0))]
    if Pass.COLOR in passes:
        parts.append(solution.diffuse[some])
    if Pass.EMIT in passes:
        parts.append(solution.emission[some])
    return np.concatenate(parts, 1)


def _same_material(seams: SeamSamples, known: Known, material: np.ndarray) -> np.ndarray:
    """(k,) bool: on both sides of a seam the texels' reflectances and emissions overlap in their ranges, so that the
    light need not jump."""
    if not len(material):
        return np.zeros(len(seams.weight), bool)
    spans = []
    for stencils in (seams.one, seams.other):
        at = np.minimum(np.searchsorted(known.texel, stencils.texel), len(known.texel) - 1)
        there = (known.texel[at] == stencils.texel) & (stencils.weight > 0)
        values = material[at]
        low = np.where(there[..., None], values, np.inf).min(1)
        spans.append((low, np.where(there[..., None], values, -np.inf).max(1)))
    (low, high), (other_low, other_high) = spans
    known = np.isfinite(low) & np.isfinite(other_low)
    slack = ALIKE * np.where(known, np.maximum(np.abs(high), np.abs(other_high)), 0)
    return (~known | (np.maximum(low, other_low) <= np.minimum(high, other_high) + slack)).all(1)
