"""What rounds decide by: errors that no rays lower, and what elements get wrong alike in both replicates."""

import time
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.allocation import (
    SURE_RAYS,
    bundled,
    lacking_where_outstanding,
    total,
)
from radiosity_addon.solver.adaptive.clock import Clock
from radiosity_addon.solver.adaptive.estimate import Estimate, uncertainty_of
from radiosity_addon.solver.adaptive.plan import MOST_ELEMENTS, make_plan
from radiosity_addon.solver.adaptive.round_result import RoundResult
from radiosity_addon.solver.adaptive.rounds import Past, Rounds, least_error_of
from radiosity_addon.solver.gather.lighting import no_light
from radiosity_addon.solver.sampling.guide import start_learning

SIZES = np.array([0.6, 1.35])  # of the replicates' numbers of elements


def estimate(difference, error=0.01) -> Estimate:
    """Of receivers alike in area, whose replicates have a half ``difference`` (n,)."""
    n = len(difference)
    share, none = np.full(n, 1 / n), np.zeros((n, 1), np.float32)
    difference = np.asarray(difference, np.float32)[:, None]
    return Estimate(
        1.0, none, none, error, error, error, np.zeros(64), 1.0, share, none[:, 0], difference[:, 0] ** 2, difference,
        (0.0, uncertainty_of(share, difference)),
    )


@pytest.mark.parametrize("bias", [0.001, 0.02])
def test_a_bias_that_falls_with_the_elements_is_told_from_the_replicates_difference(bias):
    """Biases in proportion to the elements' area, which is 1 / their number: half of what the
    replicates differ by is in the estimate, and after it the bias of their mean."""
    each = bias / SIZES
    half = abs(each[0] - each[1]) / 2
    found = estimate(np.full(8, half), half).with_common(half, 1.0)
    assert found.error == pytest.approx(each.mean(), rel=0.01)
    assert found.common == pytest.approx(each.mean(), rel=0.01)


def test_where_no_ray_meets_an_element_nothing_is_added():
    assert estimate(np.zeros(8)).with_common(0.004, 0.0).error == pytest.approx(0.01, rel=1e-12)


def test_the_uncertainty_of_the_square_is_that_of_those_that_have_it():
    """n normal numbers: their mean square has the relative deviation √(2/n). One of a hundred receivers
    that is a hundred times as far off as the others has nearly all of it: as if it were alone."""
    assert estimate(np.full(200, 0.01)).uncertainty[1] == pytest.approx(np.sqrt(2 / 200))
    few = estimate(np.append(np.full(99, 1e-4), 0.01))
    assert few.uncertainty[1] == pytest.approx(np.sqrt(2), rel=0.01)


def test_what_direct_and_gathered_light_leave_to_chance_adds_up_as_squares():
    both = replace(
        estimate(np.full(8, 0.01)), direct_square=np.full(8, 3e-4), gather_square=np.full(8, 1e-4),
        sampled=0.02, error=0.025, uncertainty=(0.1, 0.4),
    )
    assert both.squares() == pytest.approx((3e-4, 1e-4))
    assert both.allowing_for_chance().sampled**2 == pytest.approx(4e-4 + 5e-5)
    assert both.allowing_for_chance().error**2 == pytest.approx(0.025**2 + 5e-5)


def test_rounds_of_few_receivers_do_not_end_by_chance():
    """Sixteen receivers get half as many rays again until the estimate is 0.01 or less. The half difference of
    their replicates deviates as the mean of these does, by 0.04 / √rays, so that the true square is 0.04² / rays.
    Where rounds end it is about 1.27 times the square that the differences show, but less than the estimated one,
    0.78 times."""
    random = np.random.default_rng(0)

    def ended(allows: bool) -> tuple[float, float]:
        rays, total = 4, 2 * random.normal(size=16)
        while True:
            found = estimate(0.04 * total / rays, 0.04 * np.sqrt(np.mean((total / rays) ** 2)))
            error = found.allowing_for_chance().error if allows else found.error
            if error <= 0.01:
                return 0.04**2 / rays, error**2
            more = rays // 2
            rays, total = rays + more, total + np.sqrt(more) * random.normal(size=16)

    for allows, low, high in ((False, 1.15, 1.4), (True, 0.65, 0.95)):
        true, told = np.mean([ended(allows) for _ in range(300)], axis=0)
        assert low < true / told < high


