"""Plan: how much of everything to spend for an asked error.

The constants were measured on the study's scenes (docs/trade.md); the loop in ``rounds``
corrects what they get wrong, so they decide on speed, not on truth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

MANY_RECEIVERS = 400_000  # number [receivers]: more get half the rays in the first round
# Numbers [rays, points of all receivers] of the first round, at least. Measured with fewer: 10 % less time, and 1.5 times
# the error. A draft takes half of them.
FIRST_RAYS, FIRST_POINTS = 720_000, 360_000
# Numbers [rays, points of all receivers] of the first round for vertex colors, at least: of a face that a shadow crosses, and
# that has few points, the replicates agree by chance.
CORNER_RAYS, CORNER_POINTS = 1_440_000, 1_000_000
DRAFT = 0.06  # error [relative] asked for: from it on, half of the first rays and points will do
# Number [receivers] above which gathering again costs more than elements do; and how many of them an
# element may serve.
VERY_MANY_RECEIVERS, RECEIVERS_PER_ELEMENT = 1_200_000, 200
# Numbers [elements] at an error of 3 %, for images and for vertex colors. On many small faces the light is wrong, and alike
# in both replicates, where elements are as large as for images. Measured when every corner counted alike, however small
# its faces.
ELEMENTS, CORNER_ELEMENTS = 1000.0, 8000.0
USUAL = 0.03  # error [relative] at which these numbers, and POINTS, hold
FINER = 1.3  # exponent [of the error]: by it fewer elements do where more error is asked for
FEWEST_ELEMENTS, MOST_FIRST_ELEMENTS = 200, 60_000  # numbers [elements] at the start, at least and at most
# Numbers [rays of a receiver] of the first round, for errors [relative] below these; RAYS for others.
FINE, FINE_RAYS, MEDIUM, MEDIUM_RAYS, RAYS = 0.015, 16, 0.025, 8, 4
MOST_FIRST_RAYS, MOST_FIRST_POINTS = 256, 16  # numbers [rays, points of a receiver] of the first round, at most
# Numbers [rays, points of all receivers] of the first round, at least, where receivers are few. The replicates of
# few receivers agree by chance, however far off they are.
FEW_RAYS, FEW_POINTS = 32_768, 16_384
MOST_OF_FEW = 1024  # number [rays or points of a receiver] of the first round, at most, where receivers are few
# Number [points of a receiver] of the first round at an error of 3 %, and exponent [of the error]: by it there are more
# where less error is asked for. Where the points of both replicates agree by chance, no error shows and no points are
# added. In a texel of which a shadow leaves any part p lit, that costs a squared error of ∫ p² (1 − p)^2n dp ~ n^-3.
POINTS, MORE_POINTS = 3.8, 2 / 3
FEWEST_POINTS = 2  # number [points of a receiver] of the first round, at least
GOAL, ENOUGH = 0.75, 0.85  # shares [of the error asked for] that samples are sized for, and that will do
ROW_RAYS, ROW_POINTS = 64, 8  # numbers [rays, points] of an element's row
PATCH_POINTS = 2  # number [points] of the row of a receiver's patch
FEWEST_PATCH_RAYS = 4  # number [rays] of such a row, at least; it has ROW_RAYS at most
MOST_ELEMENTS = 200_000  # number [elements]: with so many, none get finer
MOST_ROW_RAYS = 10_000_000  # number [rays of all elements]: bounds the memory of their rows


@dataclass(frozen=True)
class Plan:
    """Numbers are per replicate; rays and points are 2^k or 3·2^k, as Sobol sets want."""

    goal: float  # estimated relative error that more samples are sized for
    enough: float  # estimated relative error at which to stop
    elements: int
    row_rays: int
    row_points: int
    patch_rays: int  # of each patch of a receiver
    patch_points: int
    points: int  # of each receiver, for direct light
    rays: int  # of each receiver, for gathered light
    excess: float = math.inf  # error [of that allowed] of the coarser elements that these were made of; inf: of none

    def refined(self, excess: float) -> Plan:
        """More elements, whose error is ``excess`` times what it may be (error² ~ 1 / elements)."""
        elements = int(min(self.elements * min(max(excess**2, 2), 16), MOST_ELEMENTS))
        rays = 2 * self.row_rays if 2 * self.row_rays * elements <= MOST_ROW_RAYS else self.row_rays
        return replace(self, elements=elements, row_rays=rays, patch_rays=2 * self.patch_rays, excess=excess)


def make_plan(error: float, receivers: int, smoothing: bool, corners: bool = False) -> Plan:
    """The first round for a relative ``error`` at ``receivers``; ``smoothing``: texels share;
    ``corners``: the error is that of colors fitted to them."""
    elements = CORNER_ELEMENTS if corners else ELEMENTS
    if receivers > VERY_MANY_RECEIVERS:
        elements = max(elements, receivers / RECEIVERS_PER_ELEMENT)
    elements = max(elements * (USUAL / error) ** FINER, FEWEST_ELEMENTS)
    rays = _first_rays(error, smoothing)
    if receivers > MANY_RECEIVERS:
        rays = max(rays // 2, RAYS)
    points = round_up(POINTS * (USUAL / error) ** MORE_POINTS, FEWEST_POINTS, MOST_FIRST_POINTS)
    each = (1.0 if error < DRAFT else 0.5) / max(receivers, 1)
    first = (CORNER_RAYS, CORNER_POINTS) if corners else (FIRST_RAYS, FIRST_POINTS)
    rays = max(rays, _first(each, RAYS, (first[0], MOST_FIRST_RAYS), (FEW_RAYS, MOST_OF_FEW)))
    points = max(points, _first(each, FEWEST_POINTS, (first[1], MOST_FIRST_POINTS), (FEW_POINTS, MOST_OF_FEW)))
    patch_rays = ROW_RAYS * elements / max(receivers, 1)
    return Plan(
        goal=GOAL * error,
        enough=ENOUGH * error,
        elements=int(min(elements, MOST_FIRST_ELEMENTS)),
        row_rays=ROW_RAYS,
        row_points=ROW_POINTS,
        patch_rays=round_up(patch_rays, FEWEST_PATCH_RAYS, ROW_RAYS),
        patch_points=PATCH_POINTS,
        points=points,
        rays=rays,
    )


def _first_rays(error: float, smoothing: bool) -> int:
    """Of each receiver in the first round, for a relative ``error``. Without ``smoothing`` no neighbors
    share rays, so that each receiver needs as many as for the smallest errors."""
    if error < FINE or not smoothing:
        return FINE_RAYS
    return MEDIUM_RAYS if error < MEDIUM else RAYS


def _first(each: float, least: int, *bounds: tuple[int, int]) -> int:
    """Number of samples of a receiver in the first round, at least ``least``. Of every (total, most) in ``bounds`` a
    receiver gets the part ``each`` of the total, but no more than ``most``; the largest of these numbers counts."""
    return max(round_up(total * each, least, most) for total, most in bounds)


def round_up(number: float, low: int, high: int) -> int:
    """The next above ``number`` of 2^k and 3·2^k, which Sobol sets like; between ``low``, a power
    of two, and ``high``."""
    size = low
    while size < min(number, high):
        size = size * 3 // 2 if size & (size - 1) == 0 else size * 4 // 3
    return size
