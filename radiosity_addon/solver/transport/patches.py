"""Patches: everything that has one radiosity. The footprints of receivers, where these are fine, and
sides of elements elsewhere.

Receivers follow the mesh and the user's own resolution, so that a patch of them lies on one side of
each wall. A receiver whose cells face different ways, or lie far from each other, is several.

Rays look radiosities up by *entry*: the fronts of the P patches of receivers, their backs, then the
miss, onward and nowhere, then 2·cell + back for the sides of the elements' cells. *Patches* are
numbered alike: those of receivers, then 2·P + 2·element + back. Where a ray ends on a baked object,
but on none of its patches, it goes *onward*: it is reflected there and brings light that it finds
itself. Such places are few: near walls that divide a receiver, on faces without texels. Rays go
onward, too, from patches whose direct light varies, and rays of receivers from patches and elements
that are nearer than their own size: a ray sees one part of such a patch, whose light may differ from
the patch's mean.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..elements.elements import Elements
from ..geometry.clusters import cubes, facings, labels
from ..geometry.footprints import Footprints
from ..geometry.triangles import Geometry
from ..receivers import Receivers
from ..tracing.embree import Hits
from .receiver_map import NOTHING, ReceiverMap, build_receiver_map

MOST_PATCHES = 2_000_000  # number [patches of receivers], at most: bounds the memory of their rows
ALIKE = 0.7  # cosine [of an angle] between normals of cells that are one patch, at least
EXTENT = 2.0  # distance [mean edges of a receiver]: cells further apart are different patches
BAKED = 0.5  # share [of an object's area] in patches: above it its other faces get no elements
# Length [of the distance] of a patch: above it rays find the light where they end.
NEAR = 1.0
COMPLETE = 1 - 1e-4  # share [of a triangle] that receivers have of one that is not cut
SMALLEST = 1e-6  # extent [unit box] of a patch, at least
ONWARD, SEVERAL = NOTHING - 1, NOTHING - 2  # codes [``ReceiverPatches.patch``], see there


@dataclass(frozen=True)
class ReceiverPatches:
    """P patches of receivers, which lie where ``footprints`` tells.

    ``patch`` (R,) int32: of a receiver that is one; NOTHING where elements are finer, ONWARD where it
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

    def are_of(self, footprints: Footprints) -> bool:
        """Whether these are the receivers' own patches."""
        return np.array_equal(self.first, footprints.triangle[footprints.start[:-1]]) and (
            np.array_equal(self.area, footprints.area.astype(np.float32))
        )

    def without(self, varied: np.ndarray) -> ReceiverPatches:
        """The same, where no ray ends on the patches ``varied`` (P,) bool: light varies inside, and what
        is seen of them may be a part of it, as at a gap's rim."""
        omitted = np.append(varied, False)  # the last for what is no patch, which is below 0
        patch, values = (
            np.where(omitted[np.maximum(found, -1)], np.int32(ONWARD), found)
            for found in (self.patch, self.values)
        )
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
        patch = np.where(self.baked[triangle] & (triangle >= 0), np.int32(ONWARD), np.int32(NOTHING))
        some = np.flatnonzero(receiver >= 0)
        receiver = receiver[some]
        found = np.take(self.patch, receiver)
        asked = np.flatnonzero((found == SEVERAL) | self.cut[triangle[some]])
        if len(asked):
            found[asked] = self._of_cells(receiver[asked], triangle[some[asked]])
        found += (found >= 0) * np.where(front[some], 0, np.int32(self.footprints.count))
        patch[some] = found
        return patch

    def _of_cells(self, receiver: np.ndarray, triangle: np.ndarray) -> np.ndarray:
        """(n,) int32 patches of what receivers have on triangles; ONWARD where that is nothing."""
        if len(self.keys) == 0:
            return np.full(len(receiver), ONWARD, np.int32)
        key = receiver.astype(np.int64) * len(self.baked) + triangle
        index = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
        return np.where(self.keys[index] == key, self.values[index], np.int32(ONWARD))