def test_few_receivers_cannot_tell_what_rays_do_not_lower():
    """With eight times the rays the squared error is the same: all of it stays, by 10,000 receivers. By
    one alone it may be chance."""
    def of(n):
        past = [Past(8.0, 4e-4, 1.0), *(Past(rays, 4e-4, np.sqrt(2 / n)) for rays in (80.0, 640.0))]
        return least_error_of(past, 0.0, 0.01)

    assert of(10_000) == pytest.approx(0.02, rel=0.05)
    assert of(1) == 0.0


def test_an_error_that_falls_as_rays_leaves_nothing():
    past = [Past(rays, 0.3 / rays, 0.01) for rays in (8.0, 80.0, 640.0)]
    assert least_error_of(past, 0.0, 0.01) == 0.0


@pytest.mark.parametrize(("risen", "expected"), [(1.0, 0.05), (1.1, 0.05), (1.8, 0.0)])
def test_an_error_that_rises_is_none_that_stays(risen, expected):
    """Rare bright rays that a kitchen's third round found were taken for the elements' error, and all that
    had been gathered was thrown away. What elements get wrong stays as it is, by chance a little more."""
    past = [Past(4.0, 0.06, 0.05), Past(9.0, 0.0027, 0.05), Past(14.0, 0.0027 * risen, 0.05)]
    assert least_error_of(past, 0.0, 0.0255) == pytest.approx(expected, rel=0.25)


def test_a_receiver_that_stands_out_by_few_rays_gets_more():
    """Both replicates met something bright with it: they agree. One that is bright with many rays, or dim, gets none."""
    found = estimate(np.zeros(2000))
    level = np.full((2000, 1), 2.0, np.float32)
    level[[20, 70, 120]], level[1600:] = 6.0, 1e-3
    level[1800] = 0.1
    light = no_light(2000, 1)
    light.rays[:], light.rays[70] = 4, 512
    lacking = lacking_where_outstanding(replace(found, indirect=level), light, ())
    assert np.flatnonzero(lacking[:1500]).tolist() == [20, 120] and (lacking[[20, 120]] == SURE_RAYS - 4).all()
    assert not lacking[1650:].any()
    level[np.arange(0, 1500, 33)] = 6.0
    assert not lacking_where_outstanding(replace(found, indirect=level), light, ()).any(), "so many are noise as usual"


SPECKS = [20, 70]  # receivers that the last round's rays make bright


@dataclass(frozen=True)
class Scripted(Rounds):
    """Rounds of 2000 receivers whose estimate reaches what was asked for with the round number ``good``: its rays make SPECKS bright.
    ``asked`` has the rays (2000,) that each round adds."""

    good: int = 1
    asked: list[np.ndarray] = field(default_factory=list)

    def _gathered(self, request, enough):
        more = np.zeros(2000, int)
        for owners, rays in request.gathered:
            more[owners] += rays
        self.asked.append(more)
        light, level = no_light(2000, 1), np.full((2000, 1), 2.0, np.float32)
        light.rays[:] = sum(self.asked)[:, None]
        light.points[:] = 4
        if len(self.asked) == self.good:
            level[SPECKS] = 6.0
        error = 2 * enough if len(self.asked) < self.good else enough
        found = replace(estimate(np.full(2000, error), error), indirect=level, direct=level)
        return (RoundResult(light, None, None), RoundResult(light, None, None)), light, found

    def _both(self, request):
        return [start_learning(np.zeros(2000, int)) for _ in range(2)]  # of no rays

    def _followed_more_paths(self, estimate, plan):
        return False


