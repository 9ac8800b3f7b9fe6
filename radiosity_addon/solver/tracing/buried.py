"""Buried: the parts of receivers that nobody sees, inside solids or flush against another face.

A wall is sunk into the floor, a box stands on it: what lies under them is dark, and a mean over it
and what shows beside them would be too dark. So receivers' cells are cut along the lines where
solids come out of their triangles, and only what is open is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..geometry.planar import cell_areas, cell_middles
from ..geometry.triangles import OFFSET, Geometry
from ..receivers import Receivers
from ..scene import Scene
from .closed_meshes import DIRECTIONS
from .contacts import Contacts, find_contacts, meets_cell
from .crossings import Crossings
from .embree import Tracer
from .solids import Solids, find_solids

LIFT = 4 * OFFSET  # height [unit box] above the surface from which places look for what buries them
# Cosine [of an angle] between the normals of faces that lie flush against each other, at most.
OPPOSED = -0.99
MOST_LINES = 12  # number [lines] by which one cell is cut, at most
SEEN, TEXEL_SEEN = 1e-3, 0.25  # share [of a receiver, of a texel] that must be open for it to count
FULLY_OPEN = 1 - 1e-6  # share [of a receiver] that is open: with more, nothing of it is buried
SLIVER = 1e-9  # area [of a triangle]: a smaller part is left out


@dataclass(frozen=True)
class Surroundings:
    """What may bury a place. ``solid`` (n_triangles,) bool: faces of solids; ``facing``: tracers of
    the opaque triangles that face against DIRECTIONS[0] and of those that face along it."""

    geometry: Geometry
    solids: Solids
    solid: np.ndarray
    facing: tuple[Tracer, Tracer]

    def bury(self, triangle: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """(k,) bool: places at barycentric uv (k, 2) of triangles (k,) are buried, on the front."""
        normal = self.geometry.normal[triangle]
        lifted = self.geometry.at(triangle, uv) + LIFT * normal
        buried = self.solids.contain(lifted)
        some = np.flatnonzero(self.solid[triangle] & ~buried)
        buried[some] = self._is_flush(lifted[some], normal[some])
        return buried

    def _is_flush(self, lifted: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """(k,) bool: another face lies on a solid's, its front against that one's. Such two face
        opposite ways, so they are in different tracers, and each is met though they coincide."""
        flush, along = np.zeros(len(lifted), bool), normal @ DIRECTIONS[0] > 0
        for tracer, some in zip(self.facing, (np.flatnonzero(along), np.flatnonzero(~along))):
            up = normal[some]
            hits = tracer.intersect(lifted[some].astype(np.float32), -up.astype(np.float32))
            other = self.geometry.normal[hits.triangle]
            flush[some] = (hits.triangle >= 0) & (hits.distance <= 2 * LIFT)
            flush[some] &= np.einsum("ij,ij->i", other, up) < OPPOSED
        return flush


def find_surroundings(
    scene: Scene, geometry: Geometry, opaque: np.ndarray, threads: int
) -> Surroundings | None:
    """Of the triangles that are ``opaque`` (n_triangles,) bool; None where no mesh is solid."""
    solids = find_solids(scene, geometry, opaque, threads)
    if not solids.solids:
        return None
    solid = np.zeros(len(opaque), bool)
    for each in solids.solids:
        for mesh in (each.shell, *each.rooms):
            solid[mesh.triangles] = True
    along = geometry.normal @ DIRECTIONS[0] > 0
    facing = tuple(
        Tracer(geometry.vertices, geometry.triangles, np.flatnonzero(opaque & side))
        for side in (~along, along)
    )
    return Surroundings(geometry, solids, solid, facing)


def without_buried(
    surroundings: Surroundings, crossings: Crossings, receivers: Receivers
) -> tuple[Receivers, np.ndarray]:
    """The receivers' open parts, and (count,) bool: those that have none, left as they are."""
    crossings = crossings.take(crossings.across & surroundings.solid[crossings.other])
    contacts = find_contacts(crossings, receivers, surroundings.solids.threads)
    hidden = _hidden_cells(surroundings, receivers, contacts)
    cut, part, corners = _cut_along(crossings, receivers, contacts)
    buried = surroundings.bury(receivers.triangle[part], corners.mean(axis=1))
    return _kept(surroundings, receivers, hidden, cut, part[~buried], corners[~buried])


def _hidden_cells(
    surroundings: Surroundings, receivers: Receivers, contacts: Contacts
) -> np.ndarray:
    """(n_cells,) bool: cells that are buried as a whole, if no line touches them. No line meets
    some of the squares of cells: there one that is open stands for all. Where it is buried each is
    looked at, as a box may stand on a part of them without any line."""
    middle = cell_middles(receivers.corners, receivers.square)
    _, stands = np.unique(contacts.square, return_index=True)
    alone = contacts.met[contacts.square]
    alone[stands] = True
    some = np.flatnonzero(alone)
    hidden = np.zeros(len(middle), bool)
    hidden[some] = surroundings.bury(receivers.triangle[some], middle[some])
    follow = np.flatnonzero(~alone & hidden[stands[contacts.square]])
    hidden[follow] = surroundings.bury(receivers.triangle[follow], middle[follow])
    return hidden