@dataclass(frozen=True)
class Patches:
    """The patches of receivers, if there are any, and elements."""

    elements: Elements
    receivers: ReceiverPatches | None = None
    # (entries,) float32 [unit box]: edges of squares as large, 0 for no patch; None: no ray goes onward
    # as a patch is near.
    length: np.ndarray | None = None

    def measured(self, geometry: Geometry) -> Patches:
        """The same with their lengths."""
        sides = np.repeat(self.elements.lengths(geometry), 2)
        own = [] if self.receivers is None else 2 * [self.receivers.length]
        return replace(self, length=self.table(np.concatenate([*own, sides]), np.float32(0)))

    @property
    def first(self) -> int:
        """The patch of the first element's front; those before are receivers'."""
        return 0 if self.receivers is None else self.receivers.count

    @property
    def count(self) -> int:
        """Of all patches."""
        return self.first + 2 * self.elements.count

    @property
    def miss(self) -> int:
        """The entry that stands for nothing hit."""
        return self.first

    @property
    def onward(self) -> int:
        """The entry of places that have no patch: rays go on from there."""
        return self.first + 1

    @property
    def nowhere(self) -> int:
        """The entry of places too near a cut of an element to lie on either side of it: no light
        comes from there."""
        return self.first + 2

    @property
    def cells(self) -> int:
        """The entry of the first cell's front."""
        return self.first + 3

    @property
    def entries(self) -> int:
        """Of all."""
        return self.cells + 2 * len(self.elements.element)

    def hit(self, hits: Hits, near_goes_onward: bool = False) -> np.ndarray:
        """(n,) int32 entries of hits; the miss where nothing was hit. Where ``near_goes_onward``, the entry is
        onward where a ray ends on a patch, or an element, from so near that a part of it counts more than
        the rest: its mean is not what arrives."""
        entry = self.at(hits.triangle, hits.u, hits.v, hits.front)
        if near_goes_onward and self.length is not None:
            entry[np.take(self.length, entry) > NEAR * hits.distance] = self.onward
        return entry

    def at(
        self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, front: np.ndarray
    ) -> np.ndarray:
        """(n,) int32 entries at barycentric (u, v) on sides of triangles; -1 is the miss."""
        if self.receivers is None:
            return self._sides(triangle, u, v, front)
        entry = self.receivers.at(triangle, u, v, front)
        entry[entry == ONWARD] = self.onward
        rest = np.flatnonzero(entry == NOTHING)
        entry[rest] = self._sides(triangle[rest], u[rest], v[rest], front[rest])
        return entry

    def _sides(
        self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, front: np.ndarray
    ) -> np.ndarray:
        """(n,) entries of the elements' cells at barycentric (u, v) (n,) of ``triangle`` (n,), on the
        ``front`` (n,) bool or the back."""
        cell = self.elements.cells_at(triangle, u, v)
        entry = self.cells + 2 * cell
        entry += ~front
        if self.elements.has_cuts:
            np.copyto(entry, self.nowhere, where=cell >= len(self.elements.element))
        np.copyto(entry, self.miss, where=triangle < 0)
        return entry

    def somewhere(self, entry: np.ndarray) -> np.ndarray:
        """(n,) bool: the entry is a patch's."""
        return (entry < self.miss) | (entry > self.nowhere)

    def of(self, entry: np.ndarray) -> np.ndarray:
        """(n,) int64 patches of entries, each of which must be somewhere."""
        patch = entry.astype(np.int64)
        some = np.flatnonzero(entry >= self.cells)
        patch[some] = self.first + self.elements.sides_of(entry[some] - self.cells)
        return patch

    def element_of(self, patch: np.ndarray) -> np.ndarray:
        """(n,) int elements of patches; below 0 for those of receivers."""
        return (patch - self.first) // 2

    def table(self, values: np.ndarray, nothing: bool | float) -> np.ndarray:
        """(entries, ...) from values of patches (count, ...); ``nothing`` where there is no
        patch."""
        shape = values.shape[1:]
        sides = self.elements.values_of_cells(values[self.first :], nothing)
        none = np.full((3,) + shape, nothing, values.dtype)
        return np.concatenate([values[: self.first], none, sides])


def build_receiver_patches(
    receivers: Receivers, footprints: Footprints, objects: np.ndarray, areas: np.ndarray,
    largest: float, divided: np.ndarray | None,
) -> ReceiverPatches | None:
    """The patches of receivers on triangles of ``objects`` and ``areas`` (n_triangles,). Those above
    the area ``largest`` are left to elements, which are finer. Receivers that are ``divided`` (R,) bool
    by a wall have none: they see the light of both its sides. None where none is left, or they are
    too many."""
    triangles = len(objects)
    owner = np.repeat(np.arange(footprints.count), np.diff(footprints.start))
    used = np.ones(len(owner), bool) if divided is None else ~divided[owner]
    pair, first, group = _groups_of_cells(footprints, owner, triangles)
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


def _largest_cell(footprints: Footprints) -> np.ndarray:
    """(count,) the number of each receiver's largest cell."""
    area = np.diff(footprints.cumulative)
    owner = np.repeat(np.arange(footprints.count), np.diff(footprints.start))
    order = np.lexsort([area, owner])
    return order[footprints.start[1:] - 1]


def _groups_of_cells(
    footprints: Footprints, owner: np.ndarray, triangles: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells (n,) of receivers ``owner`` (n,) on a scene's ``triangles``: the numbers (p,) of pairs of
    a receiver and a triangle that have cells in common, the first cell (p,) of each pair, and the
    group (n,) of each cell: one receiver's that lie near its largest and face as that one does are
    together, and of the rest those that face alike in one cube."""
    pair, first, mine = np.unique(
        owner * triangles + footprints.triangle, return_index=True, return_inverse=True
    )
    normal, position = footprints.normal[first], footprints.origin[first]
    largest = _largest_cell(footprints)[owner[first]]
    size = EXTENT * np.sqrt(footprints.cumulative[-1] / max(footprints.count, 1))
    offset = np.linalg.norm(position - footprints.origin[largest], axis=1)
    own_size = EXTENT * np.sqrt(footprints.area[owner[first]])
    alike = np.einsum("ij,ij->i", normal, footprints.normal[largest]) > ALIKE
    cube = cubes(position, max(size, SMALLEST), -0.5)
    common = np.column_stack([facings(normal) + 2, cube])
    common[alike & (offset < np.maximum(size, own_size))] = 0
    return pair, first, labels(owner[first], common)[mine.reshape(-1)]
