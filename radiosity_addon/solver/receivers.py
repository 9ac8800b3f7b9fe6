"""Receivers: what gets a colour. A texel and a piece of a face are the same thing here.

A receiver is the mean over its *footprint*: one or more cells, each a
parallelogram or a triangle lying flat in one scene triangle. Receivers are seen from the front.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


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


@dataclass(frozen=True)
class Projection:
    """Where the error is judged instead of at the receivers: at colours that are means of them.

    ``apply`` maps values (count, c) at receivers to colours (m, c), linearly; ``area`` (m,), in
    any unit, is what each colour counts by: that of the faces it is fitted to.
    """

    apply: Callable[[np.ndarray], np.ndarray]
    area: np.ndarray


def concatenate(parts: list[Receivers]) -> Receivers:
    """Join receivers of several objects in order; grids survive when every part has one."""
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
    )
