"""The second-kind solver on operators whose answers are known without it."""

import numpy as np
import pytest

from radiosity_addon.solver.transport.second_kind import solve_second_kind


def room(n=300, seed=0):
    """A closed scene in one piece: reciprocal form factors G/A, rows summing to 1."""
    random = np.random.default_rng(seed)
    exchange = random.uniform(0.0, 1.0, (n, n)) ** 4
    exchange = exchange + exchange.T
    return exchange / exchange.sum(axis=1, keepdims=True)


def two_rooms(n=300, door=1e-3):
    """Two closed rooms joined by a small door: a second eigenvalue close to 1."""
    factors = np.zeros((n, n))
    half = n // 2
    factors[:half, :half] = (1 - door) * room(half, 1)
    factors[half:, half:] = (1 - door) * room(n - half, 2)
    factors[:half, half:] = door / (n - half)
    factors[half:, :half] = door / half
    return factors


def tunnel(n=300, reach=10.0):
    """A long tunnel, every element sees some ten others either way: eigenvalues crowd near 1."""
    place = np.arange(n)
    factors = np.exp(-np.abs(place[:, None] - place[None, :]) / reach)
    return factors / factors.sum(axis=1, keepdims=True)


SCENES = {"room": room, "two_rooms": two_rooms, "tunnel": tunnel}


def one_lamp(n):
    source = np.zeros(n)
    source[0] = 1.0
    return source


# The applications the project allows itself, to a relative residual of 1e-8. The plain iteration
# would need ln(1e-8) / ln(reflectance): 1833 at 0.99, 18,411 at 0.999.
@pytest.mark.parametrize("reflectance, allowed", [(0.5, 30), (0.9, 60), (0.99, 60), (0.999, 200)])
@pytest.mark.parametrize("name", SCENES)
def test_reaches_eight_digits_in_few_applications(name, reflectance, allowed):
    factors = SCENES[name]()
    source = one_lamp(len(factors))
    result = solve_second_kind(lambda x: reflectance * (factors @ x), source, 1e-8)
    assert result.iterations <= allowed
    defect = source + reflectance * (factors @ result.solution) - result.solution
    assert np.linalg.norm(defect) <= 1e-8 * np.linalg.norm(source)
    assert result.residual == pytest.approx(np.linalg.norm(defect), rel=1e-6, abs=1e-15)
    assert result.solution.min() >= 0.0


@pytest.mark.parametrize("name", SCENES)
def test_reflectance_a_millionth_below_one(name):
    """Furnace: s = 1 − ρ gives x = 1. The residual r leaves an error of at most
    ‖r‖ / (1 − ρ) ≤ 1e-10 · ‖s‖ / 1e-6, that is 1e-10 of √n: 1e-8 is asked with a margin."""
    reflectance = 1 - 1e-6
    factors = SCENES[name]()
    source = np.full(len(factors), 1 - reflectance)
    result = solve_second_kind(lambda x: reflectance * (factors @ x), source, 1e-10)
    assert result.iterations <= 200
    np.testing.assert_allclose(result.solution, 1.0, atol=1e-8)


def test_a_lamp_in_a_room_that_absorbs_a_millionth_keeps_its_energy():
    """Symmetric F: summing x = s + ρ F x over equal areas gives Σ s = (1 − ρ) Σ x, so Σ x = 1e6.
    Round-off in x, 1e6 times the source, bounds the residual at some 1e-10."""
    n, reflectance = 300, 1 - 1e-6
    factors = np.full((n, n), 1.0 / n)
    source = one_lamp(n)
    result = solve_second_kind(lambda x: reflectance * (factors @ x), source, 1e-9)
    assert result.solution.sum() == pytest.approx(1e6, rel=1e-6)


@pytest.mark.parametrize("name", SCENES)
def test_agrees_with_a_direct_solve(name):
    factors = SCENES[name](80)
    source = np.random.default_rng(3).uniform(0, 1, (80, 3))
    reflectance = np.random.default_rng(4).uniform(0, 0.9, (80, 3))
    result = solve_second_kind(lambda x: reflectance * (factors @ x), source, 1e-12)
    for channel in range(3):
        matrix = np.eye(80) - reflectance[:, channel, None] * factors
        exact = np.linalg.solve(matrix, source[:, channel])
        # ‖(I − T)⁻¹‖ ≤ 10 in the maximum norm, ‖s‖₂ ≤ √80
        np.testing.assert_allclose(result.solution[:, channel], exact, atol=1e-12 * 10 * 9)


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1.0, 1e30, 1e300])
def test_scaling_the_source_scales_the_result(scale):
    factors = room(100)
    source = np.random.default_rng(5).uniform(0.1, 1, (100, 3))
    with np.errstate(all="raise"):
        unit = solve_second_kind(lambda x: 0.9 * (factors @ x), source)
        scaled = solve_second_kind(lambda x: 0.9 * (factors @ x), source * scale)
    assert scaled.iterations == unit.iterations
    np.testing.assert_allclose(scaled.solution, unit.solution * scale, rtol=1e-12)


