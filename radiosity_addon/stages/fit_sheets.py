"""Fit sheets: texels beside seams that lie partly on a face, or in the margin, get the values that show
the light best, to both sides. All others keep their means. Imports no bpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bake.border_samples import SeamSamples, sample_seams
from ..bake.continuations import find_seams
from ..bake.faces import triangle_areas
from ..bake.islands import Charted, cut_into_islands
from ..bake.shown import Sheets
from ..bake.texel_fit import Known, fit_texels
from ..bake.texel_parts import (
    COVERED,
    TexelParts,
    anchored_texels,
    crowded_shares,
    texel_parts,
    unfit_shares,
    unfit_warning,
)
from ..solver.direct.line_of_sight import are_free
from ..solver.geometry.planar import doubled_areas
from ..solver.lights.context import Context
from ..solver.passes import Pass
from ..solver.solution import Solution
from .job import Job
from .layout import Layout
from .sheets import Sheet, rect_of

# Difference [of the larger]: reflectances and emissions that differ by less are the same.
ALIKE = 0.02


@dataclass(frozen=True)
class Drawn:
    """A sheet before the fit: ``image`` (height, width, 4) float32, and which of its texels, row by row,
    are of the ``margin``, (n,) bool, or buried: they are filled with others' color and know no light."""

    image: np.ndarray
    margin: np.ndarray


@dataclass(frozen=True)
class _Charts:
    """The targets' triangles in the sheets, and the receivers there."""

    charted: Charted
    sheets: Sheets
    texel: np.ndarray  # (count,) each receiver's
    cell_texel: np.ndarray  # (n_cells,)
    triangle: np.ndarray  # (n_cells,) of ``charted``
    target: np.ndarray  # (n_cells,)


def fit_sheets(
    job: Job, sheets: list[Sheet], layout: Layout, drawn: list[Drawn], solution: Solution,
    context: Context,
) -> list[str]:
    """Fit texels beside seams in the images; warnings of texels that cannot be fitted. Those that lie on
    a face wholly, those that other islands are near, or of which a part is buried, and those of an
    earlier bake stay."""
    charts = _chart(job, sheets, layout)
    charted = charts.charted
    island, edges = cut_into_islands(charted)
    parts = texel_parts(layout.receivers, charted.uv, charts.triangle)
    pixels = np.concatenate([each.image[..., :3].reshape(-1, 3) for each in drawn])
    known, first = _known(charts, layout, parts, pixels)
    seams = sample_seams(charted, edges, find_seams(charted, edges), charts.sheets)
    seams = seams.take(_same_material(seams, known, _shown_material(job, solution, first)))
    seams = seams.take(are_free(context, seams.across))
    free = np.concatenate([each.margin for each in drawn])
    covered = known.share >= COVERED
    anchored = anchored_texels(
        charts.sheets, known.texel, covered, charts.cell_texel, island[charts.triangle]
    )
    free[known.texel[anchored & ~covered]] = True
    free[_cut_texels(charts, layout)] = False
    texel, value = fit_texels(charts.sheets, known, seams, pixels, free)
    sheet, row, column = charts.sheets.locate(texel)
    for number, each in enumerate(drawn):
        own = sheet == number
        each.image[row[own], column[own], :3] = value[own]
    return _warn_of_unfit(job, charts, parts, island)


def _chart(job: Job, drawn: list[Sheet], layout: Layout) -> _Charts:
    scene, receivers = job.scene, layout.receivers
    sheets = Sheets(*np.array([sheet.size for sheet in drawn]).T)
    sheet_of = np.zeros(len(job.targets), int)
    for number, sheet in enumerate(drawn):
        sheet_of[list(sheet.targets)] = number
    rects = [rect_of(job, index) for index in range(len(job.targets))]
    sizes = [target.stop - target.start for target in job.targets]
    owner = np.repeat(np.arange(len(sizes)), sizes)
    charted = Charted(
        scene.vertices,
        np.concatenate([scene.triangles[t.start : t.stop] for t in job.targets]),
        np.concatenate([
            np.asarray(target.uv, float) * (rect.width, rect.height) + (rect.column, rect.row)
            for target, rect in zip(job.targets, rects)
        ]),
        sheet_of[owner],
        np.concatenate([_normals(job, target) for target in job.targets]),
    )  # fmt: skip
    target = np.repeat(np.arange(len(sizes)), np.diff(layout.spans))
    corner = np.array([(rect.row, rect.column) for rect in rects])[target]
    row, column = (receivers.grid[:, 1:].astype(np.int64) + corner).T
    cells = target[receivers.receiver]
    shift = np.cumsum([0, *sizes[:-1]]) - [each.start for each in job.targets]
    texel = sheets.texel(sheet_of[target], row, column)
    return _Charts(charted, sheets, texel, texel[receivers.receiver], receivers.triangle + shift[cells], cells)


def _normals(job: Job, target) -> np.ndarray:
    """(n, 3, 3) by which corners are shaded, 0 where by the faces'."""
    if target.normals is None or not job.settings.shading_normals:
        return np.zeros((target.stop - target.start, 3, 3), np.float32)
    return target.normals


def _known(
    charts: _Charts, layout: Layout, parts: TexelParts, pixels: np.ndarray
) -> tuple[Known, np.ndarray]:
    """What is known of each texel, and (k,) its first receiver; some have several."""
    share, middle = parts.of_receivers(layout.receivers)
    texel, first, owner = np.unique(charts.texel, return_index=True, return_inverse=True)
    total = np.bincount(owner, share, len(texel))
    middle = np.stack([np.bincount(owner, share * x, len(texel)) / total for x in middle.T], 1)
    sheet, _, _ = charts.sheets.locate(texel)
    stencils = charts.sheets.stencils(sheet, middle)
    return Known(texel, stencils, np.minimum(total, 1), pixels[texel].astype(float)), first


def _cut_texels(charts: _Charts, layout: Layout) -> np.ndarray:
    """Texels of which a part is buried: something stands there, and light does not go on under it."""
    return charts.texel[:0] if layout.cut is None else charts.texel[layout.cut]


def _shown_material(job: Job, solution: Solution, first: np.ndarray) -> np.ndarray:
    """(k, c) what the texels show of the material itself: reflectance and emission."""
    passes, parts = job.settings.passes, [np.zeros((len(first), 0))]
    if Pass.COLOR in passes:
        parts.append(solution.diffuse[first])
    if Pass.EMIT in passes:
        parts.append(solution.emission[first])
    return np.concatenate(parts, 1)


def _same_material(seams: SeamSamples, known: Known, material: np.ndarray) -> np.ndarray:
    """(k,) bool: what both sides' texels span of the material overlaps, so that it need not jump."""
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


def _warn_of_unfit(job: Job, charts: _Charts, parts: TexelParts, island: np.ndarray) -> list[str]:
    charted, texel, island = charts.charted, charts.cell_texel, island[charts.triangle]
    uv_area = np.abs(doubled_areas(charted.uv))
    scale = 2 * triangle_areas(charted.vertices, charted.triangles) / np.where(uv_area > 0, uv_area, 1)
    surface = parts.area * scale[charts.triangle]
    crowded = crowded_shares(charts.sheets, parts, texel, island)
    columns = texel, island, parts.area, surface, crowded
    warnings = []
    for index, target in enumerate(job.targets):
        own = charts.target == index
        shares = unfit_shares(*(column[own] for column in columns))
        warnings.append(unfit_warning(target.name, *shares))
    return [text for text in warnings if text]
