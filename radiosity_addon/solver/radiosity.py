"""Radiosity: one independent solve of the surface, from rays to radiosities of element sides.

Depends on ``context``, ``elements``, ``emitters``, ``transport``, ``second_kind``. Elements are
divided where the direct light on them varies and receivers look: solve for what matters, where it
matters.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from .context import Context
from .elements import Elements, build_elements, refine
from .emitters import emits_apart
from .gather import shoot, sides_hit
from .geometry import OFFSET
from .parallel import map_chunks, ranges
from .points import Points
from .second_kind import solve_second_kind
from .transport import (
    BLACK, Places, Sides, Transport, form_factors, join_places, join_sides, light_sides, places_hit,
    trace_transport, transported,
)

SEEDS_PER_ELEMENT = 40  # rays from receivers that look for elements
SEED_RAYS = 16  # from each receiver that takes part in that
MAX_REFINEMENTS = 6
MAX_GROWTH = 4  # times the elements at the start


@dataclass(frozen=True)
class Radiosity:
    """Radiosity of everything that rays can meet, (2 n_cells + 1, channels) float32 by cell side, 0 for
    the miss: ``reflected`` light, and emission that is not sampled explicitly, or None."""

    elements: Elements
    reflected: np.ndarray
    emitted: np.ndarray | None
    transport: Transport | None  # None: nothing that is reflected counts
    solution: np.ndarray  # (n_rows, channels) reflected radiosity
    iterations: int
    residual: float
    seconds: float  # of the linear solve


def solve_radiosity(
    context: Context, receivers: int, place, target: int, rays: int, per: int, tolerance: float, key
) -> Radiosity:
    """Solve on about ``target`` elements with ``rays`` rays from ``per`` points on each.

    ``place(chosen, group)`` gives Points of the ``receivers``, whose rays find the elements.
    """
    elements = build_elements(context.geometry, _groups(context.scene), target)
    elements = _apart(context, elements, target, tolerance)
    places = _seeds(context, elements, receivers, place, target, key)
    elements, known = _refined(context, elements, places, per, target, tolerance, key)
    transport = trace_transport(context, elements, known, rays, per, (*key, 12))
    return solve_rows(context, elements, transport, tolerance)


def without_reflection(context: Context, target: int) -> Radiosity:
    """What rays can meet where nothing that is reflected counts: no unknowns, no rows."""
    elements = build_elements(context.geometry, _groups(context.scene), target)
    nothing = np.zeros((elements.miss + 1, context.channels), np.float32)
    return Radiosity(
        elements, nothing, _gathered_emission(context, elements), None, nothing[:0], 0, 0.0, 0.0
    )


def _apart(context: Context, elements: Elements, target: int, tolerance: float) -> Elements:
    """Divide elements that something stands on or cuts through.

    The parts of such an element do not see each other: inside a block that stands on the floor it
    is dark, and a radiosity shared with the lit floor around would leak in. Seen from just above
    the surface, the lines from an element's middle to its corners and between those are blocked.
    """
    if context.blockers[0].shadow is None:
        return elements
    levels = int(np.clip(np.ceil(np.log2(0.2 / tolerance)), 1, 6))
    fresh = np.flatnonzero(elements.grid[elements.triangle] > 1)
    for _ in range(levels):
        if len(fresh) == 0 or elements.count > MAX_GROWTH * target:
            break
        cut = fresh[_obstructed(context, elements, fresh)]
        start = len(elements.element)
        elements = refine(context.geometry, elements, elements.element[cut])
        fresh = np.arange(start, len(elements.element))
    return elements


def _obstructed(context: Context, elements: Elements, cells: np.ndarray) -> np.ndarray:
    """(k,) bool: something cuts through the flat cells (k,) int, seen from either side."""
    corners = elements.corners[cells].astype(float)
    middle = corners.mean(axis=1, keepdims=True)
    ends = np.concatenate([middle, middle + 0.99 * (corners - middle)], axis=1)
    triangle = elements.triangle[cells]
    position = context.geometry.at(triangle[:, None], ends)
    blocked = np.zeros(len(cells), bool)
    for side in (1, -1):
        lifted = position + side * 4 * OFFSET * context.geometry.normal[triangle][:, None]
        for a, b in ((0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (3, 1)):
            start = np.ascontiguousarray(lifted[:, a], np.float32)
            segment = np.ascontiguousarray(lifted[:, b] - lifted[:, a], np.float32)
            blocked |= ~context.blockers[0].shadow.clear(start, segment)
    return blocked


def _seeds(context, elements, receivers: int, place, target: int, key) -> Places:
    """Where rays from a sample of the receivers meet the surface."""
    wanted = int(np.ceil(SEEDS_PER_ELEMENT * target / SEED_RAYS))
    some = np.unique((np.arange(wanted) * (receivers / wanted)).astype(int))

    def work(part: slice):
        points = place(some[part], 0)
        met, _ = shoot(context, points, SEED_RAYS, *key, 10, part.start)
        return join_places([
            places_hit(sides_hit(elements, m.hits), m.hits, elements.miss) for m in met
        ])

    parts = map_chunks(work, ranges(len(some), 2048), context.threads, context.tick("elements"))
    return join_places(parts or [Places(*(np.zeros(0, int) for _ in range(4)))])


def _refined(context, elements, places: Places, per, target, tolerance, key):
    """Elements divided where direct light varies, and their sides that receivers see, lit."""
    known = light_sides(context, places, elements.sides_of(places.side), per, (*key, 11))
    mean = float((known.share @ known.lit).mean())
    for step in range(MAX_REFINEMENTS):
        worth = known.share * known.spread > 0.05 * tolerance * mean / np.sqrt(target)
        worth &= known.share * len(places.side) > 2
        divided = np.unique(known.side[worth] // 2)
        if len(divided) == 0 or elements.count > MAX_GROWTH * target:
            break
        elements = refine(context.geometry, elements, divided)
        places = places.on(elements)
        known = known.take(np.flatnonzero(~np.isin(known.side // 2, divided)))
        side = elements.sides_of(places.side)
        fresh = np.flatnonzero(~np.isin(side, known.side))
        lit = light_sides(context, places[fresh], side[fresh], per, (*key, 11, step))
        lit = Sides(lit.side, lit.points, lit.reflectance, lit.lit, lit.spread,
                    lit.share * (len(fresh) / len(side)))
        known = join_sides([known, lit])
    return elements, known


def solve_rows(
    context: Context, elements: Elements, transport: Transport, tolerance: float
) -> Radiosity:
    """The linear system of the rows, and the table that rays look up."""
    sides = transport.sides
    emitted = _gathered_emission(context, elements)
    source = sides.lit + sides.reflectance * transport.sky
    if emitted is not None:
        source = source + sides.reflectance * _emission_met(transport, emitted)
    solution, iterations, residual, began = source, 0, 0.0, time.perf_counter()
    if len(source) and source.any():
        factors = form_factors(transport, elements)
        _check_steady(sides, transport, factors[0])
        found = solve_second_kind(
            lambda x: sides.reflectance * transported(*factors, x), source, 0.03 * tolerance, 500
        )
        solution, iterations, residual = found.solution, found.iterations, found.residual
    seconds = time.perf_counter() - began
    reflected = _fill_unknown(context, elements, transport, solution)
    table = elements.values_of_cells(reflected.astype(np.float32), np.float32(0))
    return Radiosity(
        elements, table, emitted, transport, solution, iterations, residual, seconds
    )


def _check_steady(sides: Sides, transport: Transport, matrix) -> None:
    """Raise ValueError where light is only ever reflected: then none of it ever leaves."""
    lossless = (sides.reflectance.min(axis=1) > 1 - 1e-9).all()
    if lossless and matrix.nnz == transport.hits.size:
        raise ValueError(
            "every surface of this closed scene reflects all light (reflectance 1), so that light "
            "would grow without end; lower the reflectance of at least one material"
        )


def _emission_met(transport: Transport, emitted: np.ndarray) -> np.ndarray:
    """(n_rows, channels) irradiance by emission that rows' rays meet."""
    arriving = emitted[transport.hits].mean(axis=1).astype(float)
    later = transport.later
    np.add.at(arriving, later.row, emitted[later.side] * later.weight / transport.rays)
    return arriving


