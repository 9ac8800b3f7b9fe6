"""The 1-D example: Galerkin converges at rate h, its iterate at h², by the scenes' solver."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from verification.second_kind_example import (
    errors,
    exact,
    fitted_slopes,
    galerkin,
    iterate,
    solve,
    source,
)


def kernel(x, t):
    return t * (1 - x) if t < x else x * (1 - t)


def integral(function, x):
    """∫₀¹ k(x,t) f(t) dt by adaptive quadrature, split at the kink."""
    below = quad(lambda t: kernel(x, t) * function(t), 0, x, epsabs=1e-13)[0]
    return below + quad(lambda t: kernel(x, t) * function(t), x, 1, epsabs=1e-13)[0]


@pytest.mark.parametrize("x", [0.0, 0.1, 0.5, 0.77, 1.0])
def test_the_exact_solution_satisfies_the_equation(x):
    assert exact(x) == pytest.approx(source(x) + 4 * integral(exact, x), abs=1e-12)


def test_matrix_and_source_are_the_element_means():
    n = 3
    matrix, means = galerkin(n)
    for i in range(n):
        low, high = i / n, (i + 1) / n
        assert means[i] == pytest.approx(n * quad(source, low, high)[0], abs=1e-13)
        for j in range(n):
            if i != j:
                value = dblquad(kernel, j / n, (j + 1) / n, low, high)[0]
            else:  # twice the triangle t < x, where k is smooth
                value = 2 * dblquad(lambda t, x: t * (1 - x), low, high, low, lambda x: x)[0]
            assert matrix[i, j] == pytest.approx(4 * n * value, abs=1e-12)


def test_iterate_integrates_exactly():
    y = np.array([1.0, 0.5, 2.0])
    for x in (0.0, 0.2, 1 / 3, 0.6, 1.0):
        parts = [
            y[j] * quad(lambda t: kernel(x, t), j / 3, (j + 1) / 3, points=[x])[0] for j in range(3)
        ]
        expected = source(x) + 4 * sum(parts)
        assert iterate(y, np.array([x]))[0] == pytest.approx(expected, abs=1e-12)


def test_fitted_slopes():
    """Piecewise constants approximate a smooth y to O(h); the iterate gains a power of h because
    T maps the error, orthogonal to the constants, to O(h²) (Sloan 1976)."""
    solution, iterated = fitted_slopes()
    assert solution == pytest.approx(-1.0, abs=0.1)
    assert iterated == pytest.approx(-2.0, abs=0.2)


def test_error_is_that_of_the_best_constants():
    """To leading order ‖y − y_h‖ = h/√12 ‖y'‖, the distance to the element means."""
    slope = quad(lambda x: (0.25 + 1.5 * np.cos(2 * x) / np.sin(2)) ** 2, 0, 1)[0] ** 0.5
    assert errors(128)[0] == pytest.approx(slope / 128 / np.sqrt(12), rel=1e-2)


def test_few_applications():
    """Eigenvalues 4/(π k)² fall fast: GMRES needs no more for more elements."""
    assert solve(512).iterations <= 20
