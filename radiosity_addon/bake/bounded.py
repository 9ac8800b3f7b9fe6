"""Least squares within bounds, for sparse normal equations. NumPy and SciPy only."""

from __future__ import annotations

import logging

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import cg

# Residuals [relative, the diagonal scaled to 1]: at the end, and in between.
TOLERANCE, ROUGH = 1e-8, 1e-2
ITERATIONS = 1000  # number [iterations] of a solve, at most
ROUNDS = 12  # number [rounds] of solving for what is free, and of choosing that anew, at most

log = logging.getLogger(__name__)


def solve_bounded(
    matrix: csr_matrix, right: np.ndarray, guess: np.ndarray, low: np.ndarray, high: np.ndarray,
    tolerance: float = TOLERANCE, rounds: int = ROUNDS,
) -> np.ndarray:
    """x (n,) float64 that about minimizes ½ xᵀMx − bᵀx for ``low`` <= x <= ``high`` (n,). M is the symmetric,
    semi-definite ``matrix`` (n, n), b is ``right`` (n,).

    Unknowns that leave their bounds are fixed there, those that M x − b draws inward are set free again, and the free ones are
    solved for, a few times (primal-dual active sets; Hintermüller, Ito and Kunisch 2003, "The primal-dual active set
    strategy as a semismooth Newton method"). Of these results, moved into the bounds, the one of the least value is taken: the exact
    minimum where the sets come to rest. Where M's diagonal is 0, x stays at ``guess`` (n,).
    """
    best = x = np.clip(guess, low, high)
    least, free = np.inf, (low < high) & (matrix.diagonal() > 0)
    determined = free
    for _ in range(rounds):
        if free.any():
            x = x.copy()
            x[free] = _solve(matrix, right, x, free, tolerance)
        inside = np.clip(x, low, high)
        value = inside @ (matrix @ inside / 2 - right)
        if value < least:
            best, least = inside, value
        slope = matrix @ x - right
        inward = np.where(x <= low, slope < 0, slope > 0)
        now = determined & np.where(free, x == inside, inward)
        if np.array_equal(now, free):
            break
        x, free = inside, now
    return best


def solve_roughly(matrix: csr_matrix, right: np.ndarray) -> np.ndarray:
    """x (n,) float64 that minimizes ½ xᵀMx − bᵀx to a hundredth, without bounds: linear in b, which is
    ``right`` (n,). What M, the ``matrix`` (n, n), does not determine is 0."""
    x, free = np.zeros(len(right)), matrix.diagonal() > 0
    if free.any():
        x[free] = _solve(matrix, right, x, free, ROUGH)
    return x


def _solve(matrix, right, x, free, tolerance: float) -> np.ndarray:
    """Conjugate gradients on the free unknowns, the others kept; diagonal scaled to 1."""
    rest = right - matrix @ x
    inner = matrix if free.all() else matrix[free][:, free]
    scale = 1 / np.sqrt(inner.diagonal())
    rows = np.repeat(scale, np.diff(inner.indptr))
    scaled = csr_matrix(
        (inner.data * rows * scale[inner.indices], inner.indices, inner.indptr), inner.shape
    )
    start = x[free] / scale
    size = max(np.linalg.norm(right[free] * scale), np.linalg.norm(rest[free] * scale))
    step, failed = cg(
        scaled, rest[free] * scale, rtol=0.0, atol=tolerance * size, maxiter=ITERATIONS
    )
    if failed:
        log.warning("fit of colors: conjugate gradients stopped after %d iterations", ITERATIONS)
    return (start + step) * scale
