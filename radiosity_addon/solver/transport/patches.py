"""Patches: everything that has one radiosity. The footprints of receivers, where these are fine, and
sides of elements elsewhere.

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
from ..geometry.triangles import Geometry
from ..tracing.embree import Hits
from .receiver_map import NOTHING
from .receiver_patches import ONWARD, ReceiverPatches

# Length [of the distance] of a patch: above it rays find the light where they end.
NEAR = 1.0


@dataclass(frozen=True)
class Avoided:
    """Entries that bring nothing to rays of receivers from a ``distance`` (entries,) float32 [unit box] on, inf: any, and
    whether they are ``onward`` (entries,) bool for all other rays. Where they are avoided ``by_all``, they bring nothing to rays
    of rows either."""

    distance: np.ndarray
    onward: np.ndarray
    by_all: bool = False


@dataclass(frozen=True)
class Patches:
    """The patches of receivers, if there are any, and elements."""

    elements: Elements
    receivers: ReceiverPatches | None = None
    # (entries,) float32 [unit box]: edges of squares as large, 0 for no patch; None: no ray goes onward
    # as a patch is near.
    length: np.ndarray | None = None
    avoided: Avoided | None = None  # None: nothing

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
        the rest: its mean is not what arrives. Such rays avoid what is ``avoided``, or all rays do."""
        entry = self.at(hits.triangle, hits.u, hits.v, hits.front)
        if self.avoided is not None:
            avoids = near_goes_onward or self.avoided.by_all
            far = avoids & (np.take(self.avoided.distance, entry) < hits.distance)
            onward = np.take(self.avoided.onward, entry)
            entry[far], entry[onward & ~far] = self.nowhere, self.onward
        if near_goes_onward and self.length is not None:
            entry[np.take(self.length, entry) > NEAR * hits.distance] = self.onward
        return entry

    def without(self, receivers: np.ndarray) -> Patches:
        """The same, where no ray ends on patches that have a part of ``receivers`` (k,) int: rays go on from there."""
        return replace(self, receivers=self.receivers.without(self.receivers.with_parts_of(receivers)))

    def avoided_at(self, distance: np.ndarray) -> Avoided:
        """The patches of receivers whose fronts have a ``distance`` (P,) float32 that is not inf; and those that were left out,
        which rays go onward from."""
        count = self.receivers.footprints.count
        left = np.zeros(count, bool)
        for code in (self.receivers.patch, self.receivers.values):
            left[code[code >= 0]] = True
        far = np.full(self.entries, np.inf, np.float32)
        far[:count] = distance
        onward = np.zeros(self.entries, bool)
        onward[: 2 * count] = np.tile(~left, 2)
        return Avoided(far, onward)

    def with_all_counted(self) -> Patches:
        """The same for rays that start where the avoided patches are not sampled: to these rays they bring light. Those that all
        rays avoid are sampled everywhere."""
        if self.avoided is None or self.avoided.by_all:
            return self
        everywhere = np.full_like(self.avoided.distance, np.inf)
        return replace(self, avoided=replace(self.avoided, distance=everywhere))

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
