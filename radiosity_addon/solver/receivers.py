"""Receivers: what gets a color. A texel and a piece of a face are the same thing here.

A receiver is the mean over its *footprint*: one or more cells, each a
parallelogram or a triangle lying flat in one scene triangle. Receivers are seen from the front.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .array_struct import ArrayStruct


@dataclass(frozen=True)
class Shading:
    """The normals by which light on cells counts, and the rounded surface that it starts from.

    ``normal`` is the mean over a cell, shorter than 1 where it varies within; where it is 0, or
    faces away from the triangle, the triangle's own counts.
    """

    normal: np.ndarray  # (n_cells, 3) float32: light counts by the cosine to it
    smooth: np.ndarray | None  # (n_cells, 3) float32: before bump and normal maps; None: no maps
    height: np.ndarray  # (n_cells,) float32 [scene's length]: of the rounded surface over the cell


@dataclass(frozen=True)
class TexelMaps(ArrayStruct):
    """Where triangles lie in images: by this a place on a triangle finds its texel."""

    triangle: np.ndarray  # (k,) int32: scene triangles, each at most once
    image: np.ndarray  # (k,) int32
    corners: np.ndarray  # (k, 3, 2) float32 [texel]: column and row of their corners


@dataclass(frozen=True)
class Receivers:
    """Footprint cells, sorted by the receiver they belong to.

    Every index in ``range(count)`` must own at least one cell of positive area.
    """

    count: int
    receiver: np.ndarray  # (n_cells,) int32, ascending: which receiver the cell belongs to
    triangle: np.ndarray  # (n_cells,) int32: the scene triangle it lies in
    corners: np.ndarray  # (n_cells, 3, 2) float64: barycentric (u, v) of origin, +U, +V
    square: np.ndarray  # (n_cells,) bool: parallelogram origin + [0,1]U + [0,1]V, else triangle
    grid: np.ndarray | None = None  # (count, 3) int32: image, row, column of a texel; else None
    maps: TexelMaps | None = None  # of all triangles with cells, and maybe others; None: no texels
    shading: Shading | None = None  # None: every cell counts light by its triangle's normal


@dataclass(frozen=True)
class Projection:
    """Colors fitted to the light at receivers: where the error is judged instead of at the receivers.

    ``apply`` maps values (count, c) at receivers to colors (m, c), linearly. ``limits`` maps light (count, c), 1 or 3
    channels, to the lowest and the highest colors (m, c) that it may make, and ``show`` to the colors (m, 3) that users
    see, which are kept within these. ``receiver_factors`` maps squared errors (m,) of colors and (count,) of receivers to the
    factors (count,) by which the second become the first. ``area`` (m,), in any unit, is what each color counts by:
    that of the faces it is fitted to, or 0 where it does not count.
    """

    apply: Callable[[np.ndarray], np.ndarray]
    limits: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    show: Callable[[np.ndarray], np.ndarray]
    receiver_factors: Callable[[np.ndarray, np.ndarray], np.ndarray]
    area: np.ndarray


def concatenate(parts: list[Receivers]) -> Receivers:
    """Join receivers of several objects in order; grids survive when every part has one."""
    shading = [_shading_of(part) for part in parts]
    if all(part.shading is None for part in parts):
        shading = None
    offsets = np.cumsum([0] + [part.count for part in parts])
    grids = [part.grid for part in parts]
    return Receivers(
        count=int(offsets[-1]),
        receiver=np.concatenate(
            [part.receiver + offset for part, offset in zip(parts, offsets)]
        ).astype(np.int32),
        triangle=np.concatenate([part.triangle for part in parts]).astype(np.int32),
        corners=np.concatenate([part.corners for part in parts]),
        square=np.concatenate([part.square for part in parts]),
        grid=None if any(grid is None for grid in grids) else np.concatenate(grids),
        maps=None if any(part.maps is None for part in parts) else TexelMaps.join([part.maps for part in parts]),
        shading=shading and _joined(shading),
    )


def slice_receivers(receivers: Receivers, start: int, stop: int) -> Receivers:
    """The receivers ``start`` to ``stop`` alone, numbered from 0; views of the arrays, where they can be."""
    cells = slice(*np.searchsorted(receivers.receiver, (start, stop)))
    return _part(receivers, slice(start, stop), cells, receivers.receiver[cells] - np.int32(start), stop - start)


def chosen_receivers(receivers: Receivers, chosen: np.ndarray) -> Receivers:
    """The receivers ``chosen`` (count,) bool alone, numbered from 0."""
    cells = chosen[receivers.receiver]
    number = np.cumsum(chosen, dtype=np.int32) - np.int32(1)
    return _part(receivers, chosen, cells, number[receivers.receiver[cells]], int(chosen.sum()))


def _part(
    receivers: Receivers, rows: np.ndarray | slice, cells: np.ndarray | slice, receiver: np.ndarray, count: int
) -> Receivers:
    """The receivers ``rows``, ``count`` of them, which own ``cells`` by their new numbers ``receiver``."""
    found = receivers.shading
    return Receivers(
        count=count,
        receiver=receiver,
        triangle=receivers.triangle[cells],
        corners=receivers.corners[cells],
        square=receivers.square[cells],
        grid=None if receivers.grid is None else receivers.grid[rows],
        maps=receivers.maps,
        shading=found and Shading(
            found.normal[cells], None if found.smooth is None else found.smooth[cells],
            found.height[cells],
        ),
    )  # fmt: skip


def _shading_of(part: Receivers) -> Shading:
    n = len(part.triangle)
    return part.shading or Shading(np.zeros((n, 3), np.float32), None, np.zeros(n, np.float32))


def _joined(parts: list[Shading]) -> Shading:
    """The shading of all parts; ``smooth`` of those without maps is their normal."""
    smooth = None
    if any(part.smooth is not None for part in parts):
        smooth = np.concatenate(
            [part.normal if part.smooth is None else part.smooth for part in parts]
        )
    return Shading(
        np.concatenate([part.normal for part in parts]), smooth,
        np.concatenate([part.height for part in parts]),
    )
