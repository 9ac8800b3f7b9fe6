"""Texels: the exact part of each texel's square that lies on the surface. NumPy only.

Coordinates are texels: UV times the image's width and height, so texel (row, column) is the unit
square with its lower left corner at (column, row). Triangles are walked row by row: in each row the
texels that lie wholly inside are one run (one square cell each), the few around it are clipped.
"""

from __future__ import annotations

from typing import Iterator

import numpy as np

from ..solver.geometry.planar import cell_areas, doubled_areas
from ..solver.ragged import ragged_ranges
from ..solver.receivers import Receivers, TexelMaps
from ..steps import finish
from .clip import clip_squares, fan

NEGLIGIBLE = 1e-6  # area [of a texel]: a smaller cell is left out when its texel has others
TOUCHED = 1e-8  # area [of a texel]: a texel covered by less belongs to no face
CHUNK = 1 << 14  # number [triangles, or texels to clip] worked on at once
OVERLAP = 1.01  # area [of a texel]: a texel covered by more has several owners


def width_and_height(size: int | tuple[int, int]) -> tuple[int, int]:
    """An image's width and height [texels]: one number stands for both."""
    return (size, size) if isinstance(size, (int, np.integer)) else size


def texel_receivers(
    uv: np.ndarray, triangle: np.ndarray, size: int | tuple[int, int], image: int = 0
) -> Receivers:
    """One receiver per texel that lies at least partly on the surface.

    ``uv`` (n, 3, 2) float64, ``triangle`` (n,) their scene triangles, ``size`` of the image. Only
    what lies in the 0-1 tile is baked, as in Cycles; triangles without UV area (or with NaN in it)
    get no texel. Where triangles overlap the texel is the mean over all of them (see
    ``overlapping_texels``).
    Raises ValueError on mismatched shapes.
    """
    return finish(texel_steps(uv, triangle, size, image))


