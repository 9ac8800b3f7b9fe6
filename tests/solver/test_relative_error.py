"""The error is over the surface, against a quarter of the mean at least, and 95 % of it is told."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.allocation import (
    WORST,
    lacking_at_worst,
    lacking_in_mean,
)  # fmt: skip
from radiosity_addon.solver.adaptive.error_estimator import ErrorEstimator
from radiosity_addon.solver.adaptive.estimate import BALANCE, Estimate, SmoothedLight, Surface
from radiosity_addon.solver.adaptive.relative_error import (
    area_shares,
    bound_of_most,
    mean_over,
    scale_of,
)  # fmt: skip
from radiosity_addon.solver.gather.lighting import Lighting, no_light
from radiosity_addon.solver.receivers import Projection


def estimate(radiance: np.ndarray, apart: np.ndarray, area, project=None, enough=np.inf) -> Estimate:
    """Of receivers without neighbors, white, from two halves whose radiances (n, c) are
    ``radiance`` ± ``difference`` (n, c): their mean is taken to be off by as much."""

    def half(sign: float) -> Lighting:
        light = no_light(*radiance.shape)
        light.direct[:] = np.pi * (radiance + sign * apart)
        light.points[:] = 1
        return light

    surface = Surface(np.ones(radiance.shape), np.zeros(radiance.shape), np.asarray(area, float))
    judge = ErrorEstimator(surface, [], ("direct", "color"), 1, None, project, enough=enough)
    return judge.weigh([half(1.0), half(-1.0)])


def alike(errors: np.ndarray, own: np.ndarray) -> np.ndarray:
    return np.full(len(own), errors.sum() / own.sum())


def unlimited(light: np.ndarray) -> tuple[float, float]:
    return -np.inf, np.inf


def test_halves_far_apart_are_judged_against_either():
    """Radiances 1 ± 0.9 beside a surface of 1: the halves 1.9 and 0.1, of which the second counts as
    a quarter of its mean, (3 + 0.1) / 16 = 0.194: 9.8 times less, so that the error 0.9
    is judged against both: ε² = ¼ · 0.81 · ½ (1 / 1.9² + 1 / 0.194²)."""
    found = estimate(np.ones((2, 1)), np.array([[0.0], [0.9]]), [3, 1])
    either = (1.9**-2 + (3.1 / 16) ** -2) / 2
    assert found.error == pytest.approx(np.sqrt(0.25 * 0.81 * either), rel=1e-4)


def test_a_receiver_counts_by_its_area():
    """Radiances 1 and 100, off by 0.1 and 30 (halves differ by twice that, their mean by half of the
    difference), areas 1 and 1e-6:
    ε² = (1 · 0.01 + 1e-6 · 0.09) / (1 + 1e-6), where the mean over both were 0.05."""
    found = estimate(np.array([[1.0], [100.0]]), np.array([[0.1], [30.0]]), [1, 1e-6])
    assert found.error == pytest.approx(np.sqrt((0.01 + 9e-8) / (1 + 1e-6)), rel=1e-5)
    assert found.share == pytest.approx(np.array([1, 1e-6]) / (1 + 1e-6))
    assert mean_over(found.share, found.square) == pytest.approx(found.error**2, rel=1e-5)


@pytest.mark.parametrize("scale", [1e-30, 1, 1e30])
def test_the_unit_of_area_does_not_matter(scale):
    share = area_shares(scale * np.array([1.0, 3.0]))
    assert share == pytest.approx([0.25, 0.75], rel=1e-12)


def test_nothing_has_an_area():
    assert area_shares(np.zeros(4)) == pytest.approx(np.full(4, 0.25))
    assert len(area_shares(np.zeros(0))) == 0


def test_dark_places_are_judged_against_a_quarter_of_the_mean():
    """Three quarters of the surface have (20, 5, 5), of mean 10, and one quarter 1:
    L̄ = (3 · 10 + 1) / 4 = 7.75, so that the dark are judged against 7.75 / 4 = 1.9375 and the bright
    against 10. With 2 brighter than that the dark are judged against themselves."""
    light = np.array([[20.0, 5, 5], [1, 1, 1]])
    share = np.array([0.75, 0.25])
    assert scale_of(light, share).ravel() == pytest.approx([10, 1.9375])
    assert scale_of(np.array([[20.0, 5, 5], [2, 2, 2]]), share).ravel() == pytest.approx(
        [10, max(2, (30 + 2) / 16)]
    )
    assert scale_of(np.zeros((2, 3)), share).ravel() == pytest.approx([1, 1])


def test_the_estimate_has_the_floor():
    """The surface of the test above, off by 0.5 in the bright part and by 0.155 in the dark one:
    relative 0.05 and 0.155 / 1.9375 = 0.08, ε² = 0.75 · 0.05² + 0.25 · 0.08²."""
    light, off = np.array([[20.0, 5, 5], [1, 1, 1]]), np.array([[0.5], [0.155]]) + np.zeros(3)
    found = estimate(light, off, [3, 1])
    assert found.error == pytest.approx(np.sqrt(0.75 * 0.05**2 + 0.25 * 0.08**2), rel=1e-5)
    assert found.error_95 == pytest.approx(0.08, rel=1e-5)  # a quarter is more than 5 %


def test_colors_count_by_their_area():
    """Four receivers, two colors that are the means of two each: errors 0.1 and 0.3 on areas 9 and
    1: ε² = 0.9 · 0.01 + 0.1 · 0.09 = 0.018; by number it were 0.05."""
    def mean(x):
        return x.reshape(2, 2, -1).mean(axis=1)

    project = Projection(mean, unlimited, mean, alike, np.array([9.0, 1.0]))
    off = np.array([[0.0], [0.2], [0.5], [0.1]])
    found = estimate(np.ones((4, 1)), off, [1, 1, 1, 1], project)
    assert found.error == pytest.approx(np.sqrt(0.018), rel=1e-5)
    assert found.error_95 == pytest.approx(0.3, rel=1e-5)


def test_colors_are_judged_as_they_are_shown():
    """As above, but of each two receivers the first alone is shown: errors 0 and 0.5, ε² = 0.1 · 0.25."""
    project = Projection(
        lambda x: x.reshape(2, 2, -1).mean(axis=1), unlimited, lambda x: x[::2], alike, np.array([9.0, 1.0])
    )
    off = np.array([[0.0], [0.2], [0.5], [0.1]])
    found = estimate(np.ones((4, 1)), off, [1, 1, 1, 1], project)
    assert found.error == pytest.approx(np.sqrt(0.025), rel=1e-5)


def test_colors_beyond_their_limits_are_moved_there_before_they_are_judged():
    """Receivers have 1 ± 0.1 and 1. The second color lies 100 times as far from the first receiver's light as the second
    receiver's does: it comes to -8.9 and 10.9, and is moved to 1: ε² = (0.1² + 0²) / 2. It were 7² without limits."""
    def beyond(x):
        return np.stack([x[0], x[0] + 100 * (x[1] - x[0])])

    project = Projection(beyond, lambda x: (x.min(axis=0), x.max(axis=0)), beyond, alike, np.ones(2))
    off = np.array([[0.1], [0.0]])
    found = estimate(np.ones((2, 1)), off, [1, 1], project, enough=0.0)
    assert found.error == pytest.approx(0.1 / np.sqrt(2), rel=1e-4)


