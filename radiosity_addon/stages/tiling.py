"""Tiling: a job in parts, each with as many texels as are worked on together. Imports no bpy.

A part is a Job whose targets are windows of the job's own: everything that lays out texels works
on it as on any job. Parts of one image overlap, and fade into each other there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import memory
from ..bake.exported_object import ExportedObject
from ..bake.windows import TexelRect
from ..settings import Target
from ..solver.geometry.planar import doubled_areas
from .job import Job
from .sheets import rect_of

LEAST = 0.01  # share [of an image]: a window with less is taken to have that much
LOOSE = 0.25  # share [of a window] that faces are taken to cover, at least, when it is cut: islands may lie close together


@dataclass(frozen=True)
class Tiling:
    """Numbers of texels that belong to a face. Changing them changes memory and time, and the light
    within its error."""

    undivided: int = memory.UNDIVIDED  # of a bake: more are baked in tiles
    tile: int = memory.TILE  # of a tile, at most, without its overlap
    survey: int = memory.SURVEY  # of the coarse texels that are solved first, about
    overlap: int = 32  # along an edge between tiles of an image; kernels reach 31


@dataclass(frozen=True)
class Window:
    """A part of one target's texels, from the target's lower left corner. ``fade`` are the texels of
    the overlap with other parts at its (left, right, lower, upper) edge; 0 at the image's own."""

    target: int
    column: int
    row: int
    width: int
    height: int
    fade: tuple[int, int, int, int]

    def weight(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """(n,) float32: the share of this window's light in the texels at ``row`` and ``column`` (n,) int. The shares
        of all windows add up to 1."""
        left, right, lower, upper = self.fade
        result = _ramp(column, left) * _ramp(self.width - 1 - column, right)
        return result * _ramp(row, lower) * _ramp(self.height - 1 - row, upper)

    def owns(self, row: np.ndarray, column: np.ndarray) -> np.ndarray:
        """(n,) bool: which of the texels at ``row`` and ``column`` (n,) int belong to this window: those of which no
        other window has a larger share. Each texel belongs to one window."""
        left, right, lower, upper = (width // 2 for width in self.fade)
        inside = (column >= left) & (column < self.width - right)
        return inside & (row >= lower) & (row < self.height - upper)


def _ramp(position: np.ndarray, width: int) -> np.ndarray:
    """(n,) float32: from nearly 0 at position 0 to nearly 1 at ``width`` - 1, and 1 from there on."""
    if width == 0:
        return np.ones(len(position), np.float32)
    return np.minimum((position + np.float32(0.5)) / np.float32(width), np.float32(1))


def tiles_of(job: Job, tiling: Tiling) -> list[list[Window]]:
    """The windows of each tile, image by image; [] for a job that is not divided."""
    rects = [rect_of(job, index) for index in range(len(job.targets))]
    if job.settings.target != Target.IMAGE:
        return []
    shares = covered_shares(job)
    if _covered_texels(rects, shares) <= tiling.undivided:
        return []
    tiles, room = [], 0
    for index in _by_sheet(job):
        own = replace(tiling, tile=int(tiling.tile / max(shares[index], LOOSE)))
        for each in windows_of(index, rects[index], own):
            texels = each.width * each.height * shares[index]
            if not tiles or texels > room:
                tiles.append([])
                room = tiling.tile
            tiles[-1].append(each)
            room -= texels
    return tiles


def covered_shares(job: Job) -> list[float]:
    """About which share of the texels of each target belongs to a face; at least LEAST."""
    return [_covered_share(target) for target in job.targets]


def _covered_share(target: ExportedObject) -> float:
    area = np.abs(doubled_areas(target.uv)) / 2
    return float(np.clip(area[np.isfinite(area)].sum(), LEAST, 1.0))


def texels_of(tiles: list[list[Window]], shares: list[float]) -> list[float]:
    """About how many texels of each tile belong to a face, if of each target such ``shares`` do."""
    return [_covered_texels(tile, [shares[window.target] for window in tile]) for tile in tiles]


def _covered_texels(rects: Sequence[TexelRect | Window], shares: list[float]) -> float:
    return sum(rect.width * rect.height * share for rect, share in zip(rects, shares))


def _by_sheet(job: Job) -> list[int]:
    """Targets, those of one image after each other, so that few images are open at a time."""
    names = [rect_of(job, i).sheet or target.name for i, target in enumerate(job.targets)]
    first = {name: i for i, name in reversed(list(enumerate(names)))}
    return sorted(range(len(names)), key=lambda i: (first[names[i]], i))


def windows_of(index: int, rect: TexelRect, tiling: Tiling) -> list[Window]:
    """A target's texels in windows of about equal size that are nearly square."""
    edge = int(np.sqrt(tiling.tile))
    across, along = rect.width, rect.height
    if across * along > tiling.tile:
        across = -(-across // edge) if across > edge else 1
        along = -(-along // max(tiling.tile * across // rect.width, 1))
    else:
        across = along = 1
    return [
        Window(index, left, low, right - left, high - low, (*fade_across, *fade_along))
        for low, high, fade_along in _stretches(rect.height, along, tiling.overlap)
        for left, right, fade_across in _stretches(rect.width, across, tiling.overlap)
    ]


def _stretches(length: int, number: int, overlap: int):
    """(first, last + 1, (fade at the start, at the end)) of the ``number`` overlapping parts of a length."""
    number = max(min(number, length // max(overlap, 1)), 1)
    cuts = np.linspace(0, length, number + 1).astype(int).tolist()
    half = overlap // 2
    for k, (low, high) in enumerate(zip(cuts, cuts[1:])):
        before, after = (half if k else 0), (half if k < number - 1 else 0)
        yield low - before, high + after, (2 * before, 2 * after)


def part_of(job: Job, windows: list[Window]) -> Job:
    """The job of these windows alone, in their order."""
    return replace(job, targets=tuple(_windowed(job, each) for each in windows))


def _windowed(job: Job, window: Window) -> ExportedObject:
    """The target of a window alone: UVs are 0 to 1 over the window, and NaN for triangles outside of it."""
    target, rect = job.targets[window.target], rect_of(job, window.target)
    full = rect.width, rect.height
    extent, offset = (window.width, window.height), (window.column, window.row)
    if extent == full:
        return replace(target, rect=rect)
    uv = (target.uv * full - offset) / extent
    low, high = uv.min(axis=1), uv.max(axis=1)
    uv[~((high > 0) & (low < 1)).all(axis=1)] = np.nan  # outside: it has no texel here
    normals = target.texel_normals
    if normals is not None:
        normals = normals[window.row :, window.column :][: window.height, : window.width]
    own = replace(
        rect, column=rect.column + window.column, row=rect.row + window.row,
        width=window.width, height=window.height,
    )  # fmt: skip
    return replace(target, uv=uv, rect=own, texel_normals=normals)


def survey_of(job: Job, tiling: Tiling) -> tuple[Job, int]:
    """The job with larger texels, and how many times as large their edges are."""
    rects = [rect_of(job, index) for index in range(len(job.targets))]
    texels = _covered_texels(rects, covered_shares(job))
    factor = max(int(np.ceil(np.sqrt(texels / tiling.survey))), 2)
    pairs = zip(job.targets, rects)
    return replace(job, targets=tuple(_coarse(*pair, factor) for pair in pairs)), factor


def _coarse(target: ExportedObject, rect: TexelRect, factor: int) -> ExportedObject:
    """The target with edges of its image divided by ``factor``."""
    width, height = (-(-edge // factor) for edge in (rect.width, rect.height))
    normals = target.texel_normals
    if normals is not None:
        rows, columns = (
            (2 * np.arange(n) + 1) * full // (2 * n)
            for n, full in ((height, rect.height), (width, rect.width))
        )
        normals = normals[rows[:, None], columns]
    own = replace(rect, size=(width, height), column=0, row=0, width=width, height=height)
    return replace(target, rect=own, texel_normals=normals)
