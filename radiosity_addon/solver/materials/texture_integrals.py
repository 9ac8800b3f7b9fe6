"""Texture integrals: the exact mean of a picture over a triangle or a parallelogram in its UV map.

By Green's theorem the integral of f over a region is ∮ F dy along its border, with F(x, y) = ∫ f dx
along the picture's row. Sums along rows (one half of a summed-area table, Crow 1984) give F
anywhere; between two lines of texels it is a polynomial, of degree 1 in x for nearest texels, of
degree 2 in x and 1 in y for bilinear ones. So an edge is cut where it crosses lines, and one or two
Gauss points a piece give the integral exactly, however large the region and wherever it lies: the
cost is that of the region's border.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fields import Texture, decoded, srgb_to_linear
from ..geometry.planar import determinants
from ..ragged import ragged_ranges
from .evaluate import bilinear, mirrored

THIN = 1e-3  # width [texels] that thinner regions are widened to, such as points, by which a palette is looked up
# Numbers [parts along a texel's edge; parts of all texels] of a picture that is decoded after it is interpolated, at most.
FINEST, MOST_PARTS = 8, 1 << 22
MOST_TEXELS = 1 << 21  # number [texels] of a picture that is summed: larger ones are halved first
PIECES = 1 << 19  # number [pieces of edges] at a time, about: bounds the memory of their arrays
GAUSS = 0.5 / np.sqrt(3)  # offset [of an interval] of Gauss's two points from its middle: exact up to degree 3


@dataclass(frozen=True)
class TextureSums:
    """A picture's texels and their sums along rows, for p quantities.

    ``linear``: values are interpolated between the texels' middles.
    """

    texels: np.ndarray  # (height, width, p) float64
    sums: np.ndarray  # (height, width + 1, p) float64: of the texels before, in the row
    extension: str
    linear: bool

    def means(self, origin: np.ndarray, u: np.ndarray, v: np.ndarray, square: bool) -> np.ndarray:
        """(n, p) means over the parallelograms, or triangles, of n regions: ``origin`` (n, 2) and
        edges ``u`` and ``v`` (n, 2), all UV."""
        size = np.array(self.texels.shape[1::-1], float)
        u, v = _widened(u * size, v * size)
        origin = origin * size - (0.5 if self.linear else 0.0)
        corners = [origin, origin + u, origin + u + v, origin + v]
        corners = np.stack(corners if square else corners[:2] + corners[3:], 1)
        result = np.empty((len(corners), self.texels.shape[2]))
        for some in _bands(corners):
            result[some] = self._integrals(corners[some])
        area = determinants(u, v) * (1.0 if square else 0.5)
        return result / area[:, None]

    def _integrals(self, corners: np.ndarray) -> np.ndarray:
        """(n, p) signed integrals over polygons (n, k, 2), in texels."""
        n, k = corners.shape[:2]
        start = corners.reshape(-1, 2)
        step = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 2)
        some = np.flatnonzero(step[:, 1])  # elsewhere dy = 0
        edge, low, high = _pieces(start[some], step[some])
        edge = some[edge]
        middle, length = (low + high) / 2, high - low
        start, step = start[edge], step[edge]
        cell = np.floor(start + middle[:, None] * step).astype(np.int64)
        if self.linear:
            parameters = (middle - GAUSS * length, middle + GAUSS * length)
        else:
            parameters = (middle,)
        value = sum(self._along_row(cell, start + t[:, None] * step) for t in parameters) / len(parameters)
        value *= (step[:, 1] * length)[:, None]
        total = [np.bincount(edge // k, column, n) for column in value.T]
        return np.stack(total, 1)

    def _along_row(self, cell: np.ndarray, point: np.ndarray) -> np.ndarray:
        """(m, p) F at ``point`` (m, 2) in texels, all in the texels ``cell`` (m, 2) int."""
        column, row = cell.T
        x, y = (point - cell).T[..., None]
        if not self.linear:
            return self._before(column, row) + x * self._value(column, row)
        low, high = (
            self._before(column, r) + (0.5 + x - x * x / 2) * self._value(column, r)
            + x * x / 2 * self._value(column + 1, r)
            for r in (row, row + 1)
        )
        return (1 - y) * low + y * high

    def _value(self, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(m, p) texels, with the picture's extension beyond its edges."""
        height, width = self.texels.shape[:2]
        row, outside = self._inside(row, height)
        column, beside = self._inside(column, width)
        found = self.texels[row, column]
        if self.extension == "CLIP":
            found[outside | beside] = 0
        return found

    def _before(self, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(m, p) signed sums of a row's texels from column 0 to before ``column``, any integer."""
        height, width = self.texels.shape[:2]
        row, outside = self._inside(row, height)
        if self.extension == "REPEAT":
            periods, rest = np.divmod(column, width)
            return self.sums[row, rest] + periods[:, None] * self.sums[row, width]
        if self.extension == "MIRROR":
            periods, rest = np.divmod(column, 2 * width)
            back = (rest > width)[:, None]
            period = self.sums[row, width]
            found = self.sums[row, np.where(rest > width, 2 * width - rest, rest)]
            return np.where(back, 2 * period - found, found) + (2 * periods)[:, None] * period
        kept = np.clip(column, 0, width)
        found = self.sums[row, kept]
        if self.extension == "CLIP":
            found[outside] = 0
            return found
        edge = self.texels[row, np.where(column < 0, 0, width - 1)]
        return found + (column - kept)[:, None] * edge

    def _inside(self, index: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Indices brought into ``range(size)``, and whether they lay outside of it."""
        outside = (index < 0) | (index >= size)
        if self.extension == "REPEAT":
            return index % size, outside
        if self.extension == "MIRROR":
            return mirrored(index, size), outside
        return np.clip(index, 0, size - 1), outside


def sum_texture(texture: Texture) -> TextureSums:
    """The sums of a texture's three channels, without the offset, where negative 0, and of their mean
    square."""
    fine = _decoded_finely(_halved(texture))
    texels = np.maximum(np.asarray(fine.pixels, float) * fine.factor, 0)
    texels = np.concatenate([texels, (texels**2).mean(axis=2, keepdims=True)], axis=2)
    sums = np.zeros((texels.shape[0], texels.shape[1] + 1, 4))
    np.cumsum(texels, axis=1, out=sums[:, 1:])
    return TextureSums(texels, sums, fine.extension, fine.interpolation != "Closest")


def _halved(texture: Texture) -> Texture:
    """The texture with fewer, larger texels where it has too many: along its longer side every two
    become one, as long as that goes without a rest."""
    pixels = texture.pixels
    if pixels.shape[0] * pixels.shape[1] <= MOST_TEXELS:
        return texture
    pixels = decoded(texture).pixels
    while pixels.shape[0] * pixels.shape[1] > MOST_TEXELS:
        axis = int(pixels.shape[1] > pixels.shape[0])
        axis = axis if pixels.shape[axis] % 2 == 0 else 1 - axis
        if pixels.shape[axis] % 2:
            break
        one, other = np.split(pixels.reshape(_paired(pixels.shape, axis)), 2, axis + 1)
        pixels = ((one + other) / 2).squeeze(axis + 1)
    return Texture(pixels, texture.uv, texture.extension, "Closest", texture.factor)


def _paired(shape: tuple, axis: int) -> tuple:
    """The shape in which every two entries along an axis have one of their own."""
    return (*shape[:axis], shape[axis] // 2, 2, *shape[axis + 1 :])


def _decoded_finely(texture: Texture) -> Texture:
    """The texture with linear pixels. What is decoded after it was interpolated, which no
    polynomial is, becomes nearest texels of a finer picture: each the mean of four places in it.
    Where there is no room for that, pixels are decoded before."""
    if not texture.encoded or texture.interpolation == "Closest":
        return decoded(texture)
    height, width = texture.pixels.shape[:2]
    parts = FINEST
    while parts > 1 and height * width * parts**2 > MOST_PARTS:
        parts //= 2
    if parts == 1:
        return decoded(texture)
    x, y = ((np.arange(size * parts) + 0.5) / parts for size in (width, height))
    fine = 0.0
    for dx, dy in np.stack(np.meshgrid([-GAUSS, GAUSS], [-GAUSS, GAUSS]), -1).reshape(-1, 2):
        point = np.stack(np.meshgrid(x + dx / parts, y + dy / parts), -1).reshape(-1, 2)
        fine = fine + srgb_to_linear(bilinear(texture, point)) / 4
    pixels = fine.reshape(height * parts, width * parts, 3)
    return Texture(pixels, texture.uv, texture.extension, "Closest", texture.factor)


def _widened(u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n, 2) of regions, in texels, of which those that are points or lines are made THIN."""
    u, v = u.copy(), v.copy()
    length = np.linalg.norm(u, axis=1), np.linalg.norm(v, axis=1)
    cross = determinants(u, v)
    thin = np.flatnonzero(np.abs(cross) < THIN * np.maximum(np.maximum(*length), THIN))
    swap = (length[1] > length[0])[thin, None]
    long, short = np.where(swap, v[thin], u[thin]), np.where(swap, u[thin], v[thin])
    size = np.linalg.norm(long, axis=1, keepdims=True)
    long = np.where(size < THIN, [THIN, 0.0], long)
    across = long[:, ::-1] * [-1, 1] / np.linalg.norm(long, axis=1, keepdims=True)
    side = determinants(long, short)[:, None]
    short = short + np.where(side < 0, -THIN, THIN) * across
    u[thin], v[thin] = np.where(swap, short, long), np.where(swap, long, short)
    return u, v


def _bands(corners: np.ndarray) -> list[slice]:
    """Slices of polygons (n, k, 2) whose edges cross about PIECES lines together."""
    step = np.abs(np.roll(corners, -1, axis=1) - corners).sum(axis=(1, 2)) + 2 * corners.shape[1]
    band = (np.cumsum(step) // PIECES).astype(np.int64)
    start = np.flatnonzero(np.diff(band, prepend=-1))
    return [slice(a, b) for a, b in zip(start, [*start[1:], len(corners)])]


def _pieces(start: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges ``start`` (m, 2) + t ``step`` cut where they cross lines of whole x or y: edge (l,),
    and from which t to which t (l,) each piece runs."""
    m = len(start)
    edges, cuts = [np.arange(m)], [np.zeros(m)]
    for axis in (0, 1):
        ends = start[:, axis], start[:, axis] + step[:, axis]
        first = np.floor(np.minimum(*ends)).astype(np.int64) + 1
        count = np.maximum(np.ceil(np.maximum(*ends)).astype(np.int64) - first, 0)
        edge, rank = ragged_ranges(count)
        edges.append(edge)
        cuts.append(((first[edge] + rank) - start[edge, axis]) / step[edge, axis])
    edge, low = np.concatenate(edges), np.clip(np.concatenate(cuts), 0, 1)
    order = np.lexsort((low, edge))
    edge, low = edge[order], low[order]
    high = np.append(low[1:], 1.0)
    high[np.flatnonzero(np.diff(edge, append=m))] = 1
    return edge, low, high
