"""Continuations: where the surface goes on beyond the border of an island or of an object. No bpy.

Two borders continue each other where they lie on one line in space, their faces to both sides of
it, and are shaded by the same normal there: coplanar faces, or faces that are smooth over the line.
Borders of which one ends in the middle of the other are cut at each other's ends first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..components import connected_components
from ..solver.array_struct import ArrayStruct
from ..solver.geometry.vectors import unit_rows
from ..solver.ragged import ragged_ranges
from .islands import Charted, Edges

WELD = 1e-5  # distance [of the surface's extent]: points closer than that are one
# Cosine [of 3°] between shading normals: those that differ by more are of different faces.
BENT = np.cos(np.radians(3.0))
# Cosine [of an angle] between the directions into two faces: above it they lie on the same side.
FOLDED = -0.3
CROWD = 16  # number [borders on one line] that are compared: where there are more, none continues
LONG = 1e-4  # length [of the extent]: shorter edges have no certain direction, and are not cut
NEAR = 1e-4  # difference [of the extent] of directions and feet, about: less between edges on one line


@dataclass(frozen=True)
class Parts(ArrayStruct):
    """Parts of border edges, from parameter ``along[:, 0]`` to ``along[:, 1]``, which lie between
    the points ``low`` and ``high``; the same points are the same numbers for all edges."""

    edge: np.ndarray  # (k,) int
    along: np.ndarray  # (k, 2) float64
    low: np.ndarray  # (k,) int
    high: np.ndarray  # (k,) int


@dataclass(frozen=True)
class Seams:
    """Pairs of parts of border edges that are one line in space: row i of ``one`` and ``other``."""

    one: Parts
    other: Parts


def find_seams(charted: Charted, edges: Edges, bent: float = BENT) -> Seams:
    """Where the borders ``edges`` continue each other, wholly or in part; normals' cosines are at
    least ``bent``."""
    ends, positions = _weld(charted, edges)
    number = np.arange(len(edges.triangle))
    parts = _parts(number, np.tile([0.0, 1.0], (len(number), 1)), ends)
    uncut = _continued(charted, edges, parts, bent)
    alone = np.ones(len(number), bool)
    for part in (uncut.one, uncut.other):
        alone[part.edge] = False
    cut = _continued(charted, edges, _cut(number[alone], ends, positions), bent)
    return Seams(Parts.join([uncut.one, cut.one]), Parts.join([uncut.other, cut.other]))


def _weld(charted: Charted, edges: Edges) -> tuple[np.ndarray, np.ndarray]:
    """(m, 2) points at the edges' ends, and (p, 3) their positions; what is one in space is one."""
    from scipy.spatial import cKDTree

    vertex = np.stack(edges.ends(charted.triangles), 1)
    used, ends = np.unique(vertex, return_inverse=True)
    positions = charted.vertices[used]
    if not len(used):
        return vertex.reshape(-1, 2), positions
    pairs = cKDTree(positions).query_pairs(WELD * np.ptp(positions, axis=0).max(), output_type="ndarray")
    point = connected_components(len(used), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(point, return_index=True)
    return point[ends.reshape(-1, 2)], positions[first]


def _parts(edge: np.ndarray, along: np.ndarray, points: np.ndarray) -> Parts:
    """Parts of edges (k,) between ``points`` (k, 2) in the order of their numbers."""
    backward = points[:, 0] > points[:, 1]
    along = np.where(backward[:, None], along[:, ::-1], along)
    return Parts(edge, along, points.min(1), points.max(1))


def _cut(edge: np.ndarray, ends: np.ndarray, positions: np.ndarray) -> Parts:
    """The ``edge`` (k,) cut at the ends of others among them that lie on them."""
    owner, point, along = _points_on(ends[edge], positions)
    owner = np.concatenate([np.tile(np.arange(len(edge)), 2), owner])
    point = np.concatenate([ends[edge].T.ravel(), point])
    along = np.concatenate([np.repeat([0.0, 1.0], len(edge)), along])
    order = np.lexsort((along, owner))
    owner, point, along = owner[order], point[order], along[order]
    same = owner[1:] == owner[:-1]
    spans = (np.stack([x[:-1], x[1:]], 1)[same] for x in (along, point))
    return _parts(edge[owner[:-1][same]], *spans)


def _points_on(ends: np.ndarray, positions: np.ndarray):
    """(owner, point, along): where on which edges (k, 2) lie ends of others on the same line, but
    for their own."""
    if not len(ends):
        return np.zeros(0, int), np.zeros(0, int), np.zeros(0)
    start, step = positions[ends[:, 0]], positions[ends[:, 1]] - positions[ends[:, 0]]
    extent = np.ptp(positions[ends].reshape(-1, 3), axis=0).max()
    length = np.linalg.norm(step, axis=1)
    long = np.flatnonzero(length > LONG * extent)
    line, direction = _lines((start[long] - positions.mean(0)) / extent, step[long] / length[long, None])
    point = ends[long]
    far = np.einsum("kij,kj->ki", (positions[point] - positions.mean(0)) / extent, direction)
    key = 4 * line[:, None] + far  # far lies within ±√3/2, so that lines stay apart
    order = np.argsort(key, axis=None, kind="stable")
    known, point = key.ravel()[order], point.ravel()[order]
    low = np.searchsorted(known, key.min(1), "right")
    count = np.maximum(np.searchsorted(known, key.max(1), "left") - low, 0)
    owner, offset = ragged_ranges(count)
    owner, point = np.unique(np.stack([long[owner], point[low[owner] + offset]]), axis=1)
    away = positions[point] - start[owner]
    along = np.einsum("ij,ij->i", away, step[owner]) / length[owner] ** 2
    height = np.linalg.norm(away - along[:, None] * step[owner], axis=1)
    room = WELD * extent / length[owner]
    on = (height <= WELD * extent) & (along > room) & (along < 1 - room)
    return owner[on], point[on], along[on]


def _lines(start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(k,) which line the edges from ``start`` (k, 3) along ``direction`` (k, 3) lie on, nearly, and (k, 3)
    the directions with one sign: lines are the same where their directions and their feet under the origin are."""
    from scipy.spatial import cKDTree

    if not len(direction):
        return np.zeros(0, int), direction
    largest = np.take_along_axis(direction, np.abs(direction).argmax(1)[:, None], 1)
    direction = direction * np.sign(largest)
    foot = start - np.einsum("ij,ij->i", start, direction)[:, None] * direction
    pairs = cKDTree(np.concatenate([direction, foot], 1)).query_pairs(NEAR, output_type="ndarray")
    line = connected_components(len(direction), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(line, return_index=True)
    return line, direction[first[line]]


def _continued(charted: Charted, edges: Edges, parts: Parts, bent: float) -> Seams:
    """The pairs of parts between the same points whose faces continue each other."""
    order = np.lexsort((parts.edge, parts.high, parts.low))
    parts = parts.take(order[parts.low[order] < parts.high[order]])
    new = (np.diff(parts.low, prepend=-1) != 0) | (np.diff(parts.high, prepend=-1) != 0)
    start = np.flatnonzero(new)
    size = np.diff(start, append=len(parts.low))
    start, size = start[(size > 1) & (size <= CROWD)], size[(size > 1) & (size <= CROWD)]
    first, offset = ragged_ranges(size)
    group, other = ragged_ranges(size[first])  # each member beside each of its line
    one = start[first][group] + offset[group]
    other = start[first][group] + other
    one, other = one[one < other], other[one < other]
    good = _faces_continue(charted, edges, parts.take(one), parts.take(other), bent)
    return Seams(parts.take(one[good]), parts.take(other[good]))


def _faces_continue(
    charted: Charted, edges: Edges, one: Parts, other: Parts, bent: float
) -> np.ndarray:
    """(k,) bool: to both sides of the line, and by one normal in its middle."""
    inward, true, shaded = [], [], []
    for part in (one, other):
        own = edges.take(part.edge)
        inward.append(into_faces(charted, own))
        true.append(face_normals_of(charted, own.triangle))
        middle = part.along.mean(1)[:, None]
        start, end = own.ends(charted.normals)
        mean = (1 - middle) * start + middle * end
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        shaded.append(np.where(length > 1e-6, mean / np.maximum(length, 1e-300), true[-1]))
    cosine = [np.einsum("ij,ij->i", *pair) for pair in (inward, true, shaded)]
    return (cosine[0] < FOLDED) & (cosine[1] > 0) & (cosine[2] >= bent)


def into_faces(charted: Charted, edges: Edges) -> np.ndarray:
    """(m, 3) unit vectors in the faces' planes, square to the edges, into the faces."""
    start, end = edges.ends(charted.vertices[charted.triangles])
    third = charted.vertices[charted.triangles[edges.triangle, (edges.side + 2) % 3]]
    along = unit_rows(end - start)
    away = third - start
    return unit_rows(away - np.einsum("ij,ij->i", away, along)[:, None] * along)


def face_normals_of(charted: Charted, triangle: np.ndarray) -> np.ndarray:
    """(k, 3) true unit normals of the triangles with numbers ``triangle`` (k,)."""
    a, b, c = charted.vertices[charted.triangles[triangle]].transpose(1, 0, 2)
    return unit_rows(np.cross(b - a, c - a))
