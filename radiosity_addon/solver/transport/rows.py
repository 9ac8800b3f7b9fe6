"""Rows: form factors as rays. Row i of the matrix is what the rays of patch i hit.

The patches of receivers have a row each. Of elements only sides that light can reach a receiver
from get one: those that rays meet, those that their rays meet, and so on. There are no unknowns for
back sides that no ray meets.

An element's own rays start *where rays met it*. Its radiosity is then the mean over its part that
is seen, not over what a lamp, a carpet or a wall in front of it hides: light or shadow caught in a
narrow gap does not leak into the room through a large element.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..array_struct import ArrayStruct
from ..lights.context import Context
from ..sampling.points import Points, grouped_chunks
from .lit_patches import LitPatches, light_patches
from .onward import Ends, Onward, ends_of, go_on, join_ends
from .patches import Patches
from .places import Places, no_places, places_hit
from .rays import RAYS_PER_CHUNK, Shot, shared_directions, shoot, sky_mean

MAX_GENERATIONS = 64  # number [generations] of patches, each met by rays of the one before, at most
PHASE = "transport"
BLACK = -2  # code [rows]: a patch that reflects nothing has none


@dataclass(frozen=True)
class Rows:
    """n rows, all with the same number of rays."""

    patches: LitPatches  # the row's own, of each row
    hits: np.ndarray  # (n, rays) int32: entry met first by each ray
    later: Later  # what rays met behind surfaces that transmit, and where they went on
    sky: np.ndarray  # (n, channels): mean sky radiosity its escaping rays bring
    found: np.ndarray  # (n, channels): irradiance that its rays found on their way, after they went on
    onward: Onward | None  # where those that went on were reflected and ended; None: none did

    @property
    def rays(self) -> int:
        """Of each row."""
        return self.hits.shape[1]


@dataclass(frozen=True)
class Later(ArrayStruct):
    """k hits behind transmitting surfaces, and of rays that went on: row in its Rows, entry, weight
    (k, channels) of the ray's light."""

    row: np.ndarray
    entry: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class RowSamples:
    """Rays of each row, and the points that they start from, of elements and of receivers' patches."""

    rays: int
    points: int
    patch_rays: int
    patch_points: int


@dataclass(frozen=True)
class Transport:
    """Rows of rays."""

    blocks: tuple[Rows, ...]  # numbered one after the other
    row: np.ndarray  # (n_patches,) int32: its row, BLACK where it reflects nothing, else -1
    samples: RowSamples

    @property
    def count(self) -> int:
        """Of rows."""
        return sum(len(block.hits) for block in self.blocks)

    def joined(self, name: str) -> np.ndarray:
        """(n_rows, ...) what the LitPatches of all rows have by that name."""
        return np.concatenate([getattr(block.patches, name) for block in self.blocks])

    def numbered_from(self, first: int) -> Transport:
        """The same rows with ``first`` as the first; patches whose rows come before have none."""
        row = np.where(self.row >= first, self.row - first, np.int32(BLACK))
        return replace(self, row=row.astype(np.int32))


def trace_transport(
    context: Context, patches: Patches, known: list[tuple[LitPatches, int]], samples: RowSamples,
    key: tuple[int, ...], row: np.ndarray | None = None,
) -> Transport:
    """Trace rows for the ``known`` patches, with so many rays each, and for whatever their rays meet
    that reflects, with as many as ``samples`` tells, except those that have one by ``row``
    (n_patches,): see Transport, which the new ones are added to then."""
    row = np.full(patches.count, -1, np.int32) if row is None else row.copy()
    blocks, total, fresh = [], int(row.max(initial=-1)) + 1, known
    for generation in range(MAX_GENERATIONS):
        numbered = []
        for lit, number in fresh:
            row[lit.patch] = BLACK  # looked at: needs no row, or gets one now
            lit = lit.take(np.flatnonzero(lit.reflectance.max(axis=1) > 0))
            row[lit.patch] = total + np.arange(len(lit.patch))
            total += len(lit.patch)
            numbered.append((lit, number))
        places = []
        for part, (lit, number) in enumerate(numbered):
            if len(lit.patch):
                rows, found = _trace_rows(
                    context, patches, lit, row, number, (*key, generation, part)
                )
                blocks.append(rows)
                places.append(found)
        places = Places.join(places) if places else no_places()
        if len(places.entry) == 0:
            break
        fresh = light_patches_met(context, patches, places, samples, (*key, generation))
    return Transport(tuple(blocks or [_no_rows(context, samples)]), row, samples)


def light_patches_met(
    context: Context, patches: Patches, places: Places, samples: RowSamples, key: tuple[int, ...]
) -> list[tuple[LitPatches, int]]:
    """[(LitPatches, rays of each row)] of the patches that places lie on: receivers', and sides of
    elements."""
    patch, result = patches.of(places.entry), []
    for group, (rays, per) in enumerate([
        (samples.patch_rays, samples.patch_points), (samples.rays, samples.points),
    ]):  # fmt: skip
        some = np.flatnonzero((patch >= patches.first) == (group == 1))
        if len(some):
            lit = light_patches(context, places.take(some), patch[some], per, (*key, group))
            result.append((lit, rays))
    return result


def _no_rows(context: Context, samples: RowSamples) -> Rows:
    lit = light_patches(context, no_places(), np.zeros(0, np.int64), samples.points, (0,))
    nothing = np.zeros(0, np.int32)
    later = Later(nothing, nothing, np.zeros((0, context.channels), np.float32))
    light = np.zeros((0, context.channels))
    return Rows(lit, np.zeros((0, samples.rays), np.int32), later, light, light, None)


