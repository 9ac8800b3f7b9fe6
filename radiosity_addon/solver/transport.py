"""Transport: form factors as rays. Row i of the matrix is what the rays of element side i hit.

Depends on ``elements``, ``footprints``, ``gather``. Only sides that light can reach a receiver
from get a row: those that receivers see, those that these see, and so on. There are no unknowns
for back sides that no ray meets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from .elements import Elements
from .footprints import Footprints, grouped_chunks
from .gather import RAYS_PER_CHUNK, sky_mean, trace_footprints
from .parallel import map_chunks

MAX_GENERATIONS = 32  # of sides seen by sides seen by ... receivers


@dataclass(frozen=True)
class Transport:
    """Rows of rays. Cell sides are 2·cell + back, element sides 2·element + back."""

    sides: np.ndarray  # (n_rows,) int64: the element side of each row
    row: np.ndarray  # (2 n_elements,) int32: its row, or -1
    hits: np.ndarray  # (n_rows, rays) int32: cell side met by each ray; 2 n_cells: none
    sky: np.ndarray  # (n_rows, 3): mean sky radiosity its escaping rays bring


def sides_of_elements(elements: Elements, cell_sides: np.ndarray) -> np.ndarray:
    """Element sides of cell sides, none of which may be the miss."""
    return 2 * elements.element[cell_sides >> 1].astype(np.int64) + (cell_sides & 1)


def trace_transport(
    tracer, elements: Elements, sided: Footprints, seeds: np.ndarray, useful: np.ndarray,
    rays: int, key, threads: int, tick, sky,
) -> Transport:
    """Trace rows for the ``seeds`` (element sides) and whatever they see.

    ``sided``: footprints of all element sides; ``useful`` (2 n_elements,) bool: sides that reflect.
    """
    miss = 2 * len(elements.element)
    row = np.full(sided.count, -1, np.int32)
    all_sides, all_hits, all_sky = [], [], []
    frontier, known = seeds[useful[seeds]], 0
    for _ in range(MAX_GENERATIONS):
        if len(frontier) == 0:
            break
        row[frontier] = known + np.arange(len(frontier))
        known += len(frontier)
        footprints = sided.subset(frontier)
        hits, light = _trace_rows(
            tracer, elements, footprints, rays, key, threads, tick, sky
        )
        all_sides.append(frontier)
        all_hits.append(hits)
        all_sky.append(light)
        seen = np.zeros(miss + 1, bool)
        seen[hits.ravel()] = True
        reached = np.unique(sides_of_elements(elements, np.flatnonzero(seen[:-1])))
        frontier = reached[(row[reached] < 0) & useful[reached]]
    return Transport(
        np.concatenate(all_sides) if all_sides else np.zeros(0, np.int64),
        row,
        np.concatenate(all_hits) if all_hits else np.zeros((0, rays), np.int32),
        np.concatenate(all_sky) if all_sky else np.zeros((0, 3)),
    )


def _trace_rows(tracer, elements, footprints, rays, key, threads, tick, sky):
    hits = np.empty((footprints.count, rays), np.int32)
    light = np.zeros((footprints.count, 3))
    miss = 2 * len(elements.element)

    def work(chunk):
        group, chosen = chunk
        sides, directions = trace_footprints(
            tracer, elements, footprints, chosen, rays, key, group
        )
        return chosen, sides.T, sky_mean(sky, sides == miss, directions, 3)

    chunks = grouped_chunks(footprints.count, max(1, RAYS_PER_CHUNK // rays))
    for chosen, found, arriving in map_chunks(work, chunks, threads, tick):
        hits[chosen] = found
        light[chosen] = arriving
    return hits, light


def form_factors(transport: Transport, elements: Elements) -> csr_matrix:
    """(n_rows, n_rows) float64 CSR: F_ij between rows. Rays to sides without a row carry nothing
    that is unknown and are left out; entries are >= 0 and rows sum to <= 1."""
    n, rays = transport.hits.shape
    to_row = cell_rows(transport, elements)
    columns = to_row[transport.hits]
    present = columns >= 0
    starts = np.concatenate([[0], np.cumsum(present.sum(axis=1))])
    data = np.full(starts[-1], 1.0 / max(rays, 1))
    matrix = csr_matrix((data, columns[present], starts), shape=(n, n))
    return matrix


def cell_rows(transport: Transport, elements: Elements) -> np.ndarray:
    """(2 n_cells + 1,) int32: the row of each cell side, -1 for none and for the miss."""
    rows = transport.row.reshape(-1, 2)[elements.element].ravel()
    return np.append(rows, np.int32(-1))