def texel_steps(
    uv: np.ndarray, triangle: np.ndarray, size: int | tuple[int, int], image: int = 0
):
    """``texel_receivers``, arguments and errors too, in steps of some hundredths of a second."""
    uv = np.asarray(uv, float)
    if uv.ndim != 3 or uv.shape[1:] != (3, 2) or len(uv) != len(triangle):
        raise ValueError(f"uv has shape {uv.shape}; it must be ({len(triangle)}, 3, 2)")
    size = width_and_height(size)
    points = uv * size
    parts = [_empty()]
    for start in range(0, len(points), CHUNK):
        for part in _cells(points[start : start + CHUNK], start, size):
            parts.append(part)
            yield start / len(points)
    texel, index, corners, square, area = (np.concatenate(column) for column in zip(*parts))
    del parts
    order = np.argsort(texel, kind="stable")
    order = order[_drop_negligible(texel[order], area[order])]
    texel, index = texel[order], index[order]
    first = np.diff(texel, prepend=-1) != 0
    flat = texel[first]
    grid = np.stack([np.full_like(flat, image), flat // size[0], flat % size[0]], 1)
    return Receivers(
        count=len(flat),
        receiver=(np.cumsum(first) - 1).astype(np.int32),
        triangle=np.asarray(triangle)[index].astype(np.int32),
        corners=corners[order],
        square=square[order],
        grid=grid.astype(np.int32),
        maps=_maps(points, np.asarray(triangle), index, image),
    )


def _maps(points: np.ndarray, triangle: np.ndarray, index: np.ndarray, image: int) -> TexelMaps:
    """Where the triangles ``index`` (n,) int, each listed once, lie in the ``image``, among all at ``points`` (k, 3,
    2)."""
    some = np.unique(index)
    images = np.full(len(some), image, np.int32)
    return TexelMaps(triangle[some].astype(np.int32), images, points[some].astype(np.float32))


def overlapping_texels(
    receivers: Receivers, uv: np.ndarray, start: int, size: int | tuple[int, int]
) -> int:
    """How many texels are covered more than once: the map's triangles overlap there. See
    ``coverage``."""
    return int((coverage(receivers, uv, start, size) > OVERLAP).sum())


def coverage(
    receivers: Receivers, uv: np.ndarray, start: int, size: int | tuple[int, int]
) -> np.ndarray:
    """(count,) how much of each texel is covered, above 1 where triangles overlap.

    ``uv`` (n, 3, 2) as given to ``texel_receivers``, of the scene triangles from ``start`` on.
    """
    width, height = width_and_height(size)
    texel_area = np.abs(doubled_areas(np.asarray(uv, float))) * (width * height)
    area = cell_areas(receivers.corners, receivers.square) / 2
    covered = area * texel_area[receivers.triangle - start]
    return np.bincount(receivers.receiver, covered, receivers.count)


def _empty():
    texel = np.zeros(0, np.int64)
    return texel, texel, np.zeros((0, 3, 2)), np.zeros(0, bool), np.zeros(0)


def _cells(points: np.ndarray, start: int, size: tuple[int, int]) -> Iterator[tuple]:
    """Cells of a chunk of triangles, in pieces: (texel, triangle, corners, square, area)."""
    finite = np.isfinite(points).all((1, 2))
    area = np.zeros(len(points))
    area[finite] = np.abs(doubled_areas(points[finite]))
    extent = np.ptp(points, axis=1).max(1)
    usable = np.nonzero(finite & (area > 1e-12 * np.maximum(extent, 1e-3) ** 2))[0]
    points = points[usable]
    inverse = _barycentric(points)
    width, height = size
    owner, row = _rows(points, height)
    for at in range(0, len(owner), CHUNK):
        who, y = owner[at : at + CHUNK], row[at : at + CHUNK]
        outer, inner = _spans(np.take(points, who, axis=0), y, width)
        full = _full_texels(inner, who, y)
        yield _finish(full, points, inverse, usable + start, width)
        partial = _partial(outer, inner, who, y)
        for i in range(0, len(partial[0]), CHUNK):
            piece = tuple(column[i : i + CHUNK] for column in partial)
            cells = _clipped(*piece, points)
            yield _finish(cells, points, inverse, usable + start, width)


def _barycentric(points: np.ndarray) -> np.ndarray:
    """(2, 2, n) matrices that take an offset in texels to one in barycentric (u, v)."""
    u, v = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    return np.array([[v[:, 1], -v[:, 0]], [-u[:, 1], u[:, 0]]]) / doubled_areas(points)


def _rows(points: np.ndarray, height: int) -> tuple[np.ndarray, np.ndarray]:
    """All (triangle, row) pairs that meet."""
    low = np.clip(np.floor(points[..., 1].min(1)), 0, height).astype(np.int64)
    high = np.clip(np.ceil(points[..., 1].max(1)), 0, height).astype(np.int64)
    owner, offset = ragged_ranges(np.maximum(high - low, 0))
    return owner, low[owner] + offset


def _spans(triangles: np.ndarray, row: np.ndarray, width: int):
    """Column ranges per (triangle, row): ``outer`` that meet it, ``inner`` that lie inside.

    Each is (first, last + 1). A texel is inside when its lower and its upper side are, because
    triangles are convex.
    """
    low, high = row.astype(float), row + 1.0
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    within = [np.array(left) for _ in range(2)] + [np.array(right) for _ in range(2)]
    for a, b in ((0, 1), (1, 2), (2, 0)):
        p, q = triangles[:, a], triangles[:, b]
        span = q[:, 1] - p[:, 1]
        flat = np.abs(span) < 1e-200  # so that the slope is finite
        slope = (q[:, 0] - p[:, 0]) / np.where(flat, 1.0, span)
        bottom, top = np.minimum(p[:, 1], q[:, 1]), np.maximum(p[:, 1], q[:, 1])
        meets = (bottom <= high) & (top >= low)
        for side, y in enumerate((low, high)):
            x = p[:, 0] + (np.clip(y, bottom, top) - p[:, 1]) * slope
            other = np.where(flat, q[:, 0], x)
            left = np.where(meets, np.minimum(left, np.minimum(x, other)), left)
            right = np.where(meets, np.maximum(right, np.maximum(x, other)), right)
            cuts = (bottom <= y) & (y <= top)
            ends = np.minimum(x, other), np.maximum(x, other)
            within[side] = np.where(cuts, np.minimum(within[side], ends[0]), within[side])
            within[2 + side] = np.where(cuts, np.maximum(within[2 + side], ends[1]),
                                        within[2 + side])
    first = np.ceil(np.maximum(within[0], within[1]) - 1e-9)
    last = np.floor(np.minimum(within[2], within[3]) + 1e-9)
    inside = np.isfinite(first) & np.isfinite(last) & (first < last)
    outer = _clamped(np.floor(left), np.ceil(right), width)
    inner = _clamped(np.where(inside, first, 0), np.where(inside, last, 0), width)
    empty = inner[0] >= inner[1]
    return outer, (np.where(empty, outer[1], inner[0]), np.where(empty, outer[1], inner[1]))


def _clamped(first, last, width) -> tuple[np.ndarray, np.ndarray]:
    first = np.clip(first, 0, width).astype(np.int64)
    return first, np.maximum(np.clip(last, 0, width).astype(np.int64), first)


def _full_texels(inner, owner, row):
    """Texels wholly inside one triangle: (owner, column, row, corners in the texel, square)."""
    span, offset = ragged_ranges(inner[1] - inner[0])
    corners = np.broadcast_to([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (len(span), 3, 2))
    return owner[span], inner[0][span] + offset, row[span], corners, np.ones(len(span), bool)


def _partial(outer, inner, owner, row):
    """Candidates left and right of the inner run: (owner, column, row)."""
    before, left = ragged_ranges(inner[0] - outer[0])
    after, right = ragged_ranges(outer[1] - inner[1])
    span = np.concatenate([before, after])
    column = np.concatenate([outer[0][before] + left, inner[1][after] + right])
    return owner[span], column, row[span]


def _clipped(owner, column, row, points):
    corner = np.stack([column, row], 1).astype(float)
    polygons, count = clip_squares(corner, np.take(points, owner, axis=0))
    who, corners, square = fan(polygons, count)
    return owner[who], column[who], row[who], corners, square


def _finish(cells, points, inverse, names, width):
    """From corners in the texel to barycentric ones: (texel, triangle, corners, square, area)."""
    owner, column, row, corners, square = cells
    area = cell_areas(corners, square) / 2
    matrix = np.take(inverse, owner, axis=2)
    offset = [at - points[owner, 0, axis] for axis, at in enumerate((column, row))]
    barycentric = np.empty(corners.shape)
    for corner in range(3):  # inner loops over cells, not over two numbers
        x, y = (corners[:, corner, axis] + offset[axis] for axis in range(2))
        for axis, (along_x, along_y) in enumerate(matrix):
            barycentric[:, corner, axis] = along_x * x + along_y * y
    keep = area > TOUCHED
    cells = row * width + column, names[owner], barycentric, square, area
    return cells if keep.all() else tuple(column[keep] for column in cells)


def _drop_negligible(texel: np.ndarray, area: np.ndarray) -> np.ndarray:
    """Which cells to keep (texels in order): the sizable ones, or all where none is."""
    first = np.nonzero(np.diff(texel, prepend=-1))[0]
    sizable = area > NEGLIGIBLE
    any_sizable = np.logical_or.reduceat(sizable, first) if len(texel) else sizable
    return sizable | ~np.repeat(any_sizable, np.diff(first, append=len(texel)))