def _trace_rows(
    context: Context, patches: Patches, lit: LitPatches, row: np.ndarray, rays: int,
    key: tuple[int, ...],
) -> tuple[Rows, Places]:
    """(Rows of the n patches of ``lit``, ``rays`` each; the k Places that these meet on patches whose
    ``row`` (n_patches,) is -1, for which rows are missing)."""
    count = len(lit.patch)
    hits = np.empty((count, rays), np.int32)
    light = np.zeros((count, context.channels))
    nothing = np.zeros(0, np.int32)
    places = [no_places()]
    later = [Later(nothing, nothing, np.zeros((0, context.channels), np.float32))]
    work = _TraceChunk(context, patches, lit.points, row.copy(), rays, key)
    chunks = grouped_chunks(count, max(1, RAYS_PER_CHUNK // rays))
    onward = []
    for chosen, found in context.map_chunks(work, chunks, PHASE):
        hits[chosen] = found.hits
        light[chosen] = found.sky
        places += found.places
        later += found.later
        onward += found.onward
    onward = go_on(context, patches, join_ends(onward, context.channels), count, (*key, 4))
    ends = onward.ends
    later.append(Later(ends.owner, ends.places.entry, ends.weight.astype(np.float32)))
    places.append(ends.places.take(row[patches.of(ends.places.entry)] == -1))
    found = sum(onward.light(context, (*key, 5))) / rays
    light += onward.sky / rays
    return Rows(lit, hits, Later.join(later), light, found, onward), Places.join(places)


@dataclass(frozen=True)
class _TraceChunk:
    """Traces ``rays`` of each row of a (group, slice) of those that start at ``points`` (per, n)."""

    context: Context
    patches: Patches
    points: Points
    row: np.ndarray
    rays: int
    key: tuple[int, ...]

    def __call__(self, chunk: tuple[int, slice]) -> tuple[slice, _RowChunk]:
        group, chosen = chunk
        owners = np.arange(self.points.shape[1])[chosen]
        points = self.points.take(chosen)
        directions = shared_directions(points, self.rays, *self.key, group, 3)
        shot = shoot(self.context, self.patches, points, directions)
        return chosen, _row_chunk(self.context, self.patches, shot, owners, self.row)


@dataclass(frozen=True)
class _RowChunk:
    """What the rays of R rows met: see ``Rows``."""

    hits: np.ndarray  # (R, rays)
    sky: np.ndarray | float  # (R, channels)
    places: list[Places]  # on patches that have no row
    later: list[Later]
    onward: list[Ends]  # rays that ended on no patch


def _row_chunk(
    context: Context, patches: Patches, shot: Shot, owners: np.ndarray, row: np.ndarray
) -> _RowChunk:
    """Of rays that were shot from the rows ``owners`` (R,); ``row`` as in ``trace_transport``."""
    rays, count = shot.directions.shape[:2]
    sky, places, later, onward = 0.0, [], [], []
    for part in shot.met:
        sky = sky + sky_mean(context.sky, part.entry == patches.miss, part, shot.directions)
        some = places_hit(part, patches)
        places.append(some.take(row[patches.of(some.entry)] == -1))
        if part.rays is not None:
            later.append(Later(owners[part.rays % count], part.entry, part.weight))
        going = np.flatnonzero(part.entry == patches.onward)
        weight = np.ones((len(going), context.channels), np.float32)
        owner = owners[part.number(going) % count]
        onward.append(ends_of(part, shot.directions, going, owner, weight))
    return _RowChunk(shot.met[0].entry.reshape(rays, -1).T, sky, places, later, onward)


def form_factors(
    transport: Transport, patches: Patches
) -> tuple[csr_matrix, list[csr_matrix] | None]:
    """(n_rows, n_rows) float64 CSR: F_ij between rows, and for light that went through surfaces
    one matrix a channel (None where there is none). Rays to patches without a row carry nothing
    that is unknown and are left out; entries are >= 0 and rows sum to <= 1."""
    n, to_row = transport.count, patches.table(transport.row, -1)
    columns, data, number, rows, later, weights, first = [], [], [], [], [], [], 0
    for block in transport.blocks:
        found = to_row[block.hits]
        present = found >= 0
        columns.append(found[present])
        number.append(present.sum(axis=1))
        data.append(np.full(len(columns[-1]), 1.0 / max(block.rays, 1)))
        behind = to_row[block.later.entry]
        kept = np.flatnonzero(behind >= 0)
        rows.append(first + block.later.row[kept])
        later.append(behind[kept])
        weights.append(block.later.weight[kept] / block.rays)
        first += len(block.hits)
    starts = np.concatenate([[0], np.cumsum(np.concatenate(number))])
    matrix = csr_matrix((np.concatenate(data), np.concatenate(columns), starts), shape=(n, n))
    where = (np.concatenate(rows), np.concatenate(later))
    if len(where[0]) == 0:
        return matrix, None
    return matrix, [
        csr_matrix((weight, where), shape=(n, n)) for weight in np.concatenate(weights).T
    ]


def transported(
    matrix: csr_matrix, through: list[csr_matrix] | None, values: np.ndarray
) -> np.ndarray:
    """F times radiosities (n_rows, channels): irradiances."""
    result = matrix @ values
    if through is not None:
        for channel, matrix in enumerate(through):
            result[:, channel] += matrix @ values[:, channel]
    return result