@pytest.mark.parametrize(("enough", "error"), [(0.1, 0.05), (0.08, 0.05), (0.07, 0.15)])
def test_rough_colors_may_overstate_the_error_by_two(enough, error):
    """Rough colors are 1 ± 0.15, those that are shown 1 ± 0.05: up to twice of what is enough the second count."""
    def rough(x):
        mean = x.mean(axis=1, keepdims=True)
        return mean + 3 * (x - mean)

    project = Projection(rough, unlimited, lambda x: x, alike, np.ones(1))
    found = estimate(np.ones((1, 1)), np.array([[0.05]]), [1], project, enough=enough)
    assert found.error == pytest.approx(error, rel=1e-4)


@pytest.mark.parametrize(("channels", "times"), [(1, 1.960), (3, 2.388)])
def test_bound_of_a_normal_distribution(channels, times):
    """Φ(1.960) − Φ(−1.960) = 0.95; of three independent channels all are within 2.388 deviations,
    as (Φ(2.388) − Φ(−2.388))³ = 0.9831³ = 0.95. The 95 % quantile of n = 100,000 has the standard
    error sqrt(0.05 · 0.95 / n) / density, 0.6 % of it: five of them are allowed."""
    random = np.random.default_rng(0)
    off = 0.02 * random.normal(size=(100_000, channels))
    found = estimate(np.ones(off.shape), off, np.ones(len(off)))
    assert found.error_95 == pytest.approx(times * 0.02, rel=0.03)
    assert found.error == pytest.approx(0.02, rel=0.03)


def test_bound_counts_by_area():
    """Errors 1 and 100: the second counts once it has more than a twentieth of the surface."""
    errors = np.array([[1.0], [-100.0]])
    assert bound_of_most(np.array([0.96, 0.04]), errors) == 1
    assert bound_of_most(np.array([0.94, 0.06]), errors) == 100
    assert bound_of_most(np.zeros(0), np.zeros((0, 3))) == 0


