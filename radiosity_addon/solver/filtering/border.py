"""Border: texels at an island's edge, which have neighbors to one side only.

Opposite pairs of neighbors leave light that varies linearly as it is,
but along an edge that runs at an angle there are none, and its noise would stay as a dotted line.
Near neighbors on one side stand in for them: over a texel or two light hardly varies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..array_struct import ArrayStruct

LEVELS = 2  # number [levels] of kernels, from the first, that have borders: their neighbors are up to two texels away
PLANE = 0.1  # height [of its distance] of a neighbor over a texel's plane, at most
FACING = 0.99  # cosine [of an angle] between the normals of neighbors, at least
STRETCH = 2.0  # distance [per texel, of the nearest neighbor's] of a neighbor on the surface, at most
Missing = tuple[int, float, float, np.ndarray]  # a direction: see ``find_border``


@dataclass(frozen=True)
class Border(ArrayStruct):
    """``weight`` of the texels in the pixels ``other``, for those in ``pixel`` (k,) each."""

    pixel: np.ndarray
    other: np.ndarray
    weight: np.ndarray  # (k,) float32

    def within(self, most: np.ndarray) -> Border:
        """The weights of each texel made smaller where they add up to more than ``most`` (k,) of it: pairs have
        had the rest. A kernel that gave away more than all would turn what it averages around."""
        _, row, total = self._rows()
        factor = np.clip(most / total[row], 0, 1)
        return replace(self, weight=(factor * self.weight).astype(np.float32))

    def prepared(self, size: int) -> tuple[np.ndarray, csr_matrix]:
        """Pixels (r,), and (r, size) CSR: how much they change by, from pictures of ``size``."""
        pixels, row, total = self._rows()
        rows = np.concatenate([row, np.arange(len(pixels))])
        values = np.concatenate([self.weight, -total]).astype(np.float32)
        columns = np.concatenate([self.other, pixels])
        return pixels, csr_matrix((values, (rows, columns)), shape=(len(pixels), size))

    def _rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The pixels (r,) that are among ``pixel``, the row (k,) of each there, and the sums (r,) of weights."""
        pixels, row = np.unique(self.pixel, return_inverse=True)
        return pixels, row, np.bincount(row, self.weight, len(pixels))


def find_border(
    pixel: np.ndarray, number: np.ndarray, missing: list[Missing], position: np.ndarray,
    normal: np.ndarray, level: int,
) -> Border:
    """Neighbors to one side of texels in ``pixel`` (n,), whose ``position`` and ``normal`` are
    (n, 3). ``number`` is the picture of the texels' places in these arrays, −1 where there is none;
    ``missing`` has for each direction its offset in the picture, its length, its weight, and (n,)
    bool where there is no pair along it."""
    lacking = np.flatnonzero(np.logical_or.reduce([none for *_, none in missing]))
    nearest, found = np.full(len(pixel), np.inf), []
    for offset, length, weight, none in missing:
        for side in (offset, -offset):
            near = _plane_neighbors(lacking, pixel, number, side, position, normal)
            one, _, distance = near
            nearest[one] = np.minimum(nearest[one], distance / length)  # one of each
            if level:
                near = _plane_neighbors(lacking, pixel, number, side << level, position, normal)
            one, other, distance = near
            kept = none[one]
            found.append((one[kept], other[kept], distance[kept] / (length * (1 << level)),
                          np.full(kept.sum(), weight, np.float32)))  # fmt: skip
    one, other, width, weight = (np.concatenate(part) for part in zip(*found))
    kept = width <= STRETCH * nearest[one]
    return Border(pixel[one[kept]], pixel[other[kept]], weight[kept])


def _plane_neighbors(
    some: np.ndarray, pixel: np.ndarray, number: np.ndarray, offset: int, position: np.ndarray,
    normal: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the texels ``some`` (k,) those with a neighbor at an ``offset`` in their plane, that
    neighbor, and its distance."""
    other = number[pixel[some] + offset]
    some, other = some[other >= 0], other[other >= 0]
    step = position[other] - position[some]
    distance = np.sqrt(np.einsum("ij,ij->i", step, step))
    height = np.abs(np.einsum("ij,ij->i", step, normal[some]))
    facing = np.einsum("ij,ij->i", normal[some], normal[other])
    flat = (height <= PLANE * distance) & (facing > FACING)
    return some[flat], other[flat], distance[flat]
