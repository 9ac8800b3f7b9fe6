"""Ragged: ranges of different lengths, one after the other."""

from __future__ import annotations

import numpy as np


def ragged_ranges(count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(owner, offset), int each and as long as the sum of ``count`` (n,): every owner i, and with it the offsets from
    0 to ``count[i]`` - 1."""
    owner = np.repeat(np.arange(len(count)), count)
    begin = np.cumsum(count) - count
    return owner, np.arange(len(owner)) - begin[owner]
