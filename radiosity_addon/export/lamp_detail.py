"""Lamp detail: finer pictures of lamps' light by direction, where a coarse one leaves too much out.

A picture is interpolated between the middles of its pixels. What that leaves out of a narrow beam,
second differences show: the error of linear interpolation over a step h is h² f″ / 8 at most.
"""

from __future__ import annotations

import math
from typing import Callable

import numpy as np

from ..figures import percent

# Errors [relative, weighted by power] of interpolation: more is refined, or warned of. A beam that has a
# tenth of the power is off by three times as much.
TOLERANCE, WARNED = 0.004, 0.01
FINEST = 5760  # width [pixels] of a picture, at most: a sixteenth of a degree each
BLOCK = 15  # edge [pixels] of the parts that are looked at: it divides a picture's edges
# Numbers [parts, pixels] that are rendered anew in one doubling: some seconds.
MOST_PARTS, MOST_PIXELS = 32, 400_000

Box = tuple[slice, slice]  # rows and columns of a picture


def refined(picture: np.ndarray, render: Callable[[int, Box], np.ndarray]) -> tuple[np.ndarray, float]:
    """``picture`` (h, 2 h, 3) with twice as many rows and columns, and again, until its
    interpolation is good enough; and the error (see ``bends``) that is left.

    ``render(width, box)`` gives a part of the picture of that many columns.
    """
    while picture.shape[1] < FINEST:
        boxes = _rough_parts(bends(picture))
        if not boxes:
            break
        picture = doubled(picture)
        for box in boxes:
            picture[box] = render(picture.shape[1], box)
    return picture, math.sqrt(bends(picture).sum(dtype=np.float64))


def beam_warning(owner: str, error: float) -> list[str]:
    """One sentence where the light of lamp ``owner`` varies more than its picture shows."""
    return [
        f"{owner}: its light by direction varies more than the bake follows; what its narrow beams "
        f"light may be off by {percent(error)}, in addition to the estimated error"
    ] * (error > WARNED)


def bends(picture: np.ndarray) -> np.ndarray:
    """(h, 2 h) squares of the relative error of interpolation about each pixel of ``picture``
    (h, 2 h, 3), weighted by power: they add up to the mean square.

    Directions are judged against the brightest beside them, which interpolation mixes in, or the mean
    where that is darker.
    """
    light = picture.sum(axis=2, dtype=np.float32)  # a fine picture has 16 million pixels
    height, width = light.shape
    solid = np.cos((np.arange(height) + 0.5 - height / 2) * np.pi / height)[:, None]
    mean = float((solid[:, 0] * light.mean(axis=1, dtype=np.float64)).sum() / solid.sum())
    if mean <= 0:
        return np.zeros_like(light)
    bend, level = np.zeros_like(light), np.maximum(light, np.float32(mean))
    for pair in (_beside(light), [np.roll(light, step, axis=1) for step in (1, -1)]):
        bend += np.abs(pair[0] - 2 * light + pair[1])
        for beside in pair:
            np.maximum(level, beside, out=level)
    bend *= bend
    bend /= level
    bend *= (solid / (64 * mean * solid.sum() * width)).astype(np.float32)
    return bend


def doubled(picture: np.ndarray) -> np.ndarray:
    """(2 h, 2 w, 3) float32: ``picture`` (h, w, 3) interpolated at the middles of quarter pixels."""
    above, below = _beside(picture)
    rows = np.stack([0.75 * picture + 0.25 * above, 0.75 * picture + 0.25 * below], axis=1)
    rows = rows.reshape(-1, *picture.shape[1:])
    left, right = np.roll(rows, 1, axis=1), np.roll(rows, -1, axis=1)
    columns = np.stack([0.75 * rows + 0.25 * left, 0.75 * rows + 0.25 * right], axis=2)
    return columns.reshape(len(rows), -1, picture.shape[2]).astype(np.float32)


def _beside(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows before and after each; over a pole lies the row itself, half a turn away."""
    half = picture.shape[1] // 2
    first, last = (np.roll(picture[row], half, axis=0)[None] for row in (0, -1))
    return np.concatenate([first, picture[:-1]]), np.concatenate([picture[1:], last])


def _rough_parts(square: np.ndarray) -> list[Box]:
    """The parts of twice as fine a picture in which most of the error ``square`` (h, w) is: runs of
    blocks, the worst first, no more than a bake should wait for."""
    height, width = (size // BLOCK for size in square.shape)
    blocks = square.reshape(height, BLOCK, width, BLOCK).sum(axis=(1, 3), dtype=np.float64)
    least = np.sort(blocks, axis=None)
    harmless = np.searchsorted(np.cumsum(least), TOLERANCE**2)
    if harmless == len(least):
        return []
    found = []
    for row, rough in enumerate(blocks >= least[harmless]):
        ends = np.flatnonzero(np.diff(rough, prepend=False, append=False))
        found += [(blocks[row, a:b].sum(), row, a, b) for a, b in ends.reshape(-1, 2).tolist()]
    side, boxes, pixels = 2 * BLOCK, [], 0
    for _, row, first, last in sorted(found, reverse=True)[:MOST_PARTS]:
        pixels += side**2 * (last - first)
        if pixels <= MOST_PIXELS:
            boxes.append((slice(side * row, side * (row + 1)), slice(side * first, side * last)))
    return boxes
