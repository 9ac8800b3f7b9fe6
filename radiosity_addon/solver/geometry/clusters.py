"""Clusters: labels of things that lie in one cube and face alike, and octants around means."""

from __future__ import annotations

import numpy as np

DENSE = 8  # factor [things]: where no more labels are possible, each has a place in a table, which is faster than sorting


def cubes(position: np.ndarray, size: float, corner: np.ndarray | float = 0.0) -> np.ndarray:
    """(n, 3) int64: the cube of edges ``size`` that each position (n, 3) lies in, from ``corner``."""
    return np.floor((position - corner) / size).astype(np.int64)


def facings(normal: np.ndarray) -> np.ndarray:
    """(n, 3) int64: alike for unit normals (n, 3) that point alike, about 20 different ones."""
    return np.rint(1.5 * normal).astype(np.int64)


def labels(*columns: np.ndarray) -> np.ndarray:
    """(n,) int64 from 0, without gaps: the same for things that agree in all of the integer
    ``columns``, (n,) or (n, k) each, and ascending in them, the first foremost."""
    every = np.column_stack(columns)
    if len(every) == 0:
        return np.zeros(0, np.int64)
    every = every - every.min(axis=0)
    spans = every.max(axis=0) + 1
    if np.prod(spans.astype(float)) > 2.0**62:
        return np.unique(every, axis=0, return_inverse=True)[1].reshape(-1)
    key = np.zeros(len(every), np.int64)
    for column, span in zip(every.T, spans):
        key = key * span + column
    possible = int(np.prod(spans))
    if possible <= DENSE * len(key):
        there = np.zeros(possible, bool)
        there[key] = True
        return (np.cumsum(there) - 1)[key]
    return np.unique(key, return_inverse=True)[1].reshape(-1)


def octants(position: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """(n,) int64: 8 · ``owner`` (n,) int and the octant around the mean position of the owner's."""
    number = np.maximum(np.bincount(owner), 1)
    found = owner.astype(np.int64) * 8
    for axis in range(3):
        mean = np.bincount(owner, position[:, axis]) / number
        found += (position[:, axis] > mean[owner]).astype(np.int64) << axis
    return found
