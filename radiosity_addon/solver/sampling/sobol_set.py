"""Sobol set: the points themselves, scrambled as Matoušek (1998) says, bit for bit as SciPy's.

SciPy's are in ``scipy.stats``, whose import takes as long as all else that a bake imports.
"""

from __future__ import annotations

from functools import cache

import numpy as np

BITS = 30  # number [binary digits] of a coordinate
# Coefficients [binary digits] of each dimension's primitive polynomial, and its first direction numbers
# (Joe and Kuo 2008, new-joe-kuo-6).
POLYNOMIALS = (1, 3, 7, 11, 13, 19, 25, 37)
FIRST_NUMBERS = ((), (1,), (1, 3), (1, 3, 1), (1, 1, 1), (1, 1, 3, 3), (1, 3, 5, 13), (1, 1, 5, 5, 17))
PLACES = np.uint32(1) << np.arange(BITS, dtype=np.uint32)  # value [of a digit], the least first


class SobolSet:
    """A Sobol sequence of up to eight ``dimensions``, scrambled by what ``generator`` spawns."""

    def __init__(self, dimensions: int, generator: np.random.Generator) -> None:
        if not 0 < dimensions <= len(POLYNOMIALS):
            raise ValueError(f"{dimensions} dimensions; there are 1 to {len(POLYNOMIALS)}")
        (generator,) = generator.spawn(1)  # as SciPy does
        digits = generator.integers(2, size=(dimensions, BITS), dtype=np.uint32)
        matrix = generator.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32)
        matrix = np.tril(matrix, -1) | np.eye(BITS, dtype=np.uint32)
        self._shift = digits @ PLACES
        self._directions = np.stack(
            [_scrambled(_directions(d), matrix[d]) for d in range(dimensions)], axis=1
        )

    def points(self, first: int, count: int) -> np.ndarray:
        """(count, dimensions) uint32 below 2^30: the points from number ``first`` on, in the order of
        Gray's code, in which each differs from the one before by one direction."""
        number = np.arange(first, first + count, dtype=np.uint32)
        gray = number ^ (number >> np.uint32(1))
        found = np.tile(self._shift, (count, 1))
        for bit in range(int(first + count - 1).bit_length()):
            found ^= (gray >> np.uint32(bit) & np.uint32(1))[:, None] * self._directions[bit]
        return found


@cache
def _directions(dimension: int) -> np.ndarray:
    """(BITS,) uint32: the direction numbers of a dimension, the first the greatest."""
    polynomial, numbers = POLYNOMIALS[dimension], list(FIRST_NUMBERS[dimension])
    degree = len(numbers)
    if degree == 0:
        numbers = [1] * BITS
    while len(numbers) < BITS:
        new = numbers[-degree]
        for k in range(1, degree + 1):
            if polynomial >> (degree - k) & 1:
                new ^= numbers[-k] << k
        numbers.append(new)
    return np.array(numbers, np.uint32) * PLACES[::-1]


def _scrambled(directions: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(BITS,) uint32: the digits of each of ``directions``, the highest first, times ``matrix`` (BITS, BITS)
    modulo 2."""
    digits = directions[:, None] // PLACES[::-1] & np.uint32(1)
    return (digits @ matrix.T & np.uint32(1)) @ PLACES[::-1]
