"""The measure of errors against references that are noisy themselves."""

import numpy as np
import pytest

from verification.error import least_measurable, reference_noise, relative_error


def test_error_by_hand():
    """Two gray receivers 3 and 0.2, of equal areas: L̄ = 1.6, so scales 3 and 0.4; off by 0.3 and
    0.08: sqrt((0.1² + 0.2²)/2). Of areas 3 and 1: L̄ = 2.3, scales 3 and 0.575, off by 0.1 and
    0.08/0.575 of them: sqrt((3 · 0.1² + (0.08/0.575)²)/4)."""
    truth = np.array([[3.0, 3, 3], [0.2, 0.2, 0.2]])
    found = truth + [[0.3], [-0.08]]
    measured = relative_error(found, truth)
    assert measured.error == pytest.approx(np.sqrt((0.01 + 0.04) / 2))
    assert measured.uncertainty == 0.0
    weighted = relative_error(found, truth, area=np.array([3.0, 1.0]))
    assert weighted.error == pytest.approx(np.sqrt((3 * 0.01 + (0.08 / 0.575) ** 2) / 4))


def test_two_noisy_references_are_unbiased_and_their_uncertainty_is_true():
    """x is 3 % off, the references 20 % each: (x−a)² would say 20 %. 200 repetitions must scatter
    about 0.03² as the stated uncertainty says; their mean lies within 4 standard errors. One bright
    receiver, without noise, lifts L̄/4 above all others: their scale is that, as good as exact."""
    random = np.random.default_rng(0)
    truth = random.uniform(0.5, 1, (4000, 1)) * np.ones(3)
    truth[0] = 40000.0
    scale = np.maximum(truth, truth.mean() / 4)
    noise = 0.2 * scale
    noise[0] = 0.0
    x = truth + 0.03 * scale
    found, stated = [], []
    for _ in range(200):
        a, b = (truth + noise * random.normal(size=(4000, 3)) for _ in range(2))
        measured = relative_error(x, a, b)
        found.append(measured.error**2)
        stated.append(2 * measured.error * measured.uncertainty)
    assert np.mean(found) == pytest.approx(0.03**2, abs=4 * np.std(found) / np.sqrt(200))
    assert np.median(stated) == pytest.approx(np.std(found), rel=0.25)


def test_noise_of_references():
    random = np.random.default_rng(1)
    a, b = (1 + 0.05 * random.normal(size=(10000, 3)) for _ in range(2))
    assert reference_noise(a, b) == pytest.approx(0.05, rel=0.03)


@pytest.mark.parametrize(
    "x, a, message",
    [
        (np.ones((2, 3)), np.ones((3, 3)), "shapes"),
        (np.ones((0, 3)), np.ones((0, 3)), "n >= 1"),
        (np.full((1, 3), np.nan), np.ones((1, 3)), "result has 3 values"),
        (np.ones((1, 3)), np.full((1, 3), np.inf), "reference a has 3 values"),
        (np.ones((1, 3)), np.zeros((1, 3)), "black"),
    ],
)
def test_error_refuses(x, a, message):
    with pytest.raises(ValueError, match=message):
        relative_error(x, a)


def test_noisy_references_find_an_error_where_there_is_none():
    """Light that is exact, beside references that are 15 % off: what is found is the noise of what they are divided by."""
    truth = np.ones((400_000, 1))
    a, b = truth + np.random.default_rng(5).normal(0, 0.15, (2, *truth.shape))
    found = relative_error(truth, a, b)
    expected = least_measurable(reference_noise(a, b))
    assert found.error == pytest.approx(expected, rel=0.15)  # what is left out is of higher order
    assert expected > 10 * found.uncertainty
