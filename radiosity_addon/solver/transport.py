"""Transport: form factors as rays. Row i of the matrix is what the rays of element side i hit.

Depends on ``elements``, ``points``, ``gather``. Only sides that light can reach a receiver from
get a row: those that receivers' rays meet, those that their rays meet, and so on. There are no
unknowns for back sides that no ray meets.

An element's own rays start *where rays met it*. Its radiosity is then the mean over its part that
is seen, not over what a lamp, a carpet or a wall in front of it hides: light or shadow caught in a
narrow gap does not leak into the room through a large element.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from .elements import Elements
from .embree import Hits
from .gather import RAYS_PER_CHUNK, shoot, sides_hit, sky_mean
from .geometry import Geometry
from .parallel import map_chunks
from .points import Points, grouped_chunks, points_on
from .sampling import uniform

MAX_GENERATIONS = 64  # of sides seen by sides seen by ... receivers


@dataclass(frozen=True)
class Places:
    """Where rays met sides, n places: cell side, triangle, barycentric u and v."""

    side: np.ndarray
    triangle: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def __getitem__(self, index) -> Places:
        return Places(self.side[index], self.triangle[index], self.u[index], self.v[index])


def join_places(parts: list[Places]) -> Places:
    """All places of all parts."""
    names = ("side", "triangle", "u", "v")
    return Places(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True)
class Transport:
    """Rows of rays. Cell sides are 2·cell + back, element sides 2·element + back."""

    sides: np.ndarray  # (n_rows,) int64: the element side of each row
    row: np.ndarray  # (2 n_elements,) int32: its row, or -1
    points: Points  # (per, n_rows): where its rays start
    hits: np.ndarray  # (n_rows, rays) int32: cell side met by each ray; the miss: none
    sky: np.ndarray  # (n_rows, 3): mean sky radiosity its escaping rays bring


def trace_transport(
    tracer, geometry: Geometry, elements: Elements, seeds: Places, useful: np.ndarray,
    rays: int, per: int, key, threads: int, tick, sky,
) -> Transport:
    """Trace rows for the sides that ``seeds`` lie on, and whatever their rays meet.

    ``useful`` (2 n_elements,) bool: the sides that reflect. ``per`` points share ``rays``.
    """
    row = np.full(2 * elements.count, -1, np.int32)
    generations, known = [], 0
    places = seeds
    for generation in range(MAX_GENERATIONS):
        side = elements.sides_of(places.side)
        fresh = np.flatnonzero((row[side] < 0) & useful[side])
        if len(fresh) == 0:
            break
        sides, points = _start_points(
            geometry, places[fresh], side[fresh], per, (*key, generation)
        )
        row[sides] = known + np.arange(len(sides))
        known += len(sides)
        hits, light, places = _trace_rows(
            tracer, elements, points, rays, (*key, generation), threads, tick, sky
        )
        generations.append((sides, points, hits, light))
    if not generations:
        none = np.zeros((per, 0), np.int32)
        nowhere = np.zeros((per, 0, 3), np.float32)
        points = Points(nowhere, nowhere, none, np.zeros((0, 3), np.float32))
        generations = [(np.zeros(0, int), points, np.zeros((0, rays), np.int32), np.zeros((0, 3)))]
    sides, points, hits, light = zip(*generations)
    return Transport(
        np.concatenate(sides),
        row,
        Points(
            *(np.concatenate([getattr(p, name) for p in points], axis=1)
              for name in ("position", "normal", "triangle")),
            turn=np.concatenate([p.turn for p in points]),
        ),
        np.concatenate(hits),
        np.concatenate(light),
    )


def _start_points(geometry, places: Places, side: np.ndarray, per: int, key):
    """The sides (R,) that places lie on, and ``per`` points on each, spread over its places."""
    order = np.argsort(side, kind="stable")
    sides, first, number = np.unique(side[order], return_index=True, return_counts=True)
    spread = ((np.arange(per)[:, None] + 0.5) / per * number).astype(np.int64)
    chosen = places[order[first + spread]]
    front = (chosen.side & 1) == 0
    turn = uniform((len(sides), 3), *key, 7)
    return sides, points_on(geometry, chosen.triangle, chosen.u, chosen.v, front, turn)


def _trace_rows(tracer, elements, points: Points, rays, key, threads, tick, sky):
    count = points.triangle.shape[1]
    hits = np.empty((count, rays), np.int32)
    light = np.zeros((count, 3))

    def work(chunk):
        group, chosen = chunk
        some = take_points(points, chosen)
        found, directions = shoot(tracer, some, rays, *key, group, 3)
        sides = sides_hit(elements, found)
        missed = (sides == elements.miss).reshape(rays, -1)
        places = places_hit(sides, found, elements.miss)
        return chosen, sides.reshape(rays, -1).T, sky_mean(sky, missed, directions), places

    places = []
    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, found, arriving, some in map_chunks(work, chunks, threads, tick):
        hits[chosen] = found
        light[chosen] = arriving
        places.append(some)
    return hits, light, join_places(places)


def places_hit(sides: np.ndarray, hits: Hits, miss: int) -> Places:
    """The hits as places."""
    met = np.flatnonzero(sides != miss)
    return Places(sides[met].astype(np.int32), hits.triangle[met], hits.u[met], hits.v[met])


def take_points(points: Points, chosen: np.ndarray) -> Points:
    """The points of some owners."""
    return Points(
        points.position[:, chosen],
        points.normal[:, chosen],
        points.triangle[:, chosen],
        points.turn[chosen],
    )


def form_factors(transport: Transport, elements: Elements) -> csr_matrix:
    """(n_rows, n_rows) float64 CSR: F_ij between rows. Rays to sides without a row carry nothing
    that is unknown and are left out; entries are >= 0 and rows sum to <= 1."""
    n, rays = transport.hits.shape
    columns = cell_rows(transport, elements)[transport.hits]
    present = columns >= 0
    starts = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
    data = np.full(starts[-1], 1.0 / max(rays, 1))
    return csr_matrix((data, columns[present], starts), shape=(n, n))


def cell_rows(transport: Transport, elements: Elements) -> np.ndarray:
    """(2 n_cells + 1,) int32: the row of each cell side, -1 for none and for the miss."""
    rows = transport.row.reshape(-1, 2)[elements.element].ravel()
    return np.append(rows, np.int32(-1))