def _groups(scene) -> np.ndarray:
    """(n_triangles,) int64: the same number for the same object and material, without gaps: ten
    thousand of either would make a table of all pairs too large."""
    pair = scene.object.astype(np.int64) * len(scene.materials) + scene.material
    return np.unique(pair, return_inverse=True)[1].reshape(-1)


def _fill_unknown(context, elements: Elements, transport: Transport, solution) -> np.ndarray:
    """(2 n_elements, channels) reflected radiosity. A side that no row was traced for, though a later ray
    may meet it, gets the mean of the known sides of its object, material and facing."""
    scene, sides = context.scene, transport.sides
    kind = _groups(scene)
    whose = np.zeros(elements.count, np.int64)
    whose[elements.element[elements.element >= 0]] = kind[elements.triangle[elements.element >= 0]]
    whose = np.stack([2 * whose, 2 * whose + 1], 1).ravel()
    number = np.bincount(whose[sides.side], sides.share, whose.max(initial=0) + 1)
    values = np.empty((2 * elements.count, context.channels))
    for channel in range(context.channels):
        total = np.bincount(
            whose[sides.side], sides.share * solution[:, channel], len(number)
        )
        values[:, channel] = (total / np.where(number > 0, number, 1))[whose]
    values[transport.row == BLACK] = 0
    values[sides.side] = solution
    return values


def _gathered_emission(context: Context, elements: Elements) -> np.ndarray | None:
    """(2 n_cells + 1, channels) float32 exitance of cell sides that rays must find, the same over
    all of a cell (a texture's mean); None where there is none."""
    cells = np.flatnonzero(~context.explicit[elements.triangle])
    corners = elements.corners[cells].astype(float)
    weights = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6
    emission = np.zeros((len(elements.triangle), 2, context.channels))
    triangle = elements.triangle[cells]
    apart = emits_apart(context.scene)[triangle]
    for weight in weights:
        uv = np.einsum("c,ncd->nd", weight, corners)
        found = np.repeat(context.emission(triangle, uv)[:, None], 2, axis=1)
        found[apart, 1] = context.emission(triangle[apart], uv[apart], np.zeros(apart.sum(), bool))
        emission[cells] += np.pi / len(weights) * found
    if not emission.any():
        return None
    table = np.zeros((elements.miss + 1, context.channels), np.float32)
    table[:-1] = emission.reshape(-1, context.channels)
    return table
