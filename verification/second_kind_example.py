"""The smallest equation of our kind, solved by the solver that lights the scenes.

    y(x) = x³/6 + 5x/6 + 4 ∫₀¹ k(x,t) y(t) dt,    k = t(1−x) for t < x, x(1−t) for t > x

has the solution y = x/4 + 3 sin 2x / (4 sin 2): differentiate twice, y'' = x − 4y, y(0) = 0,
y(1) = 1. k is Green's function of −d²/dx²; the largest eigenvalue of 4k is 4/π². Galerkin's method
with piecewise constants on n equal elements, all integrals exact, and Sloan's iterate (Sloan 1976).

``python -m verification.second_kind_example`` draws docs/figures/second_kind.png (matplotlib).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from radiosity_addon.solver.transport.second_kind import SecondKindSolution, solve_second_kind

FIGURE = Path(__file__).resolve().parent.parent / "docs" / "figures" / "second_kind.png"
SIZES = (4, 8, 16, 32, 64, 128, 256)


def exact(x: np.ndarray) -> np.ndarray:
    """y at the points x."""
    return x / 4 + 3 * np.sin(2 * x) / (4 * np.sin(2))


def source(x: np.ndarray) -> np.ndarray:
    """s at the points x."""
    return x**3 / 6 + 5 * x / 6


def galerkin(n: int) -> tuple[np.ndarray, np.ndarray]:
    """The matrix (n, n) of element means of 4k, 4/h ∫ᵢ∫ⱼ k, and the means (n,) of the source.

    Off the diagonal k is a product of linear functions, whose mean is their value at the middle;
    on it the double integral over [a, a+h]² is h²(a − a²) + h³(1/3 − a) − h⁴/4.
    """
    h = 1.0 / n
    middle = (np.arange(n) + 0.5) * h
    matrix = h * np.minimum.outer(middle, middle) * (1 - np.maximum.outer(middle, middle))
    start = middle - h / 2
    np.fill_diagonal(matrix, h * (start - start**2) + h**2 * (1 / 3 - start) - h**3 / 4)
    return 4 * matrix, source(middle) + middle * h**2 / 24  # the mean of x³ is m³ + m h²/4


def solve(n: int, tolerance: float = 1e-12) -> SecondKindSolution:
    """The piecewise-constant solution on n elements.

    With twice as many its error is half as large, and its iterate's a quarter:

    >>> few, many = np.array(errors(16)), np.array(errors(32))
    >>> np.round(few / many, 1).tolist()
    [2.0, 4.0]
    """
    matrix, means = galerkin(n)
    return solve_second_kind(lambda y: matrix @ y, means, tolerance)


def iterate(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Sloan's iterate s + 4 ∫ k(x,t) y_h(t) dt at points x in [0, 1], integrated exactly.

    ∫ k y_h = (1−x) P(x) + x (Q(1) − Q(x)), P and Q the primitives of t y_h and (1−t) y_h.
    """
    n = len(y)
    edges = np.arange(n + 1) / n
    element = np.minimum((x * n).astype(int), n - 1)

    def primitive(power):
        integral = np.concatenate([[0.0], np.cumsum(y * np.diff(power(edges)))])
        return integral[element] + y[element] * (power(x) - power(edges[element])), integral[-1]

    below, _ = primitive(lambda t: t**2 / 2)
    above, total = primitive(lambda t: t - t**2 / 2)
    return source(x) + 4 * ((1 - x) * below + x * (total - above))


def errors(n: int) -> tuple[float, float]:
    """L² errors over [0, 1] of the solution on n elements and of its iterate (4 Gauss points)."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = ((np.arange(n)[:, None] + 0.5 + nodes / 2) / n).ravel()
    weight = np.tile(weights / 2 / n, n)
    y = solve(n).solution
    pair = np.repeat(y, 4) - exact(x), iterate(y, x) - exact(x)
    return tuple(float(np.sqrt(weight @ defect**2)) for defect in pair)


def fitted_slopes(sizes=SIZES) -> tuple[float, float]:
    """Slopes of log error against log n, for the solution and its iterate."""
    table = np.log([errors(n) for n in sizes])
    return tuple(float(slope) for slope in np.polyfit(np.log(sizes), table, 1)[0])


def draw(path: Path = FIGURE) -> None:
    """The solution on eight elements with its iterate, and how both converge."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")
    x, y = np.linspace(0, 1, 401), solve(8).solution
    left.stairs(y, np.linspace(0, 1, 9), baseline=None, label="Galerkin, 8 elements")
    left.plot(x, iterate(y, x), color="tab:orange", lw=3, label="its iterate")
    left.plot(x, exact(x), "k--", lw=1, label="exact")
    left.set(xlabel="x", ylabel="y")
    left.legend()
    table, slopes = np.array([errors(n) for n in SIZES]), fitted_slopes()
    for column, (name, color) in enumerate((("solution", "tab:blue"), ("iterate", "tab:orange"))):
        label = f"{name}, slope {slopes[column]:.2f}"
        right.loglog(SIZES, table[:, column], "o-", color=color, label=label)
    right.set(xlabel="elements n = 1/h", ylabel="L² error")
    right.grid(True, which="both", alpha=0.3)
    right.legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == "__main__":
    draw()
    print("slopes of log error against log n: {:.3f} and {:.3f}".format(*fitted_slopes()))
