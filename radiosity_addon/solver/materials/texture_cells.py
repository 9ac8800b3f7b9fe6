"""Cells: emission that varies over a triangle, cut into parts of which each is nearly constant.

Each triangle is cut into four again and again, down to the size of a texel, and from there parts
that differ little are put together again: a dark part of a picture becomes no light at all, a
bright spot many small ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..fields import Texture, decoded
from ..scene import Scene
from .evaluate import evaluate_field

MOST = 1 << 19  # finest parts of all triangles together
DEEPEST = 9  # times that a triangle is cut into four
SMOOTH = 3  # the same for colours that vary linearly
ROUNDING = 1e-6  # of the radiance: a smaller deviation is none
COARSE = 1e-3  # of all emission: the variation within a cell, at most
WHOLE = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])  # a triangle's corners


@dataclass(frozen=True)
class Cells:
    """n parts of triangles. ``deviation`` is the standard deviation of the radiance in there."""

    triangle: np.ndarray  # (n,) int
    corners: np.ndarray  # (n, 3, 2) barycentric
    radiance: np.ndarray  # (n, 3) mean
    deviation: np.ndarray  # (n,) mean over channels
    share: np.ndarray  # (n,) of the triangle's area
    side: np.ndarray  # (n,) int: 1 only the front emits so, -1 only the back, 0 both do

    def take(self, chosen: np.ndarray) -> Cells:
        """Some of them."""
        return Cells(*(getattr(self, name)[chosen] for name in _ARRAYS))


_ARRAYS = ("triangle", "corners", "radiance", "deviation", "share", "side")


def join_cells(parts: list[Cells]) -> Cells:
    """All of all parts, of which there is at least one."""
    return Cells(*(np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS))


def whole_triangles(triangle: np.ndarray, radiance: np.ndarray) -> Cells:
    """Each triangle (n,) one cell of constant radiance (n, 3)."""
    n = len(triangle)
    return Cells(triangle, np.repeat(WHOLE, n, axis=0), radiance, np.zeros(n), np.ones(n),
                 np.zeros(n, int))  # fmt: skip


def cut(scene: Scene, triangle: np.ndarray, area: np.ndarray) -> tuple[Cells, np.ndarray]:
    """Cells of triangles (n,) whose emission varies, of ``area`` (n,); and the share (n,) of each
    that counts as glowing: (∫L)² / (area ∫L²), 1 where it is constant."""
    pyramids = list(_pyramids(scene, triangle))
    glowing = np.zeros(len(triangle))
    total = 0.0
    for rows, levels in pyramids:
        mean = levels[0].radiance.mean(axis=1)
        glowing[rows] = mean**2 / np.maximum(mean**2 + levels[0].deviation ** 2, 1e-300)
        total += float((area[rows] * mean).sum())
    parts = [whole_triangles(triangle[:0], np.zeros((0, 3)))]
    for rows, levels in pyramids:
        parts += _leaves(levels, area[rows], COARSE * total)
    return join_cells(parts), glowing


def _leaves(levels: list[Cells], area: np.ndarray, limit: float):
    """The coarsest cells of (k,) triangles that vary by no more than ``limit``, and shine."""
    open_ = np.arange(len(area))
    for depth, level in enumerate(levels):
        size = area[open_ // 4**depth] * level.share[open_]
        done = size * level.deviation[open_] <= limit
        done |= depth == len(levels) - 1
        leaf = open_[done]
        yield level.take(leaf[level.radiance[leaf].max(axis=1) > 0])
        open_ = (4 * open_[~done, None] + np.arange(4)).ravel()


def _pyramids(scene: Scene, triangle: np.ndarray):
    """Yield (rows, levels) for triangles of one material that are cut equally often: their place
    in ``triangle``, and Cells from the whole triangles to the finest, four for every one."""
    materials = scene.material[triangle]
    depth = np.zeros(len(triangle), int)
    for material in np.unique(materials):
        rows = np.flatnonzero(materials == material)
        depth[rows] = _depth(scene.materials[material].emission, triangle[rows])
    while (4.0**depth).sum() > MOST and depth.max() > 0:
        depth = np.maximum(depth - 1, 0)
    for material, d in sorted(set(zip(materials.tolist(), depth.tolist()))):
        rows = np.flatnonzero((materials == material) & (depth == d))
        yield rows, _pyramid(scene.materials[material].emission, triangle[rows], d)


def _depth(field, triangle: np.ndarray) -> np.ndarray:
    """(n,) how often triangles (n,) are cut until their parts are as small as texels."""
    if not isinstance(field, Texture):
        return np.full(len(triangle), SMOOTH)
    edge = np.maximum(_texels(field, triangle), 1)
    return np.clip(np.ceil(np.log2(edge)), 0, DEEPEST).astype(int)


def _texels(field: Texture, triangle: np.ndarray) -> np.ndarray:
    """(n,) extent of triangles in texels."""
    height, width = field.pixels.shape[:2]
    place = field.uv[triangle].astype(float) * (width, height)
    return np.abs(place - np.roll(place, 1, axis=1)).max(axis=(1, 2))


def _pyramid(field, triangle: np.ndarray, depth: int) -> list[Cells]:
    """Means and deviations on all levels, from values in the middle of the finest cells."""
    corners = [WHOLE]
    for _ in range(depth):
        corners.append(_four(corners[-1]))
    finest = len(corners[-1])
    place = np.tile(corners[-1].mean(axis=1), (len(triangle), 1))
    field = _blurred(field, triangle, depth)
    first = np.maximum(evaluate_field(field, np.repeat(triangle, finest), place), 0)
    second = (first**2).mean(axis=1)
    levels = []
    for d in range(depth, -1, -1):
        deviation = np.sqrt(np.maximum(second - (first**2).mean(axis=1), 0))
        deviation[deviation < ROUNDING * first.mean(axis=1)] = 0
        levels.insert(0, Cells(
            np.repeat(triangle, 4**d), np.tile(corners[d], (len(triangle), 1, 1)), first, deviation,
            np.full(len(first), 4.0**-d), np.zeros(len(first), int),
        ))  # fmt: skip
        if d:
            first, second = first.reshape(-1, 4, 3).mean(axis=1), second.reshape(-1, 4).mean(axis=1)
    return levels


def _four(corners: np.ndarray) -> np.ndarray:
    """(4n, 3, 2) the quarters of n triangles, one after the other."""
    a, b, c = (corners[:, k] for k in range(3))
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    return np.stack([np.stack(q, 1) for q in quarters], 1).reshape(-1, 3, 2)


def _blurred(field, triangle: np.ndarray, depth: int):
    """The field with texels of about the finest cells' size, as far as its size can be halved, so
    that no bright texel falls between them."""
    if not isinstance(field, Texture):
        return field
    edge = _texels(field, triangle).max() / 2**depth
    field = decoded(field) if edge > 2 else field
    pixels = field.pixels
    while edge > 2 and pixels.shape[0] % 2 == pixels.shape[1] % 2 == 0:
        h, w = pixels.shape[0] // 2, pixels.shape[1] // 2
        pixels = pixels.reshape(h, 2, w, 2, 3).mean(axis=(1, 3))
        edge /= 2
    return replace(field, pixels=pixels)
