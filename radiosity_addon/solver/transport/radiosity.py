"""Radiosity: what rays look up, and the linear system of rows that it comes from."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..expected import Refused
from ..lights.context import Context
from .emission import emission_to_find
from .patches import Patches
from .rows import Transport, form_factors, transported
from .second_kind import solve_second_kind

SMALLEST = 1e-30  # area [unit box] of a receiver in its patch, at least: some have none that float32 can hold


@dataclass(frozen=True)
class Radiosity:
    """Radiosity of everything that rays can meet, (n_entries, channels) float32, 0 for the miss and
    nowhere: ``reflected`` light, and emission that is not sampled explicitly, or None."""

    patches: Patches
    reflected: np.ndarray
    emitted: np.ndarray | None
    varied: np.ndarray | None  # (n_entries,) float32 lengths of those whose ``emitted`` varies
    unknown: np.ndarray  # (n_entries,) bool: rays reached no such patch when it was solved
    transport: Transport | None  # None: nothing that is reflected counts
    solution: np.ndarray  # (n_rows, channels) reflected radiosity
    iterations: int
    residual: float
    seconds: float  # of the linear solve
    tolerance: float  # relative error of the bake that it is solved for
    # (P, channels) direct light that patches of receivers reflect, found at other points than those that light their rows
    other_lit: np.ndarray | None = None

    def table(self) -> Radiosity:
        """What rays look up, without how it was found."""
        return replace(self, transport=None, solution=self.solution[:0], other_lit=None)

    def share_of_elements(self) -> float:
        """The share of elements in all that the rays of rows met."""
        hits = [block.hits for block in self.transport.blocks]
        met = sum(int((each != self.patches.miss).sum()) for each in hits)
        return sum(int((each >= self.patches.cells).sum()) for each in hits) / max(met, 1)

    def with_gathered(
        self, row_radiosity: np.ndarray, receiver: np.ndarray, light: np.ndarray, rays: np.ndarray
    ) -> Radiosity:
        """With new radiosities of the patches that consist of the receivers ``receiver`` (k,) int alone: the mean
        over the rays of the patch's row, which brought ``row_radiosity`` (n_patches, channels), and over the ``rays``
        (k,) of the receivers, which brought ``light`` (k, channels)."""
        patches = self.patches.receivers
        patch = patches.patch[receiver]
        some = np.flatnonzero((patch >= 0) & patches.are_patches(receiver)[patch])
        patch = patch[some]
        part = np.maximum(patches.area[receiver[some]].astype(float), SMALLEST)
        part /= np.bincount(patch, part)[patch]
        own = self.transport.samples.patch_rays
        total = np.bincount(patch, rays[some])
        chosen = np.flatnonzero(total)
        mean = np.stack([np.bincount(patch, part * each)[chosen] for each in light[some].T], 1)
        share = (total[chosen] / (total[chosen] + own)).astype(np.float32)[:, None]
        reflected = self.reflected.copy()
        before = row_radiosity[chosen]
        reflected[chosen] = before + share * (mean.astype(np.float32) - before)
        return replace(self, reflected=reflected)


def solve_rows(
    context: Context, patches: Patches, transport: Transport, tolerance: float,
    known: Radiosity | None = None,
) -> Radiosity:
    """The linear system of the rows, and the table that rays look up. What rays meet beside the
    rows' own patches is as bright as ``known``; None: black."""
    reflectance = transport.joined("reflectance")
    if known is None:
        emitted, varied = emission_to_find(context, patches)
    else:
        emitted, varied = known.emitted, known.varied
    first_hand = np.concatenate([block.sky + block.found for block in transport.blocks])
    if emitted is not None:
        first_hand = first_hand + _brought_by(transport, emitted)
    if known is not None:
        first_hand = first_hand + _brought_by(transport, known.reflected)
    source = transport.joined("lit") + reflectance * first_hand
    solution, iterations, residual, began = source, 0, 0.0, time.perf_counter()
    if len(source) and source.any():
        factors = form_factors(transport, patches)
        _check_steady(reflectance[:, source.any(axis=0)], transport, factors[0])
        found = solve_second_kind(
            lambda x: reflectance * transported(*factors, x), source, 0.03 * tolerance, 500
        )
        solution, iterations, residual = found.solution, found.iterations, found.residual
    seconds = time.perf_counter() - began
    reflected = np.zeros((patches.count, context.channels), np.float32)
    reflected[transport.joined("patch")] = solution
    table = patches.table(reflected, np.float32(0))
    unknown = patches.table(transport.row == -1, False)
    return Radiosity(
        patches, table, emitted, varied, unknown, transport, solution, iterations, residual,
        seconds, tolerance,
    )


def _check_steady(reflectance: np.ndarray, transport: Transport, matrix: csr_matrix) -> None:
    """Raise Refused where light of a channel is only ever reflected, by all rows' ``reflectance``
    (n_rows, channels that have light): then none of it ever leaves."""
    lossless = (reflectance > 1 - 1e-9).all(axis=0).any()
    if lossless and matrix.nnz == sum(block.hits.size for block in transport.blocks):
        raise Refused(
            "every surface of this closed scene reflects all light (reflectance 1), of one color at least, so "
            "that light would grow without end; lower the reflectance of at least one material"
        )


def _brought_by(transport: Transport, table: np.ndarray) -> np.ndarray:
    """(n_rows, channels) float64 mean of ``table`` (n_entries, channels) over the entries that each row's
    rays meet: irradiance."""
    parts = []
    for block in transport.blocks:
        arriving, later = table[block.hits].mean(axis=1).astype(float), block.later
        np.add.at(arriving, later.row, table[later.entry] * later.weight / block.rays)
        parts.append(arriving)
    return np.concatenate(parts)
