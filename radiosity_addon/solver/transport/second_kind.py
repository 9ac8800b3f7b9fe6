"""Second-kind equations x − T x = s, solved by a Krylov method.

Galerkin's method turns the radiosity equation, and any other Fredholm equation of the second kind,
into such a system. T is only ever applied. The plain iteration x ← s + T x needs about
18 / (1 − ‖T‖) applications for eight digits; GMRES (Saad and Schultz 1986) minimizes the residual
over all polynomials in T of the same degree and needs tens, because transport smooths: only a few
of its eigenvalues lie near 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Operator = Callable[[np.ndarray], np.ndarray]

BASIS_BYTES = 1_500_000_000  # memory [bytes] of Krylov vectors: bounds their number
BASIS_RANGE = (20, 200)  # numbers [Krylov vectors] between restarts, at least and at most
OVERHEAD = 3  # number [applications of T] of a cycle beside those of the basis: GMRES' own check, sweep, residual
ROUND_OFF = np.finfo(np.float64).eps  # difference [relative] between neighboring float64 numbers
STALLED = 0.9  # ratio [of residuals after and before a cycle]: above it round-off keeps the residual from falling


@dataclass(frozen=True)
class SecondKindSolution:
    """``solution``: shaped as the source, float64. ``iterations``: applications of T, all of them.
    ``residual``: ‖s + T x − x‖ / ‖s‖ of exactly this solution, round-off included, the largest
    over the channels."""

    solution: np.ndarray
    iterations: int
    residual: float


def solve_second_kind(
    apply: Operator,
    source: np.ndarray,
    tolerance: float = 1e-8,
    max_iterations: int = 200,
    nonnegative: bool = True,
) -> SecondKindSolution:
    """Solve x − T x = s to a relative residual, in the 2-norm and for every channel.

    ``source``: s, (n,) or (n, channels) float64. ``apply``: maps such an array to T of it and may
    keep no reference to it. ``max_iterations`` caps the applications of T. With ``nonnegative``
    T and s are promised to be ≥ 0, and so is the result: it ends with a sweep x ← s + T max(x, 0).
    If the cap, or round-off, stops the solve early, ``residual`` tells: it is never assumed.

    Raises ValueError for a source that is empty, not finite, or negative against the promise, for
    a tolerance outside (0, 1) or a cap below 1; ArithmeticError where T yields non-finite values.
    """
    source = np.asarray(source, dtype=np.float64)
    _check(source, tolerance, max_iterations, nonnegative)
    columns = source.reshape(len(source), -1)
    peak = np.abs(columns).max(axis=0)
    if not peak.any():
        return SecondKindSolution(np.zeros_like(source), 0, 0.0)
    # Every channel scaled to norm 1: one solve then bounds each channel's own relative residual.
    with np.errstate(under="ignore"):  # what underflows beside 1 is nothing
        unit = columns / np.where(peak > 0, peak, 1.0)
        norm = np.linalg.norm(unit, axis=0)
        unit /= np.where(peak > 0, norm, 1.0)
        operator = _Counted(apply, source.shape)
        unit, residual = _cycles(operator, unit, tolerance, max_iterations, nonnegative)
        solution = (unit * norm * peak).reshape(source.shape)
    return SecondKindSolution(solution, operator.count, residual)


class _Counted:
    """T on (n, channels) arrays: reshaped to what the caller wrote it for, counted, checked."""

    def __init__(self, apply: Operator, shape: tuple[int, ...]) -> None:
        self.apply = apply
        self.shape = shape
        self.count = 0

    def __call__(self, x: np.ndarray) -> np.ndarray:
        self.count += 1
        image = np.asarray(self.apply(x.reshape(self.shape)), dtype=np.float64)
        if image.shape != self.shape:
            raise ValueError(
                f"the operator maps shape {self.shape} to {image.shape}; it must keep the shape"
            )
        if not np.isfinite(image).all():
            raise ArithmeticError(
                "the transport operator returned a value that is not finite; "
                "check reflectances and form factors"
            )
        return image.reshape(len(image), -1)


def _cycles(
    operator: _Counted, source: np.ndarray, tolerance: float, cap: int, nonnegative: bool
) -> tuple[np.ndarray, float]:
    """Restarted GMRES on the correction; every cycle starts from a measured residual."""
    solution, defect = source, operator(source)  # x = s has the residual T s
    residual = _worst(defect, solution)
    basis = int(np.clip(BASIS_BYTES // (8 * source.size), *BASIS_RANGE))
    while residual > tolerance and operator.count + OVERHEAD < cap:
        basis = min(basis, cap - OVERHEAD - operator.count)
        step = solution + _correction(operator, defect, basis, max(0.5 * tolerance, ROUND_OFF))
        if nonnegative:
            step = source + operator(np.maximum(step, 0.0))
        defect = source + operator(step) - step
        previous, residual = residual, _worst(defect, step)
        if residual < previous:
            solution = step
        if residual > STALLED * previous:
            return solution, min(residual, previous)
    return solution, residual


def _correction(
    operator: _Counted, defect: np.ndarray, basis: int, tolerance: float
) -> np.ndarray:
    """One cycle of GMRES for d − T d = defect, to an absolute 2-norm over all channels."""
    from scipy.sparse.linalg import LinearOperator, gmres

    def matvec(flat: np.ndarray) -> np.ndarray:
        x = flat.reshape(defect.shape)
        return (x - operator(x)).ravel()

    size = defect.size
    system = LinearOperator((size, size), matvec=matvec, dtype=np.float64)
    step, _ = gmres(system, defect.ravel(), rtol=0.0, atol=tolerance, restart=basis, maxiter=1)
    return step.reshape(defect.shape)


def _worst(defect: np.ndarray, solution: np.ndarray) -> float:
    """Largest 2-norm of the residual over the channels, both (n, channels), source of norm 1.

    Never below the round-off of a residual made from numbers as large as the solution: where T
    has the eigenvalue 1, x grows until s is lost beside it and the plain residual would be 0.
    """
    floor = ROUND_OFF * np.linalg.norm(solution, axis=0)
    return float(np.maximum(np.linalg.norm(defect, axis=0), floor).max())


def _check(source: np.ndarray, tolerance: float, cap: int, nonnegative: bool) -> None:
    if source.ndim not in (1, 2) or source.size == 0:
        raise ValueError(f"source has shape {source.shape}; give (n,) or (n, channels), n >= 1")
    if not np.isfinite(source).all():
        count = int((~np.isfinite(source)).sum())
        raise ValueError(f"source has {count} values that are not finite; leave those faces out")
    if nonnegative and source.min() < 0.0:
        raise ValueError(
            f"source has the negative value {source.min():.3g}; "
            "light is >= 0 (pass nonnegative=False for other equations)"
        )
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"tolerance is {tolerance}; it must lie between 0 and 1")
    if cap < 1:
        raise ValueError(f"max_iterations is {cap}; at least 1 is needed")
