"""Discontinuities: parts of the surface that do not see each other are different elements.

Inside a block that stands on the floor it is dark, and a radiosity shared with the lit floor around
would leak in. So cells are cut along what crosses them or stands on them, small faces share an
element only with what they see, and what is still obstructed is divided.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..direct.line_of_sight import LIFT, is_clear, is_path_clear
from ..geometry.grids import grid_cells
from ..lights.context import Context
from ..ragged import ragged_ranges
from ..tracing.crossings import Crossings
from .elements import INSIDE, Elements, cut_cells, refine

MAX_GROWTH = 4  # factor [elements at the start] of elements after refinement, at most
SPENT = 2.5  # factor [elements at the start] of elements after cuts, at most: what is left is for shadows' edges
SMALL = 0.004  # height [of the scene] over the cutting plane: lower faces are not cut
FEW = 3  # number [lines across a cell]: a cell with more is halved before it is cut
MOST_HALVINGS = 3  # number [halvings of a cell's edges] before it is cut, at most
MOST_CUTS = 12  # number [cuts of a cell], at most
PROBES = 8  # number [places along an edge] among which one inside of a cut cell's piece is looked for
MOST_TESTED = 1 << 18  # number [small faces]: where there are more, only those in elements with cut ones are tested
ROUNDS = 4  # number [rounds] in which hidden faces form new elements; those left over become elements of their own


def split_at_discontinuities(context: Context, elements: Elements, target: int, tolerance: float) -> Elements:
    """Divide elements so that none lies on both sides of something that stands on it, as far as ``target``, about the
    number of elements, allows. The smaller the ``tolerance``, the error asked for, the finer they are divided."""
    most = SPENT * max(elements.count, target)
    elements = _split_hidden(context, _cut_along_crossings(context, elements, most), most)
    return _refine_obstructed(context, elements, target, tolerance)


def _cut_along_crossings(context: Context, elements: Elements, most: float) -> Elements:
    """Cells cut along all that crosses them or stands on them, to at most ``most`` elements."""
    crossings = context.crossings.large(SMALL)
    n = elements.grid[crossings.triangle].astype(np.int64) ** 2
    line, offset = ragged_ranges(n)
    cell = elements.base[crossings.triangle[line]] + offset
    line, cell = _crossed(crossings, elements, line, cell)
    for _ in range(MOST_HALVINGS):
        many = np.bincount(cell, minlength=len(elements.element))[cell] > FEW
        many &= ~elements.shared()[cell]
        if not many.any() or elements.count > most:
            break
        elements = refine(context.geometry, elements, elements.element[np.unique(cell[many])])
        inner = elements.base[INSIDE - elements.element[cell[many]]]
        line = np.concatenate([line[~many], np.repeat(line[many], 4)])
        cell = np.concatenate([cell[~many], (inner[:, None] + np.arange(4)).ravel()])
        line, cell = _crossed(crossings, elements, line, cell)
    for _ in range(MOST_CUTS):
        kept = _affordable(context, elements, cell, most)
        line, cell = line[kept], cell[kept]
        if len(cell) == 0:
            break
        start = len(elements.element)
        now, first = np.unique(cell, return_index=True)
        height = _heights(crossings, elements, line[first], now)
        elements = cut_cells(elements, now, height)
        later = np.ones(len(cell), bool)
        later[first] = False
        line, part = line[later], np.searchsorted(now, cell[later])
        ends = _ends(crossings, elements, line, cell[later])
        above = np.einsum("kec,kc->ke", _weights(ends), height[part])
        either = [np.flatnonzero(some) for some in ((above < -LIFT).any(1), (above > LIFT).any(1))]
        cell = np.concatenate([start + 2 * part[some] + k for k, some in enumerate(either)])
        line = np.concatenate([line[some] for some in either])
    return elements


def _affordable(context: Context, elements: Elements, cell: np.ndarray, most: float) -> np.ndarray:
    """(k,) bool: whether ``cell`` (k,) is one of the largest, so many that no more than ``most``
    elements come of cutting them; cells that share an element make none."""
    area = elements.areas(context.geometry, cell)
    alone = ~elements.shared()[cell]
    cells, first = np.unique(cell[alone], return_index=True)
    room = max(int(most) - elements.count, 0) // 2
    largest = cells[np.argsort(-area[alone][first], kind="stable")[:room]]
    return ~alone | np.isin(cell, largest)


def _weights(uv: np.ndarray) -> np.ndarray:
    """(..., 3) barycentric weights of the corners at (..., 2)."""
    return np.concatenate([1 - uv.sum(axis=-1, keepdims=True), uv], axis=-1)


def _heights(crossings: Crossings, elements: Elements, line: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """(k, 3) heights over the cutting planes of lines (k,) at the corners of cells (k,)."""
    return np.einsum("kic,kc->ki", _weights(elements.corners[cell].astype(float)), crossings.height[line])


def _ends(crossings: Crossings, elements: Elements, line: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """(k, 2, 2) ends of lines (k,) in cells (k,), in the cells' own coordinates, clipped to the cell; equal ends
    where they pass it by."""
    corners = elements.corners[cell].astype(float)
    frame = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], 2)
    ends = crossings.ends[line] - corners[:, :1]
    ends = np.einsum("kab,keb->kea", np.linalg.inv(frame), ends)
    weights = _weights(ends)
    first, last = weights[:, 0], weights[:, 1]
    change = last - first
    share = -first / np.where(change == 0, 1, change)
    enter = np.where(change > 0, share, np.where((change == 0) & (first < 0), 2, 0)).max(axis=1)
    leave = np.where(change < 0, share, 1).min(axis=1)
    enter, leave = np.clip(enter, 0, 1), np.clip(leave, 0, 1)
    leave = np.maximum(enter, leave)
    part = np.stack([enter, leave], 1)[..., None]
    return ends[:, :1] + part * (ends[:, 1:] - ends[:, :1])


def _crossed(
    crossings: Crossings, elements: Elements, line: np.ndarray, cell: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Those of the pairs line (k,) and cell (k,) where the line runs across the cell."""
    height = _heights(crossings, elements, line, cell)
    both = (height.min(axis=1) < -LIFT) & (height.max(axis=1) > LIFT)
    line, cell = line[both], cell[both]
    ends = _ends(crossings, elements, line, cell)
    runs = np.abs(ends[:, 1] - ends[:, 0]).max(axis=1) > 1e-6
    return line[runs], cell[runs]


