"""Emission that rays must find: of surfaces that are not sampled explicitly, by entry."""

from __future__ import annotations

import numpy as np

from ..geometry.footprints import Footprints
from ..lights.context import Context
from ..lights.emissive_faces import emits_by_side
from ..materials.region_means import Regions, footprint_regions, triangle_regions
from .patches import Patches


def emission_to_find(
    context: Context, patches: Patches
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """(n_entries, channels) float32 exitance that rays must find, the exact mean over each cell or
    patch; and (n_entries,) float32 the lengths of those in which it varies, else 0. None where there
    is nothing such; where a picture is dark it does not vary, whatever rounding makes of it."""
    if not context.glows:
        return None, None
    emission = np.zeros((patches.entries, context.channels), np.float32)
    length = np.zeros(patches.entries, np.float32)
    elements, first = patches.elements, patches.cells
    leaf = (elements.element >= 0) & ~context.explicit[elements.triangle]
    cells = np.flatnonzero(leaf)
    regions = triangle_regions(elements.triangle[cells], elements.corners[cells])
    by_side = emits_by_side(context.scene)[regions.triangle]
    size = _lengths(context, regions)
    mean, deviation = context.mean_emission(regions)
    for side in (0, 1):
        emission[first + 2 * cells + side] = np.pi * mean
        length[first + 2 * cells + side] = (deviation > 0) * size
    some = np.flatnonzero(by_side)
    mean, deviation = context.mean_emission(regions.take(some), False)
    emission[first + 2 * cells[some] + 1] = np.pi * mean
    length[first + 2 * cells[some] + 1] = (deviation > 0) * size[some]
    if patches.receivers is not None:
        _add_receivers_emission(context, patches.receivers.footprints, emission, length)
    length *= emission.any(axis=1)
    return emission if emission.any() else None, length if length.any() else None


def _add_receivers_emission(
    context: Context, footprints: Footprints, emission: np.ndarray, length: np.ndarray
) -> None:
    """Set the first entries, which are the patches of receivers, to what their cells send out."""
    by_side = emits_by_side(context.scene)[footprints.triangle]
    glows = ~context.explicit[footprints.triangle]
    found = np.zeros((len(footprints.triangle), context.channels))
    longest = np.zeros(len(found), np.float32)
    for front in (True, False):  # backs shine as fronts do, but for those that emit apart
        for square in (False, True):
            some = np.flatnonzero((footprints.square == square) & glows & (by_side | front))
            regions = footprint_regions(footprints, some, square)
            mean, deviation = context.mean_emission(regions, front)
            found[some], longest[some] = np.pi * mean, (deviation > 0) * _lengths(context, regions)
        side = slice(0, footprints.count) if front else slice(footprints.count, 2 * footprints.count)
        emission[side] = footprints.mean_of_cells(found)
        length[side] = np.maximum.reduceat(longest, footprints.start[:-1])


def _lengths(context: Context, regions: Regions) -> np.ndarray:
    """(n,) the longest edges of triangular regions."""
    e1, e2 = context.geometry.e1[regions.triangle], context.geometry.e2[regions.triangle]
    u, v = (step[:, :1] * e1 + step[:, 1:] * e2 for step in (regions.u, regions.v))
    return np.max([np.linalg.norm(edge, axis=1) for edge in (u, v, u - v)], axis=0)
