"""Photometry: how narrow the beams of an IES text are, so that no picture of a lamp misses one.

The text is IESNA LM-63: candela for vertical angles, in planes through the lamp's axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NOTABLE = 0.01  # share [of a lamp's power]: a beam with less is let go
HEADER = 13  # number [values] before the angles
TILT = "TILT="


@dataclass(frozen=True)
class Photometry:
    """Candela (h, v) in h planes at the vertical ``angles`` (v,) [degrees], which rise."""

    angles: np.ndarray
    candela: np.ndarray


def read_photometry(text: str) -> Photometry | None:
    """What an IES text holds; None where it is no such text."""
    _, mark, rest = text.partition(TILT)
    tilt, _, rest = rest.partition("\n")
    try:
        numbers = np.array(rest.replace(",", " ").split(), np.float64)
        if tilt.strip() == "INCLUDE":
            numbers = numbers[2 + 2 * int(numbers[1]):]
        rows, planes = int(numbers[3]), int(numbers[4])
        values = numbers[HEADER + rows + planes:][: rows * planes].reshape(planes, rows)
    except (ValueError, IndexError):
        return None
    angles = numbers[HEADER:][:rows]
    sound = mark and rows > 1 and planes > 0 and np.all(np.diff(angles) > 0)
    return Photometry(angles, values) if sound else None


def beams(table: Photometry) -> list[tuple[float, float]]:
    """(full width at half maximum [degrees], share of the power) of every beam: what stands out
    between two dips of a plane. The power between two angles is that of their middle."""
    angles, found = table.angles, []
    solid = np.abs(np.diff(np.cos(np.radians(angles))))
    total = float((_middles(table.candela) * solid).sum())
    for plane in table.candela if total > 0 else ():
        dips = _dips(plane)
        for first, last in zip(dips, dips[1:]):
            part = slice(first, last + 1)
            above = np.maximum(plane[part] - max(_floor(plane, first), _floor(plane, last)), 0.0)
            power = float((_middles(above[None]) * solid[first:last]).sum())
            if power > 0:
                found.append((_width(angles[part], above), power / total))
    return found


def narrow_share(table: Photometry, width: float) -> float:
    """The share of the power that is in beams narrower than ``width`` [degrees]."""
    return sum(share for wide, share in beams(table) if wide < width)


def _middles(values: np.ndarray) -> np.ndarray:
    return 0.5 * (values[:, 1:] + values[:, :-1])


def _dips(plane: np.ndarray) -> list[int]:
    """Indices from which the plane rises on; both ends are among them."""
    inner = np.flatnonzero((plane[1:-1] <= plane[:-2]) & (plane[1:-1] < plane[2:])) + 1
    return [0, *inner.tolist(), len(plane) - 1]


def _floor(plane: np.ndarray, index: int) -> float:
    """What a beam that ends there stands on: nothing at an end of the plane, where it goes on over
    the axis, or stops at once."""
    return float(plane[index]) if 0 < index < len(plane) - 1 else 0.0


def _width(angles: np.ndarray, above: np.ndarray) -> float:
    """Full width at half maximum of one beam; at the axis its other half lies beyond."""
    top = int(np.argmax(above))
    half = above[top] / 2
    left, right = angles[: top + 1][::-1], angles[top:]
    low = _crossing(left, above[: top + 1][::-1], half)
    high = _crossing(right, above[top:], half)
    if top == 0 and angles[0] == 0.0:
        low = -high
    return float(high - low)


def _crossing(angles: np.ndarray, values: np.ndarray, half: float) -> float:
    """The first angle from the top on at which the values are half of it."""
    under = np.flatnonzero(values < half)
    if not len(under):
        return float(angles[-1])
    k = int(under[0])
    share = (values[k - 1] - half) / (values[k - 1] - values[k])
    return float(angles[k - 1] + share * (angles[k] - angles[k - 1]))