def _split_hidden(context: Context, elements: Elements, most: float) -> Elements:
    """Keep small faces in an element with one that they see; the others form new elements, until there
    are ``most``."""
    cell = np.flatnonzero(elements.shared())
    pieces = elements.pieces()
    if len(cell) > MOST_TESTED:
        mixed = np.unique(elements.element[cell[pieces[cell]]])
        cell = cell[np.isin(elements.element[cell], mixed)]
    triangle, uv = elements.triangle[cell], elements.corners[cell].mean(axis=1, dtype=float)
    placed = np.ones(len(cell), bool)
    uv[pieces[cell]], placed[pieces[cell]] = _inside(elements, cell[pieces[cell]])
    position, normal = context.geometry.at(triangle, uv), context.geometry.normal[triangle]
    element, count = elements.element.copy(), elements.count
    left = np.flatnonzero(placed)
    for _ in range(ROUNDS):
        hidden = ~_sees(context, position[left], normal[left], element[cell[left]])
        left = left[hidden]
        new, label = np.unique(element[cell[left]], return_inverse=True)
        if count + len(new) > most:
            break
        element[cell[left]] = count + label
        count += len(new)
    alone = cell[np.append(left, np.flatnonzero(~placed))][: max(int(most) - count, 0)]
    element[alone] = count + np.arange(len(alone))
    return replace(elements, element=element, count=count + len(alone))


def _inside(elements: Elements, cell: np.ndarray) -> np.ndarray:
    """(k, 2) barycentric points in the pieces of cut cells (k,), and (k,) bool where one was found: a
    piece may be too small."""
    probes = grid_cells(PROBES).mean(axis=1)
    corners = elements.corners[cell]
    uv = np.einsum("pi,kic->kpc", _weights(probes), corners)
    shape = uv.shape[:2]
    triangle = np.broadcast_to(elements.triangle[cell, None], shape).ravel()
    found = elements.cells_at(triangle, uv[..., 0].ravel(), uv[..., 1].ravel()).reshape(shape)
    own = (found == cell[:, None])[..., None]
    mean = (uv * own).sum(axis=1) / np.maximum(own.sum(axis=1), 1)
    distance = np.where(own, np.abs(uv - mean[:, None]), np.inf).sum(axis=2)
    return uv[np.arange(len(cell)), distance.argmin(axis=1)], own.any(axis=(1, 2))


def _sees(
    context: Context, position: np.ndarray, normal: np.ndarray, label: np.ndarray
) -> np.ndarray:
    """(k,) bool: the path from a place to that one of the places with its ``label`` (k,) which is nearest to their mean
    is clear, above the surface and below: see ``is_path_clear``."""
    labels, label = np.unique(label, return_inverse=True)
    number = np.bincount(label)
    mean = np.stack([np.bincount(label, axis) / number for axis in position.T], 1)
    order = np.lexsort([((position - mean[label]) ** 2).sum(axis=1), label])
    middle = order[np.searchsorted(label[order], np.arange(len(labels)))][label]
    clear = np.ones(len(label), bool)
    for side in (1, -1):
        up = side * normal
        clear &= is_path_clear(context, position, up, position[middle], up[middle])
    clear[middle] = True
    return clear


def _refine_obstructed(context: Context, elements: Elements, target: int, tolerance: float) -> Elements:
    """Divide elements of one cell on which something stands: just above the surface, segments between
    the cell's middle and its corners are blocked."""
    levels = int(np.clip(np.ceil(np.log2(0.2 / tolerance)), 1, 6))
    single = (elements.element >= 0) & (elements.grid[elements.triangle] > 1)
    fresh = np.flatnonzero(single & ~elements.pieces())
    for _ in range(levels):
        if len(fresh) == 0 or elements.count > MAX_GROWTH * target:
            break
        cut = fresh[_obstructed(context, elements, fresh)]
        start = len(elements.element)
        elements = refine(context.geometry, elements, elements.element[cut])
        fresh = np.arange(start, len(elements.element))
    return elements


def _obstructed(context: Context, elements: Elements, cells: np.ndarray) -> np.ndarray:
    """(k,) bool: something stands on ``cells`` (k,) int or cuts through them, on either side."""
    corners = elements.corners[cells].astype(float)
    middle = corners.mean(axis=1, keepdims=True)
    ends = np.concatenate([middle, middle + 0.99 * (corners - middle)], axis=1)
    triangle = elements.triangle[cells]
    position = context.geometry.at(triangle[:, None], ends)
    blocked = np.zeros(len(cells), bool)
    for side in (1, -1):
        lifted = position + side * LIFT * context.geometry.normal[triangle][:, None]
        for a, b in ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1)):
            blocked |= ~is_clear(context, lifted[:, a], lifted[:, b])
    return blocked
