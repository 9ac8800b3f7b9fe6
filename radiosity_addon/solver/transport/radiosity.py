"""Radiosity: one independent solve of the surface, from rays to radiosities of element sides.

Elements are divided where the direct light on them varies and receivers look: solve for what
matters, where it matters.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ..elements.discontinuities import MAX_GROWTH, set_apart
from ..elements.elements import Elements, build_elements, refine
from ..lights.context import Context
from ..lights.emissive_faces import emits_apart
from ..materials.region_means import triangle_regions
from ..workers.parallel import map_chunks, ranges
from .rays import shoot, sides_hit
from .receiver_map import ReceiverMap
from .rows import (
    Places,
    Sides,
    Transport,
    form_factors,
    join_places,
    join_sides,
    join_transports,
    light_sides,
    places_hit,
    trace_transport,
    transported,
)
from .second_kind import solve_second_kind

SEEDS_PER_ELEMENT = 40  # rays from receivers that look for elements
SEED_RAYS = 16  # from each receiver that takes part in that
MAX_REFINEMENTS = 6
HALVINGS = 2  # of an element's edges, where it is divided because it brings a bias


@dataclass(frozen=True)
class Radiosity:
    """Radiosity of everything that rays can meet, (2 n_cells + 2, channels) float32 by cell side, 0
    for the miss and nowhere: ``reflected`` light, and emission that is not sampled explicitly, or
    None."""

    elements: Elements
    reflected: np.ndarray
    emitted: np.ndarray | None
    varied: np.ndarray | None  # (2 n_cells + 2,) float32 lengths of cells whose ``emitted`` varies
    unknown: np.ndarray  # (2 n_cells + 2,) bool: rays reached no such side when it was solved
    transport: Transport | None  # None: nothing that is reflected counts
    solution: np.ndarray  # (n_rows, channels) reflected radiosity
    iterations: int
    residual: float
    seconds: float  # of the linear solve
    tolerance: float  # relative error of the bake that it is solved for
    source: np.ndarray  # (n_rows, channels) the part of the solution that is reflected first-hand
    receivers: ReceiverMap | None = None  # where they are known, what they reflect first-hand,
    of_receivers: np.ndarray | None = None  # (R, channels) float32, and what sides reflect beside
    beside: np.ndarray | None = None  # that, (2 n_cells + 2, channels) float32

    def reflected_at(self, side: np.ndarray, triangle, u, v) -> np.ndarray:
        """(n, channels) float32 reflected radiosity at cell sides (n,), and at barycentric (u, v)
        of triangles there: where a receiver is known, its own direct light takes the place of the
        element's, which is a mean over light and shadow."""
        light = np.take(self.reflected, side, axis=0)
        if self.receivers is not None:
            receiver = self.receivers.at(triangle, u, v, (side & 1) == 0)
            known = np.flatnonzero((receiver >= 0) & ~np.take(self.unknown, side))
            light[known] = np.take(self.of_receivers, receiver[known], axis=0)
            light[known] += np.take(self.beside, side[known], axis=0)
        return light

    def with_receivers(self, receivers: ReceiverMap, light: np.ndarray) -> Radiosity:
        """Where rays end on receivers, these reflect ``light`` (R, channels) first-hand."""
        found = replace(self, receivers=receivers, of_receivers=light.astype(np.float32))
        return replace(found, beside=found._beside())

    def _beside(self) -> np.ndarray:
        """(2 n_cells + 2, channels) float32 reflected radiosity less what is first-hand."""
        values = np.zeros((2 * self.elements.count, self.solution.shape[1]), np.float32)
        values[self.transport.sides.side] = self.solution - self.source
        return self.elements.values_of_cells(values, np.float32(0))


def solve_radiosity(
    context: Context, receivers: int, place, target: int, rays: int, per: int, tolerance: float, key
) -> Radiosity:
    """Solve on about ``target`` elements with ``rays`` rays from ``per`` points on each.

    ``place(chosen, group)`` gives Points of the ``receivers``, whose rays find the elements.
    """
    elements = build_elements(context.geometry, _groups(context.scene), target)
    elements = set_apart(context, elements, target, tolerance)
    places = _seeds(context, elements, receivers, place, target, key)
    elements, known = _refined(context, elements, places, per, target, tolerance, key)
    transport = trace_transport(context, elements, known, rays, per, (*key, 12))
    return solve_rows(context, elements, transport, tolerance)


def extended(context: Context, radiosity: Radiosity, places: Places, key) -> Radiosity:
    """With rows for the sides that ``places`` lie on, and for what their rays meet.

    Rays of the rows before met none of these sides, so that what is known stays as it is.
    """
    elements, before = radiosity.elements, radiosity.transport
    per, first = len(before.sides.points.position), len(before.sides.side)
    known = light_sides(context, places, elements.sides_of(places.side), per, (*key, 11))
    more = trace_transport(context, elements, known, before.rays, per, (*key, 12), before.row)
    found = solve_rows(
        context, elements, more.numbered_from(first), radiosity.tolerance, radiosity
    )
    result = replace(
        radiosity,
        reflected=radiosity.reflected + found.reflected,
        unknown=elements.values_of_cells(more.row == -1, False),
        transport=join_transports(before, more),
        solution=np.concatenate([radiosity.solution, found.solution]),
        source=np.concatenate([radiosity.source, found.source]),
        iterations=max(radiosity.iterations, found.iterations),
        residual=max(radiosity.residual, found.residual),
        seconds=radiosity.seconds + found.seconds,
    )
    return result if result.receivers is None else replace(result, beside=result._beside())


