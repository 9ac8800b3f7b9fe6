"""Receiver map: from a place on the surface to the receiver that it lies in.

Each triangle has an affine map to the texels of its image, or a grid of places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.grids import cell_in_grid, within
from ..geometry.planar import cell_areas, cell_middles
from ..receivers import Receivers

COVERED = 0.9  # share [of a triangle] that its receivers must cover for it to have a grid of them
NOTHING = -1  # code [receivers]: no receiver lies there


@dataclass(frozen=True)
class ReceiverMap:
    """Tables by which ``at`` finds receivers."""

    first: np.ndarray  # (n_triangles,) int64: first entry of its image or grid; NOTHING: no receiver
    width: np.ndarray  # (n_triangles,) int32: of its image; 0: it has a grid
    size: np.ndarray  # (n_triangles,) int32: cells along the edges of its grid, or the image's height
    texel: np.ndarray  # (n_triangles, 3, 2) float32: column and row at its corner, steps along u, v
    entries: np.ndarray  # (n,) int32, of all images and grids: receivers, NOTHING for none

    def at(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """(n,) int32 receivers at barycentric (u, v) of triangles; NOTHING where there is none, and for
        triangles below 0."""
        result = np.full(len(triangle), NOTHING, np.int32)
        first = np.take(self.first, triangle)  # of none the last triangle's, which does not count
        some = np.flatnonzero((first >= 0) & (triangle >= 0))
        triangle, u, v = (np.take(each, some) for each in (triangle, u, v))
        entry = np.take(first, some)
        width = np.take(self.width, triangle)
        for mine, find in ((width > 0, self._in_image), (width == 0, self._in_grid)):
            if mine.all():
                entry += find(triangle, u, v, width)
            elif mine.any():
                chosen = np.flatnonzero(mine)
                entry[chosen] += find(*(np.take(each, chosen) for each in (triangle, u, v, width)))
        result[some] = np.take(self.entries, entry)
        return result

    def _in_image(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, width: np.ndarray) -> np.ndarray:
        """(k,) int64 entries at (u, v) of triangles in images of so many columns, from the images' first on."""
        texel = np.take(self.texel.reshape(-1, 6), triangle, axis=0)
        column, row = (texel[:, axis] + u * texel[:, 2 + axis] + v * texel[:, 4 + axis] for axis in (0, 1))
        entry = within(row, np.take(self.size, triangle) - 1).astype(np.int64)
        entry *= width
        entry += within(column, width - 1)
        return entry

    def _in_grid(self, triangle: np.ndarray, u: np.ndarray, v: np.ndarray, _: np.ndarray) -> np.ndarray:
        """(k,) int32 entries at (u, v) of triangles with grids, from the grids' first on."""
        return cell_in_grid(np.take(self.size, triangle), u, v)[0]


def build_receiver_map(receivers: Receivers, triangles: int) -> ReceiverMap:
    """The map for a scene of so many ``triangles``."""
    first, width = np.full(triangles, NOTHING, np.int64), np.zeros(triangles, np.int32)
    size, texel = np.zeros(triangles, np.int32), np.zeros((triangles, 3, 2), np.float32)
    if len(receivers.triangle) == 0:
        return ReceiverMap(first, width, size, texel, np.zeros(0, np.int32))
    entries, mapped = [], np.zeros(triangles, bool)
    if receivers.maps is not None:
        maps = receivers.maps.take(np.isin(receivers.maps.triangle, receivers.triangle))
        t, image, corners = maps.triangle, maps.image, maps.corners
        mapped[t] = True
        texel[t] = corners - corners[:, :1] * np.array([0, 1, 1])[:, None]
        start, sizes, pictures = _pictures(receivers)
        first[t], width[t], size[t] = start[image], sizes[image, 1], sizes[image, 0]
        entries.append(pictures)
    rest = np.flatnonzero(~mapped[receivers.triangle])
    which, cells, grids = _grids(receivers, rest, triangles)
    first[which] = sum(map(len, entries)) + np.cumsum(cells**2) - cells**2
    size[which] = cells
    return ReceiverMap(first, width, size, texel, np.concatenate([*entries, grids]))


def _pictures(receivers: Receivers) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each image the first entry and (height, width), and all their entries, row by row."""
    image, row, column = receivers.grid.T.astype(np.int64)
    count = int(image.max()) + 1
    sizes = np.ones((count, 2), np.int64)
    np.maximum.at(sizes, image, np.stack([row, column], 1) + 1)
    number = sizes.prod(axis=1)
    start = np.cumsum(number) - number
    entries = np.full(int(number.sum()), NOTHING, np.int32)
    entries[start[image] + row * sizes[image, 1] + column] = np.arange(receivers.count)
    return start, sizes, entries


def _grids(
    receivers: Receivers, cells: np.ndarray, triangles: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles (k,) that the ``cells`` (m,) int cover, the size (k,) of their grids, and the grids'
    entries: the receiver of the cell whose middle lies there, or the triangle's largest. A triangle was
    cut into equal cells, of which some may have been cut further: the largest tells the size."""
    areas = cell_areas(receivers.corners, receivers.square)
    area = np.bincount(receivers.triangle[cells], areas[cells], triangles)
    cells = cells[area[receivers.triangle[cells]] > COVERED]
    triangle = receivers.triangle[cells]
    largest = np.zeros(triangles)
    np.maximum.at(largest, triangle, areas[cells])
    which = np.flatnonzero(largest)
    size = np.rint(1 / np.sqrt(largest[which])).astype(np.int64)
    slot = np.zeros(triangles, np.int64)
    slot[which] = np.arange(len(which))
    start = np.cumsum(size**2) - size**2
    order = np.argsort(areas[cells], kind="stable")
    largest = np.zeros(len(which), np.int64)
    largest[slot[triangle[order]]] = receivers.receiver[cells[order]]  # the last one stays
    entries = np.repeat(largest, size**2).astype(np.int32)
    middle = cell_middles(receivers.corners[cells], receivers.square[cells])
    u, v = (np.ascontiguousarray(axis, np.float32) for axis in middle.T)
    index = cell_in_grid(size[slot[triangle]].astype(np.int32), u, v)[0]
    entries[start[slot[triangle[order]]] + index[order]] = receivers.receiver[cells[order]]
    return which, size, entries
