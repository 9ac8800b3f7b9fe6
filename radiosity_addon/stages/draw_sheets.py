"""Draw sheets: from light at texels to images with their margins. Imports no bpy."""

from __future__ import annotations

import numpy as np

from ..bake.dilate import dilated
from ..bake.texels import OVERLAP, coverage
from ..bake.windows import TexelRect
from ..figures import quoted
from ..solver.lights.context import Context
from ..solver.solution import Solution
from .fit_sheets import fit_sheets
from .job import Job
from .layout import Layout
from .seam_fit import Drawn
from .sheets import Sheet, rect_of, sheets_of


def draw_sheets(
    job: Job, layout: Layout, light: np.ndarray, solution: Solution, context: Context
) -> tuple[list[np.ndarray], list[str]]:
    """(height, width, 4) float32 of every sheet: the texels' ``light`` (count, 3), and the margin around them,
    fitted to what is shown; and warnings."""
    sheets, warnings = sheets_of(job), []
    drawn = [_draw(job, sheet, layout, light, warnings) for sheet in sheets]
    if job.settings.margin and layout.receivers.count:
        warnings += fit_sheets(job, sheets, layout, drawn, solution, context)
    return [each.image for each in drawn], warnings


def _draw(job: Job, sheet: Sheet, layout: Layout, light: np.ndarray, warnings: list[str]) -> Drawn:
    """A sheet's image: the texels' ``light`` and the margin around them. Buried texels are filled as the margin is,
    but count as texels of a face; those too far from the light are dark. In a kept image only the texels that are
    baked now change."""
    width, height = sheet.size
    flat = [texels_of(layout.part(i).grid, rect_of(job, i)) for i in sheet.targets]
    values = [light[slice(*layout.spans[i : i + 2])] for i in sheet.targets]
    covered, buried = (np.zeros(height * width, bool) for _ in range(2))
    pixels = np.zeros((height * width, 3), np.float32)
    for texels, mine in zip(flat, values):
        covered[texels] = True
        pixels[texels] = mine
    warnings += _mix_shared(job, sheet, layout, flat, values, pixels)
    for index in sheet.targets:
        buried[buried_texels(layout, index, rect_of(job, index))] = True
    keep_others(sheet, pixels, covered, buried)
    shape = height, width
    image, filled = dilated(
        pixels.reshape(*shape, 3), covered.reshape(shape), job.settings.margin
    )
    image[buried.reshape(shape), 3] = 1
    return Drawn(image, filled.ravel() & ~covered)


def keep_others(
    sheet: Sheet, pixels: np.ndarray, covered: np.ndarray, buried: np.ndarray
) -> None:
    """Put the texels of a kept image that stay into ``pixels`` (n, 3) and mark them in ``covered`` (n,) bool;
    ``buried`` (n,) bool texels do not stay."""
    if sheet.unbaked is not None:
        kept = sheet.unbaked.pixels.reshape(-1, 4)
        stays = (kept[:, 3] > 0) & ~covered & ~buried
        pixels[stays], covered[stays] = kept[stays, :3], True


def buried_texels(layout: Layout, index: int, rect: TexelRect) -> np.ndarray:
    """(n,) numbers of a target's texels, at its ``rect``, that are buried."""
    if layout.buried is None:
        return np.zeros(0, np.int64)
    grid = layout.buried.grid
    return texels_of(grid[grid[:, 0] == index], rect)


def texels_of(grid: np.ndarray, rect: TexelRect) -> np.ndarray:
    """(n,) numbers of a window's texels, row by row through the whole image, from ``grid`` (n, 3) of
    receivers."""
    row, column = grid[:, 1].astype(np.int64) + rect.row, grid[:, 2] + rect.column
    return row * rect.size[0] + column


def _mix_shared(job: Job, sheet: Sheet, layout: Layout, flat, values, pixels) -> list[str]:
    """Texels that several objects cover become the mean of their light, by how much of the texel each covers; a
    warning where objects overlap."""
    owner = np.repeat(np.arange(len(flat)), [len(part) for part in flat])
    texel, inverse, count = np.unique(
        np.concatenate(flat), return_inverse=True, return_counts=True
    )
    if (count < 2).all():
        return []
    shares = [_covers(job, layout, index) for index in sheet.targets]
    share, value = np.concatenate(shares), np.concatenate(values)
    total = np.bincount(inverse, share, len(texel))
    mean = np.stack([np.bincount(inverse, share * v, len(texel)) for v in value.T], 1)
    shared = count > 1
    pixels[texel[shared]] = mean[shared] / total[shared, None]
    over = shared & (total > OVERLAP)
    if not over.any():
        return []
    names = [job.targets[sheet.targets[i]].name for i in np.unique(owner[over[inverse]])]
    return [overlap_warning(sheet.name, names, int(over.sum()))]


def overlap_warning(sheet: str, names: list[str], texels: int) -> str:
    """One sentence on objects that overlap in an atlas."""
    return (
        f"{quoted(names)} overlap in the atlas {sheet!r} on {texels} "
        "texels, which get their mean; lay their UVs out side by side, or bake without --uv-map"
    )


def _covers(job: Job, layout: Layout, index: int) -> np.ndarray:
    """(count,) how much of each texel a target covers."""
    target, rect = job.targets[index], rect_of(job, index)
    return coverage(layout.part(index), target.uv, target.start, (rect.width, rect.height))