def _cut_along(
    crossings: Crossings, receivers: Receivers, contacts: Contacts
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(m,) int: the cells that lines touch; (k,) int cells and (k, 3, 2) corners of their parts."""
    order = np.lexsort([contacts.line, contacts.cell])
    line, cell = contacts.line[order], contacts.cell[order]
    cut, start, number = np.unique(cell, return_index=True, return_counts=True)
    first, u, v = receivers.corners[cut].transpose(1, 0, 2)
    square = receivers.square[cut]
    one = receivers.corners[cut]
    other = np.stack([u + v - first, v, u], 1)[square]
    part = np.concatenate([np.arange(len(cut)), np.flatnonzero(square)])
    corners = np.concatenate([one, other])
    for k in range(min(int(number.max(initial=0)), MOST_LINES)):
        some = np.flatnonzero(number[part] > k)
        along = line[start[part[some]] + k]
        met = meets_cell(crossings.ends[along], corners[some], np.zeros(len(some), bool))
        some, along = some[met], along[met]
        pieces, owner = _halved(corners[some], crossings.height[along])
        left = np.ones(len(part), bool)
        left[some] = False
        corners = np.concatenate([corners[left], pieces])
        part = np.concatenate([part[left], part[some][owner]])
    return cut, cut[part], corners


def _halved(corners: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n, 3, 2) cut where a linear function is 0, by its values ``height`` (n, 3) at
    the whole triangle's corners: (k, 3, 2) parts, and (k,) which they are of."""
    weights = np.concatenate([1 - corners.sum(axis=2, keepdims=True), corners], axis=2)
    value = np.einsum("nic,nc->ni", weights, height)
    flat = 1e-9 * np.abs(height).max(axis=1, keepdims=True)
    above, below = value > flat, value < -flat
    crossed = above.any(axis=1) & below.any(axis=1)
    uncut, some = np.flatnonzero(~crossed), np.flatnonzero(crossed)
    alone = np.where(above[some].sum(axis=1) == 1, above[some].argmax(axis=1),
                     below[some].argmax(axis=1))  # fmt: skip
    order = (alone[:, None] + np.arange(3)) % 3
    tip, left, right = np.take_along_axis(corners[some], order[..., None], 1).transpose(1, 0, 2)
    high = np.take_along_axis(value[some], order, 1)
    to_left, to_right = (
        (high[:, 0] / (high[:, 0] - high[:, k])).clip(0, 1)[:, None] for k in (1, 2)
    )
    a, b = tip + to_left * (left - tip), tip + to_right * (right - tip)
    pieces = [corners[uncut]]
    pieces += [np.stack(triple, 1) for triple in ((tip, a, b), (a, left, right), (a, right, b))]
    return np.concatenate(pieces), np.concatenate([uncut, some, some, some])


def _kept(
    surroundings: Surroundings, receivers: Receivers, hidden: np.ndarray, cut: np.ndarray,
    part: np.ndarray, corners: np.ndarray,
) -> tuple[Receivers, np.ndarray]:
    """Receivers of the cells that are neither ``hidden`` (n_cells,) bool nor ``cut`` (m,) int, and
    of the open parts, of cells ``part`` (k,), with ``corners`` (k, 3, 2); and which have none."""
    scale = surroundings.geometry.area
    uncut = cell_areas(receivers.corners, receivers.square) * scale[receivers.triangle]
    area = cell_areas(corners, False) * scale[receivers.triangle[part]]
    clear = ~hidden
    clear[cut] = False
    owner, count = receivers.receiver, receivers.count
    total = np.bincount(owner, uncut, count)
    share = np.bincount(owner, uncut * clear, count) + np.bincount(owner[part], area, count)
    share /= np.maximum(total, 1e-300)
    buried = share < (SEEN if receivers.grid is None else TEXEL_SEEN)
    mixed = ~buried & (share < FULLY_OPEN)
    cells = np.flatnonzero(np.where(mixed[owner], clear, True))
    parts = np.flatnonzero(mixed[owner[part]] & (area > SLIVER * scale[receivers.triangle[part]]))
    cell = np.concatenate([cells, part[parts]])
    order = np.argsort(owner[cell], kind="stable")
    square = np.concatenate([receivers.square[cells], np.zeros(len(parts), bool)])
    kept = replace(
        receivers,
        receiver=owner[cell][order],
        triangle=receivers.triangle[cell][order],
        corners=np.concatenate([receivers.corners[cells], corners[parts]])[order],
        square=square[order],
    )
    return kept, buried
