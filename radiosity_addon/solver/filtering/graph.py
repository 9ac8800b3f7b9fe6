"""Graph: receivers anywhere as neighbors of each other, for meshes without an image.

A receiver's neighbors are the nearest that face the same way and lie
in its plane, or nearly; a kernel averages over them by area, and kernels of growing width are that
one applied 1, 2, 4, ... times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix, diags_array

from .neighborhood import Sees
from .walls import Walls

LEVELS = 5  # number [levels]: kernels are applied 1, 2, 4, 8, 16 times
NEAREST = 9  # number [neighbors], the receiver itself among them
# Number [receivers], at least, that are smoothed: fewer agree by chance, have rays enough of their own, and are too few for
# some to be held out, which tell what smoothing leaves.
LEAST = 2048
FACING = 0.8  # cosine [of an angle] between the normals of neighbors, at least
SLOPE = 0.4  # height [of its distance] of a neighbor over the receiver's plane, at most


@dataclass(frozen=True)
class Graph:
    """``kernel`` (n, n) CSR float32: rows >= 0 that add up to 1. A Neighborhood."""

    kernel: csr_matrix
    levels: int = LEVELS

    @property
    def index(self) -> slice:
        """All receivers."""
        return slice(None)

    def as_pictures(
        self, values: np.ndarray, chosen: list[int] | None = None, factor: float = 1.0
    ) -> np.ndarray:
        """(c, n) float32."""
        values = values if chosen is None else values[:, chosen]
        return np.ascontiguousarray((values * factor).T, np.float32)

    def read(self, picture: np.ndarray) -> np.ndarray:
        """(n,)."""
        return picture

    def variance_kept(self, level: int) -> float:
        """The share of independent noise's variance that the kernel of ``level`` leaves: it is
        spread over NEAREST receivers, and over as many more each time."""
        return 1 / (NEAREST << level)

    def averaging_levels(self, level: int) -> int:
        """Levels of kernels that average what decides whether to go to ``level``."""
        return min(level + 2, 3)

    def beside(self, picture: np.ndarray) -> np.ndarray:
        """Of (n,) >= 0, above 0 at the receivers that have a neighbor above 0."""
        return self.step(picture, level=0)[0]

    def step(
        self, *pictures: np.ndarray, level: int, into: list[np.ndarray] | None = None
    ) -> list[np.ndarray]:
        """The kernel of a level applied to pictures (n,); ``into`` is left alone."""
        values = np.stack(pictures, 1)
        for _ in range(1 << level):
            values = self.kernel @ values
        return list(np.ascontiguousarray(values.T))

    def separated(self, dark: np.ndarray, sees: Sees) -> Graph:
        """Without the links by which receivers that are ``dark`` (n,) bool would get light from
        others that are not and that they do not see: ``sees(one, other)`` (k,) bool."""
        row = np.repeat(np.arange(len(dark)), np.diff(self.kernel.indptr))
        link = np.flatnonzero(dark[row] & ~dark[self.kernel.indices])
        cut = link[~sees(row[link], self.kernel.indices[link])]
        data = self.kernel.data.copy()
        data[cut] = 0
        kept = csr_matrix((data, self.kernel.indices, self.kernel.indptr), self.kernel.shape)
        lost = np.bincount(row[cut], self.kernel.data[cut], len(dark)).astype(np.float32)
        return Graph(kept + diags_array(lost))


def build_graph(
    position: np.ndarray, normal: np.ndarray, area: np.ndarray, threads: int,
    walls: Walls | None = None,
) -> list[Graph]:
    """One graph of all receivers: ``position``, ``normal`` (n, 3), ``area`` (n,); [] for a few.
    ``walls`` part neighbors (see ``walls``)."""
    if len(position) < LEAST:
        return []
    from scipy.spatial import cKDTree

    distinct = _distinct(position)
    distance, near = cKDTree(distinct).query(distinct, NEAREST, workers=threads or -1)
    step = position[near] - position[:, None]
    length = np.linalg.norm(normal, axis=1)
    unit = normal / np.where(length > 0, length, 1)[:, None]
    facing = np.einsum("nkc,nc->nk", unit[near], unit)
    height = np.abs(np.einsum("nkc,nc->nk", step, unit))
    weight = np.where((facing > FACING) & (height <= SLOPE * distance), area[near], 0.0)
    if walls is not None:
        one, k = np.nonzero((weight > 0) & (walls.crossed[:, None] | walls.crossed[near]))
        cut = walls.between(one, near[one, k])
        weight[one[cut], k[cut]] = 0
    weight[:, 0] = np.maximum(area[near[:, 0]], 1e-300)
    weight /= weight.sum(axis=1, keepdims=True)
    n = len(position)
    starts = np.arange(0, n * NEAREST + 1, NEAREST)
    kernel = csr_matrix((weight.ravel().astype(np.float32), near.ravel(), starts), shape=(n, n))
    kernel.eliminate_zeros()
    return [Graph(kernel)]


def _distinct(position: np.ndarray) -> np.ndarray:
    """(n, 3) positions; those of many faces on one another moved by next to nothing, as a tree
    cannot part them and would compare each with all."""
    line = position @ np.array([0.6, 0.48, 0.64])
    if len(np.unique(line)) > len(line) / 4:
        return position
    return position + 1e-9 * np.random.default_rng(0).random(position.shape)
