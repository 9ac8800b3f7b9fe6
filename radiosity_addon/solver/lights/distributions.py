"""Distributions: lamps that shine unevenly, as luminaires do whose makers measured them (IES files).

A distribution is a picture of all directions, laid out as a ``scene.Sky``: what is in there multiplies
a lamp's intensity, linearly interpolated between the middles of pixels. How much leaves about a
direction at most, a coarse picture of maxima tells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

ROWS = 18  # number [rows] of the coarse picture: 10° each
CAP = np.pi / ROWS  # angle [rad] around a direction that its coarse maximum holds for
FINE = 256  # number [nodes] of the quadrature along a lamp's axis, and around it


@dataclass(frozen=True)
class Distributions:
    """Of k lamps: which of the ``pictures`` (h, w) float32 each has, −1 for none."""

    number: np.ndarray  # (k,) int
    pictures: tuple[np.ndarray, ...]
    maxima: tuple[np.ndarray, ...]  # (ROWS, 2 ROWS), within CAP of all directions of a pixel

    def uneven(self, which: int | np.ndarray) -> bool:
        """Whether any lamp of ``which``, one or (...), has a picture."""
        return bool(np.max(self.number[which], initial=-1) >= 0)

    def at(self, which: int | np.ndarray, unit: np.ndarray) -> np.ndarray:
        """(...) shares of the intensity of lamps ``which``, one or (...), that leave in unit
        directions (3, ...)."""
        return self._looked_up(which, unit, self.pictures, interpolated)

    def most(self, which: int | np.ndarray, unit: np.ndarray, slack: np.ndarray) -> np.ndarray:
        """(...) no smaller than the share in any direction whose ``chord`` from ``unit`` (3, ...)
        is below ``slack`` (...)."""
        found = self._looked_up(which, unit, self.maxima, nearest)
        return np.where(slack < 2 * np.sin(CAP / 2), found, 1.0)

    def _looked_up(self, which: int | np.ndarray, unit: np.ndarray, pictures: tuple, look: Callable) -> np.ndarray:
        result = np.ones(unit.shape[1:])
        number = np.broadcast_to(self.number[which], result.shape)
        for one in np.unique(number):
            some = number == one
            if one >= 0:
                result[some] = look(pictures[one], unit[:, some])
        return result


def make_distributions(shapes: list) -> Distributions | None:
    """The distributions of lamps, given a picture or None for each; None where no lamp has one. Lamps with the same
    array share it."""
    distinct = {id(shape): shape for shape in shapes if shape is not None}
    if not distinct:
        return None
    number_of = {key: number for number, key in enumerate(distinct)}
    number = np.array([-1 if shape is None else number_of[id(shape)] for shape in shapes])
    pictures = tuple(np.asarray(shape, np.float32) for shape in distinct.values())
    return Distributions(number, pictures, tuple(map(coarse_maxima, pictures)))


def interpolated(picture: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(n,) the picture in unit directions (3, n), bilinear, around the sphere and up to its poles."""
    height, width = picture.shape
    row, column = _row_and_column(unit, height, width)
    row, column = np.clip(row - 0.5, 0, height - 1), column - 0.5
    top, left = np.minimum(row.astype(int), max(height - 2, 0)), np.floor(column).astype(int)
    down, right = row - top, column - left
    below = np.minimum(top + 1, height - 1)
    left, beside = left % width, (left + 1) % width
    upper = picture[top, left] * (1 - right) + picture[top, beside] * right
    lower = picture[below, left] * (1 - right) + picture[below, beside] * right
    return upper * (1 - down) + lower * down


def nearest(picture: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """(n,) the pixels that unit directions (3, n) lie in."""
    height, width = picture.shape
    row, column = (axis.astype(int) for axis in _row_and_column(unit, height, width))
    return picture[np.minimum(row, height - 1), column % width]


def _row_and_column(unit: np.ndarray, height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (n,) of directions (3, n) in a picture, in pixels from its corner."""
    x, y, z = unit.astype(float)
    row = (0.5 + np.arcsin(np.clip(z, -1, 1)) / np.pi) * height
    return row, (0.5 - np.arctan2(y, x) / (2 * np.pi)) * width


def coarse_maxima(picture: np.ndarray) -> np.ndarray:
    """(ROWS, 2 ROWS) maxima within CAP of any direction of a pixel: a cap of angle β about
    latitude λ holds longitudes up to asin(sinβ / cosλ) away, or a pole and so all of them."""
    height, width = picture.shape
    result = np.zeros((ROWS, 2 * ROWS))
    for row in range(ROWS):
        first, last = _span((row - 1) / ROWS, (row + 2) / ROWS, height)
        band = picture[max(first, 0) : min(last, height - 1) + 1].max(axis=0)
        high = max(abs((row + k) / ROWS - 0.5) for k in (0, 1)) * np.pi
        sine = np.sin(CAP) / max(np.cos(high), 1e-9)
        for column in range(2 * ROWS):
            if sine >= 1:
                result[row, column] = band.max()
                continue
            beside = np.arcsin(sine) / (2 * np.pi)
            first, last = _span(
                column / (2 * ROWS) - beside, (column + 1) / (2 * ROWS) + beside, width
            )
            result[row, column] = band[np.arange(first, last + 1) % width].max()
    return result


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    """First and last of ``size`` pixels that count between two places in [0, 1]."""
    return int(np.floor(low * size - 0.5)), int(np.ceil(high * size + 0.5))
