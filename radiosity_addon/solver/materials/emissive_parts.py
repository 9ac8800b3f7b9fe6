"""Emissive parts: emission that varies over a triangle, cut into parts that are nearly constant.

Each triangle is cut into four again and again, down to the size of a texel, where its parts differ
much: a dark part of a picture becomes no light at all, a bright spot many small ones. The radiance
of a cell is the mean of the picture over it, so that cells have the picture's power, all of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_struct import ArrayStruct
from ..fields import Field, Texture, srgb_to_linear
from ..geometry.grids import quarters
from ..geometry.planar import doubled_areas
from ..scene import Scene
from .region_means import FieldMeans, triangle_regions
from .texture_blocks import one_colored_parts

MOST = 1 << 19  # number [parts of all triangles, cut ones too], at most
MOST_CUT = 64  # number [varying triangles of a material]: of more, no parts of one color are looked for
DEEPEST = 9  # depth [cuts into four] of a triangle, at most
SMOOTH = 3  # depth [cuts into four] of triangles whose colors vary linearly
COARSE = 1e-3  # variation [of all emission] within a cell, at most
UNIT_TRIANGLE = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])  # corners of a triangle, barycentric


@dataclass(frozen=True)
class EmissiveParts(ArrayStruct):
    """n parts of triangles. ``deviation`` is the standard deviation of the radiance in there."""

    triangle: np.ndarray  # (n,) int
    corners: np.ndarray  # (n, 3, 2) barycentric
    radiance: np.ndarray  # (n, 3) mean
    deviation: np.ndarray  # (n,) mean over channels
    share: np.ndarray  # (n,) of the triangle's area
    side: np.ndarray  # (n,) int: 1 only the front emits so, -1 only the back, 0 both do


def undivided(triangle: np.ndarray, radiance: np.ndarray) -> EmissiveParts:
    """Triangles (n,) as one part each, of constant ``radiance`` (n, 3)."""
    n = len(triangle)
    return EmissiveParts(triangle, np.repeat(UNIT_TRIANGLE, n, axis=0), radiance, np.zeros(n), np.ones(n),
                 np.zeros(n, int))  # fmt: skip


def cut(scene: Scene, triangle: np.ndarray, area: np.ndarray) -> tuple[EmissiveParts, np.ndarray]:
    """Cells of triangles (n,) whose emission varies, of ``area`` (n,); and the share (n,) of each
    that counts as glowing: (∫L)² / (area ∫L²), 1 where it is constant."""
    materials = scene.material[triangle]
    undivided_cells, glowing, total = [], np.zeros(len(triangle)), 0.0
    for material in np.unique(materials):
        rows = np.flatnonzero(materials == material)
        means = FieldMeans(scene.materials[material].emission)
        cells = _measured(means, triangle[rows], np.repeat(UNIT_TRIANGLE, len(rows), axis=0), 1.0)
        mean = cells.radiance.mean(axis=1)
        glowing[rows] = mean**2 / np.maximum(mean**2 + cells.deviation**2, 1e-300)
        total += float((area[rows] * mean).sum())
        undivided_cells.append((means, rows, cells))
    parts = [undivided(triangle[:0], np.zeros((0, 3)))]
    for means, rows, cells in undivided_cells:
        room = MOST - sum(len(part.triangle) for part in parts)
        parts += _leaves(means, cells, area[rows], COARSE * total, room)
    return EmissiveParts.join(parts), glowing


def _measured(means: FieldMeans, triangle: np.ndarray, corners: np.ndarray, share: float) -> EmissiveParts:
    """Cells ``corners`` (n, 3, 2) of triangles (n,), each ``share`` of its triangle."""
    radiance, deviation = means(triangle_regions(triangle, corners))
    n = len(triangle)
    return EmissiveParts(triangle, corners, radiance, deviation, np.full(n, share), np.zeros(n, int))


def _leaves(
    means: FieldMeans, cells: EmissiveParts, area: np.ndarray, limit: float, room: int
) -> list[EmissiveParts]:
    """The coarsest parts of whole triangles, ``cells`` of ``area`` (k,), that vary by no more than
    ``limit``, and shine; about ``room`` at most. Others are cut into four again and again."""
    level, leaves = 0, []
    if isinstance(means.field, Texture) and means.field.interpolation == "Closest":
        cells, area, leaves = _one_colored(means.field, cells, area, limit)
    depth = _depth(means.field, cells.triangle)
    while len(cells.triangle):
        room -= len(cells.triangle)
        done = (area * 0.25**level * cells.deviation <= limit) | (depth <= level)
        open_ = np.flatnonzero(~done)
        if 3 * len(open_) > room:
            done[:], open_ = True, open_[:0]
        leaves.append(cells.take(np.flatnonzero(done & (cells.radiance.max(axis=1) > 0))))
        depth, area, level = np.repeat(depth[open_], 4), np.repeat(area[open_], 4), level + 1
        triangle = np.repeat(cells.triangle[open_], 4)
        cells = _measured(means, triangle, quarters(cells.corners[open_]), 0.25**level)
    return leaves


def _one_colored(
    field: Texture, cells: EmissiveParts, area: np.ndarray, limit: float
) -> tuple[EmissiveParts, np.ndarray, list[EmissiveParts]]:
    """Of whole triangles, ``cells`` of ``area`` (k,): those that do not consist of a few parts of one color, and
    their areas; and the parts of those that do."""
    varied = np.flatnonzero(area * cells.deviation > limit)
    left, parts = np.ones(len(area), bool), []
    for k in varied if len(varied) <= MOST_CUT else ():
        found = one_colored_parts(field, cells.triangle[k])
        if found is None:
            continue
        left[k] = False
        corners, color = found
        color = srgb_to_linear(color) if field.encoded else color
        n, share = len(corners), np.abs(doubled_areas(corners))
        triangle = np.full(n, cells.triangle[k])
        parts.append(EmissiveParts(triangle, corners, color * field.factor, np.zeros(n), share,
                           np.zeros(n, int)))  # fmt: skip
    return cells.take(np.flatnonzero(left)), area[left], parts


def _depth(field: Field, triangle: np.ndarray) -> np.ndarray:
    """(n,) how often triangles (n,) are cut until their parts are as small as texels."""
    if not isinstance(field, Texture):
        return np.full(len(triangle), SMOOTH)
    edge = np.maximum(_texels(field, triangle), 1)
    return np.clip(np.ceil(np.log2(edge)), 0, DEEPEST).astype(int)


def _texels(field: Texture, triangle: np.ndarray) -> np.ndarray:
    """(n,) extent of triangles in texels."""
    height, width = field.pixels.shape[:2]
    corners = field.uv[triangle].astype(float) * (width, height)
    return np.abs(corners - np.roll(corners, 1, axis=1)).max(axis=(1, 2))
