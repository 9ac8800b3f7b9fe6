"""Lamp detail: finer pictures of lamps' light by direction, where a coarse one leaves too much out.

A picture is interpolated between the middles of its pixels. What that leaves out of a narrow beam,
second differences show: the error of linear interpolation over a step h is h² f″ / 8 at most.
"""

from __future__ import annotations

import math
from typing import Callable

import numpy as np

from ..figures import percent
from ..solver.workers.parallel import ranges

# Errors [relative, weighted by power] of interpolation: more is refined, or warned of. A beam that has a
# tenth of the power is off by three times as much.
TOLERANCE, WARNED = 0.004, 0.01
FINEST = 5760  # width [pixels] of a picture, at most: a sixteenth of a degree each
BAND = 16  # number [rows] that are worked on at once: what stays in the cache takes a third of the time
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
        f"{owner}: it has beams narrower than the bake can follow; where they fall, the light may be off by "
        f"{percent(error)}, in addition to the estimated error"
    ] * (error > WARNED)


def bends(picture: np.ndarray) -> np.ndarray:
    """(h, 2 h) squares of the relative error of interpolation about each pixel of ``picture``
    (h, 2 h, 3), weighted by power: they add up to the mean square.

    Directions are judged against the brightest beside them, which interpolation mixes in, or the mean
    where that is darker.
    """
    light = picture[..., 0].astype(np.float32)
    for channel in range(1, picture.shape[2]):
        light += picture[..., channel].astype(np.float32, copy=False)
    height, width = light.shape
    solid = np.cos((np.arange(height) + 0.5 - height / 2) * np.pi / height)[:, None]
    mean = float((solid[:, 0] * light.mean(axis=1, dtype=np.float64)).sum() / solid.sum())
    if mean <= 0:
        return np.zeros_like(light)
    scale = (solid / (64 * mean * solid.sum() * width)).astype(np.float32)
    bend = np.empty_like(light)
    for rows in ranges(height, BAND):
        bend[rows] = _bends_of(light, rows, np.float32(mean)) * scale[rows]
    return bend


def _bends_of(light: np.ndarray, rows: slice, least: np.float32) -> np.ndarray:
    """Some rows of what ``bends`` weighs, of summed channels ``light`` (h, 2 h)."""
    middle, bend = light[rows], np.float32(0)
    level = np.maximum(middle, least)
    for pair in (_beside(light, rows), [np.roll(middle, step, axis=1) for step in (1, -1)]):
        bend = bend + np.abs(pair[0] - 2 * middle + pair[1])
        for beside in pair:
            np.maximum(level, beside, out=level)
    return bend * bend / level


def doubled(picture: np.ndarray) -> np.ndarray:
    """(2 h, 2 w, 3) float32: ``picture`` (h, w, 3) interpolated at the middles of quarter pixels."""
    height, width, channels = picture.shape
    fine = np.empty((2 * height, 2 * width, channels), np.float32)
    for rows in ranges(height, BAND):
        middle, drawn = 0.75 * picture[rows], fine[2 * rows.start : 2 * rows.stop]
        for k, beside in enumerate(_beside(picture, rows)):
            tall = middle + 0.25 * beside
            for j, step in enumerate((1, -1)):
                drawn[k::2, j::2] = 0.75 * tall + 0.25 * np.roll(tall, step, axis=1)
    return fine


def _beside(picture: np.ndarray, rows: slice) -> tuple[np.ndarray, np.ndarray]:
    """The rows before and after each of ``rows``; over a pole lies the row itself, half a turn away."""
    last, half = len(picture) - 1, picture.shape[1] // 2
    before, after = picture[max(rows.start - 1, 0) : rows.stop - 1], picture[rows.start + 1 : rows.stop + 1]
    if rows.start == 0:
        before = np.concatenate([np.roll(picture[0], half, axis=0)[None], before])
    if rows.stop > last:
        after = np.concatenate([after, np.roll(picture[last], half, axis=0)[None]])
    return before, after


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
