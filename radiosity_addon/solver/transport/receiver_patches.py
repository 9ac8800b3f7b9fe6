"""Patches of receivers: the footprints of receivers as what has one radiosity.

Receivers follow the mesh and the user's own resolution, so that a patch of them lies on one side of
each wall. A receiver whose cells face different ways, or lie far from each other, is several. Where
there are very many, texels that are neighbors in an image are one patch together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.clusters import cubes, facings, labels
from ..geometry.footprints import Footprints
from ..receivers import Receivers
from .receiver_map import NOTHING, ReceiverMap, build_receiver_map

MOST_PATCHES = 2_000_000  # number [patches of receivers], at most: bounds the memory of their rows
# Number [receivers]: from it on squares of 2 × 2 texels are one patch, from four times as many on of 3 × 3, and so on.
MANY_PATCHES = 500_000
ALIKE = 0.7  # cosine [of an angle] between normals of cells that are one patch, at least
EXTENT = 2.0  # distance [mean edges of a receiver]: cells further apart are different patches
BAKED = 0.5  # share [of an object's area] in patches: above it its other faces get no elements
COMPLETE = 1 - 1e-4  # share [of a triangle] that receivers have of one that is not cut
SMALLEST = 1e-6  # extent [unit box] of a patch, at least
ONWARD, SEVERAL = NOTHING - 1, NOTHING - 2  # codes [``ReceiverPatches.patch``], see there


@dataclass(frozen=True)
class ReceiverPatches:
    """P patches of receivers, which lie where ``footprints`` tells.

    ``patch`` (R,) int32: of a receiver that lies in one; NOTHING where elements are finer, ONWARD where it
    has none, SEVERAL where it is more than one. ``cut`` (n_triangles,) bool are triangles of which
    receivers have a part only: on the rest lies what is buried, or too small, and a texel's light there is
    that of other faces in it. The patches of SEVERAL, and of all receivers on ``cut`` triangles, are found
    by ``keys`` (k,) int64, sorted: receiver · n_triangles + triangle, of those that have a cell there, and
    their ``values`` (k,) int32.
    """

    map: ReceiverMap
    patch: np.ndarray
    keys: np.ndarray
    values: np.ndarray
    cut: np.ndarray
    baked: np.ndarray  # (n_triangles,) bool: has patches, or is of an object that mostly has
    footprints: Footprints
    first: np.ndarray  # (R,) int32: each receiver's first triangle,
    area: np.ndarray  # (R,) float32: and its area, by which they are known
    length: np.ndarray  # (P,) float32: edges of squares as large as the patches
    complete: tuple[np.ndarray, np.ndarray] | None = None  # patch and values, before ``without`` left any out

    def are_of(self, footprints: Footprints) -> bool:
        """Whether these are the receivers' own patches."""
        return np.array_equal(self.first, footprints.triangle[footprints.start[:-1]]) and (
            np.array_equal(self.area, footprints.area.astype(np.float32))
        )

    def are_patches(self, receiver: np.ndarray) -> np.ndarray:
        """(P,) bool: all of the patch is among ``receiver`` (k,) int."""
        found = (np.bincount(each[each >= 0], minlength=self.footprints.count) for each in (self.patch, self.patch[receiver]))
        return np.equal(*found)

    def with_parts_of(self, receiver: np.ndarray) -> np.ndarray:
        """(P,) bool: the patch has a part of ``receiver`` (k,) int."""
        several = self.values[np.isin(self.keys // len(self.baked), receiver)]
        found = np.concatenate([self.patch[receiver], several])
        return np.bincount(found[found >= 0], minlength=self.footprints.count) > 0

    def without(self, varied: np.ndarray) -> ReceiverPatches:
        """The same, where no ray ends on the patches ``varied`` (P,) bool: light varies inside, and what
        is seen of them may be a part of it, as at a gap's rim; or replicates differ in it."""
        omitted = np.append(varied, False)  # the last for what is no patch, which is below 0
        patch, values = (
            np.where(omitted[np.maximum(found, -1)], np.int32(ONWARD), found)
            for found in (self.patch, self.values)
        )
        return replace(self, patch=patch, values=values, complete=self.complete or (self.patch, self.values))

    def with_left_out(self) -> ReceiverPatches:
        """The same with those that ``without`` left out."""
        patch, values = self.complete or (self.patch, self.values)
        return replace(self, patch=patch, values=values)

    @property
    def count(self) -> int:
        """Of fronts and backs."""
        return 2 * self.footprints.count

    def at(
        self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, front: np.ndarray
    ) -> np.ndarray:
        """(n,) int32 patches at barycentric (u, v) on sides of triangles, which may be below 0; NOTHING
        or ONWARD where there is none."""
        receiver = self.map.at(triangle, u, v)
        baked = np.take(self.baked, triangle) & (triangle >= 0)
        patch = np.where(baked, np.int32(ONWARD), np.int32(NOTHING))
        some = np.flatnonzero(receiver >= 0)
        receiver = np.take(receiver, some)
        found = np.take(self.patch, receiver)
        asked = np.flatnonzero((found == SEVERAL) | np.take(self.cut, np.take(triangle, some)))
        if len(asked):
            found[asked] = self._of_cells(receiver[asked], triangle[some[asked]])
        back = found >= 0
        back &= ~np.take(front, some)
        found += back * np.int32(self.footprints.count)
        patch[some] = found
        return patch

    def _of_cells(self, receiver: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """(n,) int32 patches of what receivers have on triangles; ONWARD where that is nothing."""
        if len(self.keys) == 0:
            return np.full(len(receiver), ONWARD, np.int32)
        key = receiver.astype(np.int64) * len(self.baked) + triangle
        index = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
        return np.where(self.keys[index] == key, self.values[index], np.int32(ONWARD))


def build_receiver_patches(
    receivers: Receivers, footprints: Footprints, objects: np.ndarray, areas: np.ndarray,
    largest: float, divided: np.ndarray | None, square: np.ndarray | None = None,
) -> ReceiverPatches | None:
    """The patches of receivers on triangles of ``objects`` and ``areas`` (n_triangles,). Those above
    the area ``largest`` are left to elements, which are finer. Receivers that are ``divided`` (R,) bool
    by a wall have none: they see the light of both its sides. Those of one ``square`` (R,) int are one patch, where
    they lie together; None: each for itself. None where none is left, or they are too many."""
    triangles = len(objects)
    owner = np.repeat(np.arange(footprints.count), np.diff(footprints.start))
    used = np.ones(len(owner), bool) if divided is None else ~divided[owner]
    pair, first, group = _groups_of_cells(footprints, owner, square, triangles)
    cell_area = np.diff(footprints.cumulative)
    area = np.bincount(group, cell_area)
    fine = used & (area[group] <= largest)
    numbers = np.unique(group[fine])
    if len(numbers) == 0 or len(numbers) > MOST_PATCHES:
        return None
    group = np.where(fine, np.searchsorted(numbers, group), np.where(used, NOTHING, ONWARD))
    receiver_map = build_receiver_map(receivers, triangles)
    own = np.bincount(objects[footprints.triangle], fine * cell_area, int(objects.max()) + 1)
    mostly = own > BAKED * np.bincount(objects, areas)
    baked = mostly[objects] | ((own[objects] > 0) & (receiver_map.first >= 0))
    patch = group[footprints.start[:-1]].astype(np.int32)
    several = np.zeros(footprints.count, bool)
    several[owner[group != patch[owner]]] = True
    patch[several] = SEVERAL
    cut = np.bincount(footprints.triangle, cell_area, triangles) < COMPLETE * areas
    some = several[owner[first]] | cut[footprints.triangle[first]]
    grouped = footprints.grouped(group)
    return ReceiverPatches(
        receiver_map, patch, pair[some], group[first[some]].astype(np.int32), cut, baked, grouped,
        footprints.triangle[footprints.start[:-1]], footprints.area.astype(np.float32),
        np.sqrt(grouped.area).astype(np.float32),
    )


def squares_of_texels(
    receivers: Receivers, single: np.ndarray | None, many: int = MANY_PATCHES
) -> np.ndarray | None:
    """(R,) int64: the same for texels of one square of k × k in an image, where there are ``many`` of them or more.
    Those that are ``single`` (R,) bool, as a wall stands on them, are alone. None: all are."""
    if receivers.grid is None or receivers.count < many:
        return None
    edge = int(np.sqrt(receivers.count / many)) + 1
    alone = np.zeros(receivers.count, np.int64)
    if single is not None:
        alone[single] = np.arange(1, np.count_nonzero(single) + 1)
    return labels(receivers.grid[:, 0], receivers.grid[:, 1:] // edge, alone)


def _groups_of_cells(
    footprints: Footprints, receiver: np.ndarray, square: np.ndarray | None, triangles: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For cells (n,), each of the receiver ``receiver`` (n,) int: the keys (p,) of the pairs of a receiver and a
    triangle that have cells in common, the first cell (p,) of each pair, and the group (n,) int of each cell.

    Cells of one receiver, or of one ``square`` (R,) int of receivers, are one group where they lie near the largest
    of them and face as it does. The rest are grouped by cube and facing. ``triangles``: how many the scene has.
    """
    pair, first, mine = np.unique(
        receiver * triangles + footprints.triangle, return_index=True, return_inverse=True
    )
    owner = receiver if square is None else square[receiver]
    cell_area, count = np.diff(footprints.cumulative), int(owner.max(initial=-1)) + 1
    order = np.lexsort([cell_area, owner])
    largest = order[np.cumsum(np.bincount(owner, minlength=count)) - 1]
    edge = np.sqrt(np.bincount(owner, cell_area, count))
    owner = owner[first]
    normal, position, largest = footprints.normal[first], footprints.origin[first], largest[owner]
    size = EXTENT * np.sqrt(footprints.cumulative[-1] / max(count, 1))
    offset = np.linalg.norm(position - footprints.origin[largest], axis=1)
    alike = np.einsum("ij,ij->i", normal, footprints.normal[largest]) > ALIKE
    cube = cubes(position, max(size, SMALLEST), -0.5)
    common = np.column_stack([facings(normal) + 2, cube])
    common[alike & (offset < np.maximum(size, EXTENT * edge[owner]))] = 0
    return pair, first, labels(owner, common)[mine.reshape(-1)]