@pytest.mark.parametrize("good", [1, 3])
def test_receivers_that_stand_out_after_the_last_round_get_one_of_their_own(good):
    """Without it, single texels of a bathroom's walls stayed up to four times too bright."""
    placed = SimpleNamespace(count=2000)
    estimator = SimpleNamespace(project=None, neighborhoods=())
    rounds = Scripted(SimpleNamespace(placed=placed), None, estimator, None, Clock(), None, radiosity_given=True, good=good)
    found, _ = rounds.run(replace(make_plan(0.03, 2000, False), rays=4))
    asked = rounds.asked
    assert found.error < 0.03 and len(asked) == good + 1
    assert np.flatnonzero(asked[-1]).tolist() == SPECKS and (sum(asked)[SPECKS] > SURE_RAYS / 2).all()


@pytest.mark.parametrize(("seconds", "low", "high"), [(None, 1, 1), (100, 1, 1), (5, 0.2, 0.5), (2, 0.05, 0.2), (0.5, 1, 1)])
def test_what_there_is_no_time_for_is_done_in_part(seconds, low, high):
    """Bakes stopped at a third of their time limit, where the next round would have taken longer than the rest. Next to no time is left
    alone: all that is lacking is more than pays."""
    light = no_light(2000, 1)
    light.rays[:], light.points[:] = 1000, 1000
    random = np.random.default_rng(0)
    lacking = random.uniform(100, 5000, 2000), random.uniform(100, 5000, 2000)
    deadline = seconds and time.perf_counter() + seconds
    rounds = Rounds(None, None, None, deadline, Clock(), None)
    whole = total(*bundled(lacking, light, None, np.zeros(2000)))
    pace = 10 / whole
    found = total(*rounds._in_time(pace, lacking, light, None, np.zeros(2000)))
    assert low <= found / whole <= high and rounds._pays(found, pace) == (seconds != 0.5)


def test_elements_have_a_limit():
    """Sixteen times as many at once, at most, and no more than MOST_ELEMENTS."""
    plan = make_plan(0.01, 16, False)
    assert plan.refined(100.0).elements == 16 * plan.elements < MOST_ELEMENTS
    assert plan.refined(100.0).refined(100.0).elements == MOST_ELEMENTS


def test_elements_get_no_finer_for_an_error_that_rose_with_finer_ones():
    """Light of a hole of 3 cm in a dark room: what neighbors had in common was the noise of rays that met the spot, and each time
    all that had been gathered was thrown away."""
    rounds = Rounds(None, None, None, None, Clock(), None)
    plan = make_plan(0.03, 16, False)
    assert rounds._may_restart(0, plan, 3.0) and not rounds._may_restart(0, plan, 0.9)
    finer = plan.refined(3.0)
    assert rounds._may_restart(1, finer, 2.0) and rounds._may_restart(1, finer, 4.0), "errors of few rays are uncertain"
    assert not rounds._may_restart(1, finer, 6.5)


@pytest.mark.parametrize(
    ("rays", "floor", "expected"),
    [
        ((8, 16, 64), 0.01, 0.01),
        ((8, 16, 64), 0.0049, 0.0049),  # nearly all that is enough: rays would take for ever
        ((8, 16, 64), 0.004, 0.0),  # less than enough
        ((16, 64), 0.01, 0.0),  # the first round's rays are aimed otherwise
        ((8, 16, 19), 0.01, 0.0),  # too few more
        ((), 0.01, 0.0),
    ],
)
def test_error_that_more_rays_would_not_lower(rays, floor, expected):
    past = [Past(number, floor**2 + 1e-3 / number, 0.0) for number in rays]
    assert least_error_of(past, 0.0, 0.005) == pytest.approx(expected)


def test_error_that_more_rays_would_not_lower_has_the_shadows_in_it():
    """0.004 is below what is enough, 0.005; with shadows of 0.004 it is not."""
    past = [Past(number, 0.004**2 + 1e-3 / number, 0.0) for number in (10, 100, 200)]
    assert least_error_of(past, 0.0, 0.005) == 0
    assert least_error_of(past, 0.004**2, 0.005) == pytest.approx(0.004 * np.sqrt(2))