def divided(context: Context, radiosity: Radiosity, chosen, places: Places, key) -> Radiosity:
    """Solved anew with the elements ``chosen`` (k,) int divided, which are lit where ``places`` lie
    on their parts."""
    before = radiosity.transport
    elements = radiosity.elements
    parts = chosen
    for _ in range(HALVINGS):
        first = elements.count
        elements = refine(context.geometry, elements, parts)
        parts = np.arange(first, elements.count)
    kept = before.sides.take(np.flatnonzero(~np.isin(before.sides.side // 2, chosen)))
    inside = np.isin(radiosity.elements.sides_of(places.side) // 2, chosen)
    places = places[np.flatnonzero(inside)].on(elements)
    per = len(before.sides.points.position)
    fresh = light_sides(context, places, elements.sides_of(places.side), per, (*key, 13))
    known = join_sides([kept, fresh])
    transport = trace_transport(context, elements, known, before.rays, per, (*key, 14))
    return solve_rows(context, elements, transport, radiosity.tolerance)


def without_reflection(context: Context, target: int) -> Radiosity:
    """What rays can meet where nothing that is reflected counts: no unknowns, no rows."""
    elements = build_elements(context.geometry, _groups(context.scene), target)
    nothing = np.zeros((elements.nowhere + 1, context.channels), np.float32)
    emitted, known = _gathered_emission(context, elements), np.zeros(len(nothing), bool)
    return Radiosity(elements, nothing, *emitted, known, None, nothing[:0], 0, 0.0, 0.0, 1.0,
                     nothing[:0])


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
        worth = known.share * known.spread > tolerance * mean / np.sqrt(target)
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
    context: Context, elements: Elements, transport: Transport, tolerance: float,
    known: Radiosity | None = None,
) -> Radiosity:
    """The linear system of the rows, and the table that rays look up. What rays meet beside the
    rows' own sides is as bright as ``known``; None: black."""
    sides = transport.sides
    if known is None:
        emitted, varied = _gathered_emission(context, elements)
    else:
        emitted, varied = known.emitted, known.varied
    source = sides.lit + sides.reflectance * transport.sky
    if emitted is not None:
        source = source + sides.reflectance * _light_met(transport, emitted)
    first = source
    if known is not None:
        source = source + sides.reflectance * _light_met(transport, known.reflected)
    solution, iterations, residual, began = source, 0, 0.0, time.perf_counter()
    if len(source) and source.any():
        factors = form_factors(transport, elements)
        _check_steady(sides, transport, factors[0])
        found = solve_second_kind(
            lambda x: sides.reflectance * transported(*factors, x), source, 0.03 * tolerance, 500
        )
        solution, iterations, residual = found.solution, found.iterations, found.residual
    seconds = time.perf_counter() - began
    reflected = np.zeros((2 * elements.count, context.channels), np.float32)
    reflected[sides.side] = solution
    table = elements.values_of_cells(reflected, np.float32(0))
    unknown = elements.values_of_cells(transport.row == -1, False)
    return Radiosity(
        elements, table, emitted, varied, unknown, transport, solution, iterations, residual,
        seconds, tolerance, first,
    )


def _check_steady(sides: Sides, transport: Transport, matrix) -> None:
    """Raise ValueError where light is only ever reflected: then none of it ever leaves."""
    lossless = (sides.reflectance.min(axis=1) > 1 - 1e-9).all()
    if lossless and matrix.nnz == transport.hits.size:
        raise ValueError(
            "every surface of this closed scene reflects all light (reflectance 1), so that light "
            "would grow without end; lower the reflectance of at least one material"
        )


def _light_met(transport: Transport, table: np.ndarray) -> np.ndarray:
    """(n_rows, channels) irradiance by what rows' rays meet: ``table`` by cell side."""
    arriving = table[transport.hits].mean(axis=1).astype(float)
    later = transport.later
    np.add.at(arriving, later.row, table[later.side] * later.weight / transport.rays)
    return arriving


def _groups(scene) -> np.ndarray:
    """(n_triangles,) int64: the same number for the same object and material, without gaps: ten
    thousand of either would make a table of all pairs too large."""
    pair = scene.object.astype(np.int64) * len(scene.materials) + scene.material
    return np.unique(pair, return_inverse=True)[1].reshape(-1)


def _gathered_emission(context: Context, elements: Elements):
    """(2 n_cells + 2, channels) float32 exitance of cell sides that rays must find, the exact mean
    over each cell; and (2 n_cells + 2,) float32 the lengths of those in which it varies, else 0.
    None where there is nothing such."""
    if not context.glows:
        return None, None
    leaf = (elements.element >= 0) & ~context.explicit[elements.triangle]
    cells = np.flatnonzero(leaf)
    regions = triangle_regions(elements.triangle[cells], elements.corners[cells])
    emission = np.zeros((elements.nowhere + 1, context.channels), np.float32)
    length = np.zeros(elements.nowhere + 1, np.float32)
    apart = emits_apart(context.scene)[regions.triangle]
    size = _lengths(context, regions)
    mean, spread = context.mean_emission(regions)
    for side in (0, 1):
        emission[2 * cells + side], length[2 * cells + side] = np.pi * mean, (spread > 0) * size
    some = np.flatnonzero(apart)
    mean, spread = context.mean_emission(regions.take(some), False)
    emission[2 * cells[some] + 1], length[2 * cells[some] + 1] = (
        np.pi * mean, (spread > 0) * size[some]
    )
    return emission if emission.any() else None, length if length.any() else None


def _lengths(context: Context, regions) -> np.ndarray:
    """(n,) the longest edges of triangular regions."""
    e1, e2 = context.geometry.e1[regions.triangle], context.geometry.e2[regions.triangle]
    u, v = (step[:, :1] * e1 + step[:, 1:] * e2 for step in (regions.u, regions.v))
    return np.max([np.linalg.norm(edge, axis=1) for edge in (u, v, u - v)], axis=0)
