"""Contacts: which cells of receivers are touched by the lines along which triangles cross.

A triangle may have many lines and a million cells, so its cells are sorted into squares of its
barycentric plane, and only the squares that a line meets are looked into.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.planar import determinants
from ..geometry.triangles import Geometry
from ..ragged import ragged_ranges
from ..receivers import Receivers
from ..workers.parallel import map_chunks, ranges
from .crossings import Crossings

EACH = 64  # number [cells in a square], about
FINEST = 1 << 10  # number [squares along a triangle's edge], at most
NEAR = 1e-5  # distance [of a cell's edge]: a line that is nearer touches the cell
LINES = 1 << 10  # number [lines] at a time


@dataclass(frozen=True)
class Contacts:
    """``line`` (k,) of the crossings runs through ``cell`` (k,), or along its border. No line meets
    the squares that are not ``met`` (m,) bool; ``square`` (n_cells,) tells where the cells are."""

    line: np.ndarray
    cell: np.ndarray
    square: np.ndarray
    met: np.ndarray


def find_contacts(crossings: Crossings, receivers: Receivers, threads: int = 1) -> Contacts:
    """Where the lines of all ``crossings`` touch the receivers' cells."""
    square, home = _squares(receivers.triangle, receivers.corners)
    order = np.argsort(square, kind="stable")
    start = np.searchsorted(square[order], np.arange(len(home) + 1))
    corners = _outline(receivers.corners, receivers.square)
    low, high = corners.min(axis=1), corners.max(axis=1)
    low, high = (
        f.reduceat(bound[order], start[:-1]) if len(order) else bound
        for f, bound in ((np.minimum, low), (np.maximum, high))
    )

    def work(some: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        bounds = (np.searchsorted(home, crossings.triangle[some], side) for side in
                  ("left", "right"))  # fmt: skip
        line, box = _repeated(np.arange(some.start, some.stop), *bounds)
        hit = _meets_box(crossings.ends[line], low[box], high[box])
        line, box = line[hit], box[hit]
        lines, index = _repeated(line, start[box], start[box + 1])
        cell = order[index]
        hit = meets_cell(
            crossings.ends[lines], receivers.corners[cell], receivers.square[cell]
        )
        return lines[hit], cell[hit], box

    chunks = ranges(len(crossings.triangle), LINES)
    nothing = (np.zeros(0, int),) * 3
    found = [nothing, *map_chunks(work, chunks, threads)]
    line, cell, box = (np.concatenate(part) for part in zip(*found))
    met = np.zeros(len(home), bool)
    met[box] = True
    return Contacts(line, cell, square, met)


def shares_above(
    geometry: Geometry, crossings: Crossings, receivers: Receivers, line: np.ndarray,
    cell: np.ndarray,
) -> np.ndarray:
    """(k,) float64 shares of the cells (k,) int that lie above the planes of the triangles that make the lines (k,) int."""
    corners, other = receivers.corners[cell], crossings.other[line]
    offset = geometry.at(receivers.triangle[cell, None], corners) - geometry.p0[other][:, None]
    height = np.einsum("kic,kc->ki", offset, geometry.normal[other])
    share = _above(height)
    square = receivers.square[cell]
    mirrored = height[square][:, [1, 2, 0]]
    mirrored[:, 2] = height[square, 1] + height[square, 2] - height[square, 0]
    share[square] = (share[square] + _above(mirrored)) / 2
    return share


def _above(height: np.ndarray) -> np.ndarray:
    """(k,) share of the area of triangles where a linear function is above 0, by its values at
    their corners (k, 3)."""
    low, middle, high = np.sort(height, axis=1).T
    span = np.maximum(high - low, 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        tip = high**2 / (span * (high - middle))
        base = 1 - low**2 / (span * (middle - low))
    return np.where(low >= 0, 1.0, np.where(high <= 0, 0.0, np.where(middle <= 0, tip, base)))


def _squares(triangle: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) int: numbers of the squares that cells (n, 3, 2) lie in, and (m,) the squares'
    triangles, ascending."""
    many = np.bincount(triangle) / EACH
    fine = np.clip(np.ceil(np.sqrt(many)), 1, FINEST)[triangle]
    middle = corners.mean(axis=1)
    column = np.clip(np.floor(middle * fine[:, None]), 0, fine[:, None] - 1).astype(np.int64)
    key = (triangle.astype(np.int64) * FINEST + column[:, 0]) * FINEST + column[:, 1]
    keys, square = np.unique(key, return_inverse=True)
    return square.reshape(-1), keys // FINEST**2


def _outline(corners: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(n, 4, 2) corners of cells (n, 3, 2); triangles have one of them twice."""
    fourth = np.where(square[:, None], corners[:, 1] + corners[:, 2] - corners[:, 0], corners[:, 0])
    return np.concatenate([corners, fourth[:, None]], axis=1)


def _repeated(
    values: np.ndarray, first: np.ndarray, last: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """``values`` (k,) repeated for each number from ``first`` to before ``last`` (k,), and these numbers."""
    owner, offset = ragged_ranges(last - first)
    return values[owner], first[owner] + offset


def _meets_box(ends: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(k,) bool: segments between ``ends`` (k, 2, 2) meet boxes (k, 2), by their slabs."""
    slack = NEAR * (high - low)
    bounds = np.stack([ends[:, 0] - (low - slack), (high + slack) - ends[:, 0]], 2)
    along = ends[:, 1] - ends[:, 0]
    return _within(bounds.reshape(-1, 4), np.stack([along, -along], 2).reshape(-1, 4))


def meets_cell(ends: np.ndarray, corners: np.ndarray, square: np.ndarray) -> np.ndarray:
    """(k,) bool: segments meet cells (k, 3, 2)."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice = determinants(u, v)
    inverse = np.stack([v[:, 1], -v[:, 0], -u[:, 1], u[:, 0]], 1).reshape(-1, 2, 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = inverse / twice[:, None, None]
        local = np.einsum("kab,keb->kea", inverse, ends - corners[:, :1])
        first, along = local[:, 0], local[:, 1] - local[:, 0]
        over = np.where(square[:, None], 1 - first, (1 - first.sum(axis=1))[:, None])
        along_over = np.where(square[:, None], -along, -along.sum(axis=1)[:, None])
        meets = _within(np.concatenate([first, over], 1) + NEAR, np.concatenate([along, along_over], 1))
    return meets & (twice != 0)


def _within(start: np.ndarray, change: np.ndarray) -> np.ndarray:
    """(k,) bool: somewhere between 0 and 1, all of start + t · change (k, m) are >= 0."""
    share = -start / np.where(change == 0, 1, change)
    outside = np.where((change == 0) & (start < 0), 2.0, 0.0)
    enter = np.where(change > 0, share, outside).max(axis=1).clip(0)
    leave = np.where(change < 0, share, 1.0).min(axis=1).clip(None, 1)
    return enter <= leave
