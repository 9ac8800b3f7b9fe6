"""Texture blocks: the parts of a triangle on which a picture of nearest texels has one color.

Pixel art, screens and strips of lights have few: each becomes cells of constant radiance cut along
the texels' borders, in place of many small ones cut without regard to them.
"""

from __future__ import annotations

import numpy as np

from ..fields import Texture
from ..geometry.planar import clip, doubled_areas, fan
from .evaluate import texels

MOST_BLOCKS = 64  # number [blocks of a triangle]: with more it is cut without regard to texels
MOST_TEXELS = 1 << 16  # number [texels] of the box around a triangle: in a larger one no blocks are looked for
LEAST_AREA = 1e-9  # area [of the triangle]: smaller parts are rounding, and are left out


def one_colored_parts(field: Texture, triangle: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Barycentric corners (m, 3, 2) of parts of one triangle in which ``field``, of nearest texels,
    is constant and not black, and their texels (m, 3), not yet decoded; None where there are more than MOST_BLOCKS,
    or where the triangle has no area in the picture."""
    size = np.array(field.pixels.shape[1::-1], float)
    corners = field.uv[triangle].astype(float) * size
    edges = corners[1:] - corners[0]
    low, high = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
    extent = (high - low).astype(np.int64)
    area = edges[0, 0] * edges[1, 1] - edges[0, 1] * edges[1, 0]
    if abs(area) < LEAST_AREA * extent.max() ** 2 or extent.prod() > MOST_TEXELS:
        return None
    row, column = np.indices(extent[::-1])
    colors = texels(field, (column + int(low[0])).ravel(), (row + int(low[1])).ravel())
    blocks = _blocks(colors.reshape(*row.shape, 3))
    if len(blocks) > MOST_BLOCKS:
        return None
    parts, found = [], []
    to_barycentric = np.linalg.inv(edges)
    for x0, x1, y0, y1 in blocks:
        polygon = _clipped(corners, low + (x0, y0), low + (x1, y1))
        polygon = (polygon - corners[0]) @ to_barycentric
        pieces = fan(polygon)
        pieces = pieces[np.abs(doubled_areas(pieces)) > LEAST_AREA]
        parts.append(pieces)
        found.append(np.tile(colors[y0 * extent[0] + x0], (len(pieces), 1)))
    nothing = np.zeros((0, 3, 2)), np.zeros((0, 3))
    return np.concatenate([nothing[0], *parts]), np.concatenate([nothing[1], *found])


def _blocks(colors: np.ndarray) -> list[tuple[int, int, int, int]]:
    """Rectangles (x0, x1, y0, y1) of equal colors in (height, width, 3), none of them black: runs
    in rows, joined with those above that are alike; one more than MOST_BLOCKS at most."""
    height, width = colors.shape[:2]
    begins = np.ones((height, width), bool)
    begins[:, 1:] = (colors[:, 1:] != colors[:, :-1]).any(axis=2)
    row, start = np.nonzero(begins)
    stop = np.append(start[1:], 0)
    stop[stop == 0] = width
    shining = colors[row, start].max(axis=1) > 0
    done, open_ = [], {}
    for y, a, b in zip(*(array[shining].tolist() for array in (row, start, stop))):
        key = (a, b, *colors[y, a])
        first, last = open_.get(key, (y, y))
        if last == y or last == y - 1:
            open_[key] = (first, y)
        else:
            done.append((a, b, first, last + 1))
            open_[key] = (y, y)
        if len(done) + len(open_) > MOST_BLOCKS:
            break
    return done + [(key[0], key[1], first, last + 1) for key, (first, last) in open_.items()]


def _clipped(polygon: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(k, 2) the part of a convex polygon within a box."""
    for axis in (0, 1):
        for limit, sign in ((low[axis], 1), (high[axis], -1)):
            polygon = clip(polygon, sign * (polygon[:, axis] - limit))
    return polygon
