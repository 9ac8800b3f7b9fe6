"""Hanging corners: those that lie on an edge of another piece, between its ends. NumPy and SciPy only.

Where one long edge goes on as several short ones, colors are linear over the long one, so that the
corners between have to lie on the line between its ends' colors for both sides to show the same: they
are no unknowns of their own, as hanging nodes are none in finite elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..solver.array_struct import ArrayStruct

ROUNDS = 60  # number [rounds] of replacing corners by what they hang on, where edges hang in a ring
DONE = 1e-9  # weight [of all corners'] left on those that hang: with less, replacing them ends


@dataclass(frozen=True)
class Hanging(ArrayStruct):
    """Colors ``corner`` (k,) int, each once, that are ``share`` (k,) of the way from the colors
    ``start`` (k,) to ``end`` (k,)."""

    corner: np.ndarray
    start: np.ndarray
    end: np.ndarray
    share: np.ndarray

    def renamed(self, number: np.ndarray) -> Hanging:
        """The same, color i called ``number[i]``; ``number`` (colors,) int."""
        return Hanging(number[self.corner], number[self.start], number[self.end], self.share)


_NONE = np.zeros(0, int)
NOTHING = Hanging(_NONE, _NONE, _NONE, np.zeros(0))


def spread(hanging: Hanging, count: int) -> tuple[np.ndarray, csr_matrix]:
    """(free,) which of ``count`` colors hang on none, and the (count, free) matrix that makes all
    colors of them."""
    hangs = np.zeros(count, bool)
    hangs[hanging.corner] = True
    free = np.flatnonzero(~hangs)
    row = np.concatenate([hanging.corner, hanging.corner, free])
    column = np.concatenate([hanging.start, hanging.end, free])
    weight = np.concatenate([1 - hanging.share, hanging.share, np.ones(len(free))])
    step = csr_matrix((weight, (row, column)), shape=(count, count))
    product = step
    for _ in range(ROUNDS):
        if not abs(product[:, hangs]).sum() > DONE:
            break
        product = product @ step
    return free, product[:, free].tocsr()
