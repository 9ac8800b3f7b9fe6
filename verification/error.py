"""The relative error of a bake, against the truth or against two noisy references. NumPy only.

docs/theory.md section 8 derives both. It is written here a second time, apart from the solver's
own, on purpose. Colors are (n, channels); a reference may hold NaN nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FLOOR = 0.25  # of the mean brightness: darker places are judged against that much


@dataclass(frozen=True)
class Measured:
    """``error``: the relative error; ``uncertainty``: its standard error, from the references'
    noise alone. Where noise makes the squared error negative, ``error`` is 0."""

    error: float
    uncertainty: float

    def __str__(self) -> str:
        return f"{100 * self.error:.2f} % ± {100 * self.uncertainty:.2f}"


def relative_error(
    x: np.ndarray, a: np.ndarray, b: np.ndarray | None = None, area: np.ndarray | None = None
) -> Measured:
    """Local relative RMS error over the surface of x (n, channels) against references a and b.

    sqrt(mean((x−a)(x−b) / max(L, L̄/4)²)), L the mean of a receiver's channels in the references and
    L̄ the mean of L; means over receivers are by their ``area`` (n,), None: all alike. For an exact
    solution leave b out. Unbiased but for the noise in L, of second order: good references (1 %)
    make it negligible (``least_measurable``). Raises ValueError on shapes that differ, nothing to compare, values that are
    not finite, or a black reference.
    """
    b = a if b is None else b
    x, a, b = (np.asarray(array, float) for array in (x, a, b))
    if not x.shape == a.shape == b.shape or x.ndim != 2 or x.size == 0:
        raise ValueError(
            f"shapes {x.shape}, {a.shape}, {b.shape}; give equal (n, channels) with n >= 1"
        )
    for name, array in (("result", x), ("reference a", a), ("reference b", b)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} has {(~np.isfinite(array)).sum()} values that are not finite")
    area = np.ones(len(x)) if area is None else np.asarray(area, float)
    share = area / area.sum()
    light = (a + b).mean(axis=1) / 2
    if not share @ light > 0:
        raise ValueError("the reference is black; a relative error needs light")
    scale, squares = local_squares(x, a, b, float(share @ light))
    error = float(np.sqrt(max(share @ squares, 0.0)))
    noise = 0.0 if a is b else _noise(x, a, b, scale, share)
    return Measured(error, noise / (2 * error) if error > 0 else float(np.sqrt(noise)))


def local_squares(x: np.ndarray, a: np.ndarray, b: np.ndarray, mean: float):
    """(n, 1) what errors are relative to, max(L, L̄/4) with L̄ the ``mean`` brightness of the surface, and
    (n,) squared relative errors, means over channels, in which independent noise of a and b has no part."""
    scale = np.maximum((a + b).mean(axis=1) / 2, FLOOR * mean)[:, None]
    return scale, ((x - a) * (x - b) / scale**2).mean(axis=1)


def _noise(x, a, b, scale, share) -> float:
    """Standard error of the mean of (x−a)(x−b)/scale² that the references' noise causes.

    With α, β the noises of variance σ² and d = x − t a receiver's term is d² − d(α+β) + αβ, of
    variance 2d²σ² + σ⁴. For Gaussian noise α−β is independent of α+β, so the square of
    (x − (a+b)/2)(a−b) has the mean (d² + σ²/2) 2σ²: the same. Channels of one receiver share their
    noise and are averaged first; receivers are independent.
    """
    product = ((x - (a + b) / 2) * (a - b) / scale**2).mean(axis=1)
    return float(np.linalg.norm(share * product))


def reference_noise(a: np.ndarray, b: np.ndarray) -> float:
    """The relative error of one of two references of equal quality: ε² = mean((a−b)²) / 2."""
    scale = np.maximum((light := (a + b).mean(axis=1) / 2), FLOOR * light.mean())[:, None]
    return float(np.sqrt((((a - b) / scale) ** 2).mean() / 2))


def least_measurable(noise: float) -> float:
    """The error that ``relative_error`` finds where there is none, against references of this relative ``noise``, which
    are divided by their own brightness. With noises α, β of variance σ² its square is E[αβ (1 + (α+β)/2)⁻²], which
    is E[αβ · 3/4 (α+β)²] = 3/2 σ⁴ to the lowest order."""
    return float(np.sqrt(1.5) * noise**2)