def test_every_channel_meets_the_tolerance_however_dim():
    """Channels 1e30 and 1e-30 bright, one black: each is judged against its own source."""
    factors = two_rooms(100)
    source = np.zeros((100, 3))
    source[0] = [1e30, 1e-30, 0.0]
    with np.errstate(all="raise"):
        result = solve_second_kind(lambda x: 0.99 * (factors @ x), source, 1e-8)
    defect = source + 0.99 * (factors @ result.solution) - result.solution
    assert np.linalg.norm(defect[:, 0]) <= 1e-8 * 1e30
    assert np.linalg.norm(defect[:, 1]) <= 1e-8 * 1e-30
    assert (result.solution[:, 2] == 0.0).all()


def test_bright_and_dim_emitters_in_one_channel():
    """A closed room lit by 1e30 and by 1e-30: the dim lamp is not lost to an overflow."""
    factors = room(50)
    source = np.full(50, 1e-30)
    source[0] = 1e30
    with np.errstate(all="raise"):
        result = solve_second_kind(lambda x: 0.5 * (factors @ x), source)
    assert np.isfinite(result.solution).all() and result.solution.min() >= 1e-30


def test_dark_scene_needs_no_application():
    result = solve_second_kind(lambda x: x, np.zeros((4, 3)))
    assert (result.iterations, result.residual) == (0, 0.0)
    assert (result.solution == 0.0).all()


def test_black_surfaces_need_one_application():
    source = np.arange(6.0).reshape(2, 3)
    result = solve_second_kind(lambda x: 0.0 * x, source)
    assert result.iterations == 1 and result.residual <= 1e-15
    np.testing.assert_allclose(result.solution, source, rtol=1e-15)


def test_one_unknown():
    """x = 1 + x/2 is 2."""
    with np.errstate(all="raise"):
        result = solve_second_kind(lambda x: 0.5 * x, np.ones(1))
    assert result.solution[0] == pytest.approx(2.0, abs=1e-8)


def test_operator_of_norm_above_one():
    """x − 3 F x = s with F = 1/n has x = s + 3 mean(s) / (1 − 3): the plain series diverges."""
    n = 40
    source = np.linspace(0.0, 1.0, n)
    result = solve_second_kind(
        lambda x: np.full(n, 3 * x.mean()), source, 1e-12, nonnegative=False
    )
    np.testing.assert_allclose(result.solution, source - 1.5 * source.mean(), atol=1e-10)


@pytest.mark.parametrize("cap", [1, 2, 4, 5, 8])
def test_the_cap_holds_and_the_residual_is_true(cap):
    factors = tunnel()
    source = one_lamp(len(factors))
    result = solve_second_kind(lambda x: 0.999 * (factors @ x), source, 1e-8, cap)
    assert result.iterations <= cap
    defect = source + 0.999 * (factors @ result.solution) - result.solution
    assert result.residual == pytest.approx(np.linalg.norm(defect), rel=1e-9)
    assert result.residual > 1e-8
    assert result.solution.min() >= 0.0


def test_no_steady_state_is_told_by_the_residual():
    """ρ = 1 in a closed scene with emission: I − T is singular, s is not in its range. Summing
    the equation gives Σ r = Σ s = 1 whatever x is: no iteration may claim to have converged, also
    not once x has grown to 1e14 and s is lost in its round-off."""
    n = 50
    result = solve_second_kind(lambda x: np.full(n, x.mean()), one_lamp(n), 1e-8, 200)
    assert result.iterations <= 200
    assert result.residual > 0.1  # the least ‖r‖₂ with Σ r = 1 is 1/√50 = 0.14


def test_stops_where_round_off_allows_no_more():
    factors = room(100)
    result = solve_second_kind(lambda x: 0.999 * (factors @ x), one_lamp(100), 1e-17, 1000)
    assert result.iterations < 300  # of the 1000 allowed
    assert 1e-17 < result.residual < 1e-11


def test_the_same_twice():
    factors, source = two_rooms(), np.random.default_rng(6).uniform(0, 1, (300, 3))
    first, second = (
        solve_second_kind(lambda x: 0.99 * (factors @ x), source) for _ in range(2)
    )
    assert np.array_equal(first.solution, second.solution)


def test_long_source_keeps_the_basis_in_memory():
    """200,000 unknowns in three channels; a sparse ring of neighbors as transport."""
    n = 200_000
    source = np.zeros((n, 3))
    source[::1000] = 1.0
    result = solve_second_kind(
        lambda x: 0.45 * (np.roll(x, 1, axis=0) + np.roll(x, -1, axis=0)), source, 1e-4
    )
    assert result.residual <= 1e-4
    # every neighbor pair passes on 0.9 of what it gets: the sum is that of the sources times 10
    assert result.solution.sum() == pytest.approx(source.sum() * 10, rel=1e-3)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"source": np.array([1.0, np.nan])}, "not finite"),
        ({"source": np.array([1.0, -2.0])}, "negative value -2"),
        ({"source": np.zeros(0)}, r"shape \(0,\)"),
        ({"source": np.zeros((2, 2, 2))}, r"shape \(2, 2, 2\)"),
        ({"tolerance": 0.0}, "tolerance is 0.0"),
        ({"max_iterations": 0}, "max_iterations is 0"),
        ({"apply": lambda x: x[:1]}, "must keep the shape"),
    ],
)
def test_bad_input_is_named(change, message):
    arguments = {"apply": lambda x: 0.5 * x, "source": np.ones(2)} | change
    with pytest.raises(ValueError, match=message):
        solve_second_kind(**arguments)


def test_operator_that_yields_nan():
    with pytest.raises(ArithmeticError, match="not finite"):
        solve_second_kind(lambda x: x * np.nan, np.ones(3))
