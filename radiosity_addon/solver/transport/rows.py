"""Rows: form factors as rays. Row i of the matrix is what the rays of element side i hit.

Only sides that light can reach a receiver from get a row: those that receivers' rays meet, those
that their rays meet, and so on. There are no unknowns for back sides that no ray meets.

An element's own rays start *where rays met it*. Its radiosity is then the mean over its part that
is seen, not over what a lamp, a carpet or a wall in front of it hides: light or shadow caught in a
narrow gap does not leak into the room through a large element.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..direct.irradiance import direct_light
from ..elements.elements import Elements
from ..lights.context import Context
from ..sampling.points import Points, grouped_chunks, join_points, points_on
from ..sampling.sobol import uniform
from ..tracing.embree import Hits
from ..workers.parallel import map_chunks
from .rays import RAYS_PER_CHUNK, find_lost, shoot, sides_hit, sky_mean

MAX_GENERATIONS = 64  # of sides seen by sides seen by ... receivers
STAGE = "transport"
BLACK = -2


@dataclass(frozen=True)
class Places:
    """Where rays met the surface, n places: cell side, triangle, barycentric u and v."""

    side: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def __getitem__(self, index) -> Places:
        return Places(self.side[index], self.triangle[index], self.u[index], self.v[index])

    def on(self, elements: Elements) -> Places:
        """The same places with the cell sides of other elements."""
        cells = elements.cells_at(self.triangle, self.u, self.v)
        return Places(2 * cells + (self.side & 1), self.triangle, self.u, self.v)


def places_hit(sides: np.ndarray, hits: Hits, miss: int) -> Places:
    """The hits of ``sides_hit`` that met something that is somewhere."""
    met = np.flatnonzero(sides < miss)
    return Places(sides[met], hits.triangle[met], hits.u[met], hits.v[met])


def join_places(parts: list[Places]) -> Places:
    """All places of all parts."""
    names = ("side", "triangle", "u", "v")
    return Places(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class Sides:
    """Element sides and what is known of them from their points, R sides."""

    side: np.ndarray  # (R,) int64
    points: Points  # (per, R)
    reflectance: np.ndarray  # (R, channels)
    lit: np.ndarray  # (R, channels): reflectance × direct irradiance, mean over the points
    spread: np.ndarray  # (R,): standard deviation of that over the points, mean of channels
    share: np.ndarray  # (R,): of all places, those on this side

    def take(self, chosen: np.ndarray) -> Sides:
        """Some of the sides."""
        return Sides(
            self.side[chosen], self.points.take(chosen), self.reflectance[chosen],
            self.lit[chosen], self.spread[chosen], self.share[chosen],
        )


def light_sides(context: Context, places: Places, side: np.ndarray, per: int, key) -> Sides:
    """The sides that places lie on, lit directly at ``per`` of these places each.

    ``side`` (n,) are the places' element sides.
    """
    order = np.argsort(side, kind="stable")
    sides, first, number = np.unique(side[order], return_index=True, return_counts=True)
    spread = ((np.arange(per)[:, None] + 0.5) / per * number).astype(np.int64)
    chosen = places[order[first + spread]]
    turn = uniform((len(sides), 3), *key, 7)
    front = (chosen.side & 1) == 0
    points = points_on(context.geometry, chosen.triangle, chosen.u, chosen.v, front, turn)
    reflectance, lit, spread = light_points(context, points, key)
    return Sides(
        sides, points, reflectance.mean(axis=0), lit, spread, number / max(len(side), 1)
    )


def light_points(context: Context, points: Points, key):
    """Reflectance (per, R, channels) at points (per, R), the mean (R, channels) of reflectance ×
    direct irradiance, and its standard deviation (R,) over the points, mean of channels, less what
    the choice among many lights adds."""
    per, count = points.shape
    single = points.single()
    irradiance, variance = direct_light(
        context, per * count, 1, lambda c, g: single.take(c), (*key, 8), STAGE
    )
    triangle = points.triangle.ravel()
    faces = context.geometry.normal[triangle]
    front = np.einsum("nc,nc->n", points.normal.reshape(-1, 3), faces) > 0
    reflectance = context.reflectance(triangle, points.uv.reshape(-1, 2), front)
    lit = (reflectance * irradiance).reshape(per, count, context.channels)
    noise = (reflectance.mean(axis=1) ** 2 * variance).reshape(per, -1).mean(axis=0)
    spread = np.sqrt(np.maximum(lit.std(axis=0).mean(axis=1) ** 2 - noise, 0))
    return reflectance.reshape(lit.shape), lit.mean(axis=0), spread


@dataclass(frozen=True)
class Transport:
    """Rows of rays. Cell sides are 2·cell + back, element sides 2·element + back."""

    sides: Sides  # of each row
    row: np.ndarray  # (2 n_elements,) int32: its row, BLACK where it reflects nothing, else -1
    hits: np.ndarray  # (n_rows, rays) int32: cell side met first by each ray; the miss: none
    later: Later  # what rays met behind surfaces that transmit
    sky: np.ndarray  # (n_rows, channels): mean sky radiosity its escaping rays bring

    @property
    def rays(self) -> int:
        """Of each row."""
        return self.hits.shape[1]

    def numbered_from(self, first: int) -> Transport:
        """The same rows with ``first`` as the first; sides whose rows come before have none."""
        row = np.where(self.row >= first, self.row - first, np.int32(BLACK))
        later = Later(self.later.row - first, self.later.side, self.later.weight)
        return replace(self, row=row.astype(np.int32), later=later)


@dataclass(frozen=True)
class Later:
    """k hits behind transmitting surfaces: row, cell side, weight (k, channels) of the ray's
    light."""

    row: np.ndarray
    side: np.ndarray
    weight: np.ndarray


def trace_transport(
    context: Context, elements: Elements, known: Sides, rays: int, per: int, key, row=None
) -> Transport:
    """Trace rows for the ``known`` sides, and for whatever their rays meet that reflects, except
    those that have one by ``row`` (2 n_elements,): see Transport, which the new ones are added to
    then."""
    row = np.full(2 * elements.count, -1, np.int32) if row is None else row.copy()
    generations, total, fresh = [], int(row.max(initial=-1)) + 1, known
    for generation in range(MAX_GENERATIONS):
        reflecting = np.flatnonzero(fresh.reflectance.max(axis=1) > 0)
        row[fresh.side] = BLACK  # looked at: needs no row, or gets one now
        fresh = fresh.take(reflecting)
        if len(fresh.side) == 0 and generations:
            break
        row[fresh.side] = total + np.arange(len(fresh.side))
        total += len(fresh.side)
        hits, later, sky, places = _trace_rows(
            context, elements, fresh.points, row, rays, (*key, generation)
        )
        later = Later(later.row + total - len(fresh.side), later.side, later.weight)
        generations.append((fresh, hits, later, sky))
        side = elements.sides_of(places.side)
        fresh = light_sides(context, places, side, per, (*key, generation))
    sides, hits, later, sky = zip(*generations)
    return Transport(
        join_sides(sides), row, np.concatenate(hits), join_later(later),
        np.concatenate(sky),
    )


def join_transports(before: Transport, more: Transport) -> Transport:
    """The rows of both; ``more`` was traced with the ``row`` of the one before."""
    return Transport(
        join_sides([before.sides, more.sides]), more.row, np.concatenate([before.hits, more.hits]),
        join_later([before.later, more.later]), np.concatenate([before.sky, more.sky]),
    )


def join_later(parts) -> Later:
    """All of all parts."""
    names = ("row", "side", "weight")
    return Later(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def join_sides(parts) -> Sides:
    """All sides of all parts."""
    arrays = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("side", "reflectance", "lit", "spread", "share")
    }
    return Sides(points=join_points([part.points for part in parts]), **arrays)


def _trace_rows(context: Context, elements: Elements, points: Points, row, rays: int, key):
    """Hits (R, rays), later hits, sky (R, channels), and the places on sides whose ``row`` is -1,
    for R owners' points."""
    count = points.shape[1]
    hits = np.empty((count, rays), np.int32)
    light = np.zeros((count, context.channels))
    nothing = np.zeros(0, np.int32)
    places = [Places(nothing, nothing, nothing, nothing)]
    later = [Later(nothing, nothing, np.zeros((0, context.channels), np.float32))]

    def work(chunk):
        group, chosen = chunk
        owners = np.arange(count)[chosen]
        met, directions = shoot(context, points.take(chosen), rays, *key, group, 3)
        arriving, sides, found = 0.0, [], []
        for part in met:
            sides.append(sides_hit(elements, part.hits))
            missed = sides[-1] == elements.miss
            arriving = arriving + sky_mean(context.sky, missed, part, directions)
            some = places_hit(sides[-1], part.hits, elements.miss)
            found.append(some[row[elements.sides_of(some.side)] == -1])
        behind = [
            Later(owners[part.rays % len(owners)], side, part.weight)
            for side, part in zip(sides[1:], met[1:])
        ]
        find_lost(sides[0], elements, len(owners))
        return chosen, sides[0].reshape(rays, -1).T, arriving, found, behind

    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, sides, arriving, found, behind in map_chunks(
        work, chunks, context.threads, context.tick(STAGE)
    ):
        hits[chosen] = sides
        light[chosen] = arriving
        places += found
        later += behind
    return hits, join_later(later), light, join_places(places)


def form_factors(transport: Transport, elements: Elements):
    """(n_rows, n_rows) float64 CSR: F_ij between rows, and for light that went through surfaces
    one matrix a channel (None where there is none). Rays to sides without a row carry nothing
    that is unknown and are left out; entries are >= 0 and rows sum to <= 1."""
    n, rays = transport.hits.shape
    to_row = elements.values_of_cells(transport.row, -1)
    columns = to_row[transport.hits]
    present = columns >= 0
    starts = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
    data = np.full(starts[-1], 1.0 / max(rays, 1))
    matrix = csr_matrix((data, columns[present], starts), shape=(n, n))
    later = transport.later
    column = to_row[later.side]
    kept = np.flatnonzero(column >= 0)
    if len(kept) == 0:
        return matrix, None
    where = (later.row[kept], column[kept])
    return matrix, [
        csr_matrix((weight / rays, where), shape=(n, n)) for weight in later.weight[kept].T
    ]


def transported(matrix, through, values: np.ndarray) -> np.ndarray:
    """F times radiosities (n_rows, channels): irradiances."""
    result = matrix @ values
    if through is not None:
        for channel, matrix in enumerate(through):
            result[:, channel] += matrix @ values[:, channel]
    return result
