"""Warps: places in the unit square of a density that is known at its corners."""

from __future__ import annotations

import numpy as np


def sample_linear(first: np.ndarray, last: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """(...) in [0, 1], of a density that goes linearly from ``first`` to ``last``, both >= 0."""
    first, last = np.maximum(first, 0), np.maximum(last, 0)
    root = first + np.sqrt(first * first + xi * ((last - first) * (last + first)))
    return np.minimum(xi * (first + last) / np.maximum(root, 1e-30), 1)


def sample_bilinear(
    corners: np.ndarray, s: np.ndarray, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(s, t) (..., k) in the unit square of a density bilinear between its ``corners`` (4, k), at
    (0, 0), (1, 0), (0, 1) and (1, 1), from uniform ones: by s, then by t given s (Hart, Pharr et
    al. 2020, "Practical Product Sampling by Fitting and Composing Warps", section 4.1)."""
    a, b, c, d = corners
    s = sample_linear(a + c, b + d, s)
    return s, sample_linear(a + s * (b - a), c + s * (d - c), t)


def bilinear_pdf(corners: np.ndarray, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """(..., k) density of ``sample_bilinear`` at (s, t), mean 1."""
    a, b, c, d = corners
    low, high = a + s * (b - a), c + s * (d - c)
    return np.maximum((low + t * (high - low)) / np.maximum((a + b + c + d) / 4, 1e-30), 1e-30)