def test_slivers_get_no_more_rays():
    """100 receivers of area 1 and 100 of 1e-9, with 16 rays each; the slivers are off 100 times as
    much. The best numbers are in proportion to the root of area times variance. For a squared error, of points and
    of rays, of 2 (1 + 1e-5) that may be 1, those of area 1 need 16 · 2 / (1 − 2e-5) = 32; the slivers would do with
    32 · 100 · sqrt(1e-9) = 0.1, less than they have, and keep their 2e-5 of the square."""
    area = np.repeat([1.0, 1e-9], 100)
    local = np.repeat([1.0, 1e4], 100)
    share = area_shares(area)
    error = float(np.sqrt(2 * mean_over(share, local)))
    found = Estimate(
        unit=1.0, direct=None, indirect=None, error=error, sampled=error, error_95=0.0,
        bounds=np.zeros(64), brightness=1.0,
        share=share, direct_square=local, gather_square=local, difference=None, uncertainty=(0.0, 0.0),
    )  # fmt: skip
    light = no_light(200, 1)
    light.rays[:] = light.points[:] = 16
    points, rays = lacking_in_mean(found, 1.0, light, [])
    best = 16 * 2 / (1 - 2e-5)
    assert rays[:100] == pytest.approx(np.full(100, best - 16), rel=1e-6)
    assert np.array_equal(points, rays)
    assert not rays[100:].any() and not lacking_at_worst(found, 1.0, light)[1][100:].any()


def test_places_that_are_worst_get_what_they_lack():
    """Of 100 receivers of one area 99 are off by 0.01 and one by 0.2, in the mean square 0.000499 = 0.0223²,
    which is less than a goal of 0.03. The one lacks 16 · (0.2 / (WORST · 0.03))² − 16 of each kind of samples;
    one a quarter as large may be twice as far off for as many."""
    local = np.full(100, 0.01**2)
    local[7] = 0.2**2
    light = no_light(100, 1)
    light.rays[:] = light.points[:] = 16

    def lacking(area):
        found = Estimate(
            unit=1.0, direct=None, indirect=None, error=0.02, sampled=0.02, error_95=0.0,
            bounds=np.zeros(64), brightness=1.0, share=area_shares(area),
            direct_square=local, gather_square=local, difference=None, uncertainty=(0.0, 0.0),
        )  # fmt: skip
        assert not any(part.any() for part in lacking_in_mean(found, 0.03 * np.sqrt(2), light, []))
        return lacking_at_worst(found, 0.03, light)

    area = np.ones(100)
    for samples, worst in zip(lacking(area), WORST):
        assert samples[7] == pytest.approx(16 * (0.2 / (worst * 0.03)) ** 2 - 16)
        assert not np.delete(samples, 7).any()
    area[7] = 0.25
    for samples, worst in zip(lacking(area), WORST):
        share = 0.25 * 100 / 99.25
        assert samples[7] == pytest.approx(16 * share * (0.2 / (worst * 0.03)) ** 2 - 16)


def test_noise_of_the_light_is_none_of_what_it_is_judged_against():
    """Light 1 ± noise in both halves alike, unknown to either: the error told of the difference is
    that of the mean, within 3 % (n = 40,000 values of relative deviation 0.2: 0.4 % standard
    error, and 1/L² is 1 + 3 · 0.02 in the mean where L has the deviation 0.2 / √2)."""
    random = np.random.default_rng(3)
    a, b = 1 + 0.2 * random.normal(size=(2, 40_000, 1))
    found = estimate((a + b) / 2, (a - b) / 2, np.ones(len(a)))
    assert found.error == pytest.approx(0.2 / np.sqrt(2), rel=0.05)


def test_a_bias_that_is_noise_never_takes_off_the_noise_itself():
    """Where the halves differ much places are judged against less light: errors there count more. The
    bias, measured with noise, is above 0 in the mean before that, and below after: −4 · 16 + 9 · 1 at
    half of the surface each. At least BALANCE times the noise stands in its place: 1 + 1.5 of it."""
    apart = np.full((2, 1), 0.1, np.float32)
    part = SmoothedLight(apart, apart, apart, np.array([-4.0, 9.0]), np.ones(2, bool))
    level, share = np.array([[4.0], [1.0]], np.float32), np.full(2, 0.5)
    sample, square = part.error(share, level)
    noise = (level[:, 0] * 0.1) ** 2
    assert square == pytest.approx((1 + BALANCE) * noise, rel=1e-5)
    assert mean_over(share, sample**2) == pytest.approx(mean_over(share, square), rel=1e-5)
