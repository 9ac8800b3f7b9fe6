"""Rounds: solve, gather, estimate, and again where the error is, until it is what was asked for.

More points and rays go to the receivers that need them; finer elements come first where the error
is theirs.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ..gather.lighting import Lighting, Samples
from ..sampling.guide import USEFUL, Guide, Learning, joined, make_guide
from .allocation import (
    MAX_SAMPLES,
    Lacking,
    bundled,
    disputed_receivers,
    lacking_at_worst,
    lacking_in_mean,
    lacking_where_outstanding,
    total,
)
from .clock import Clock
from .error_estimator import ErrorEstimator
from .estimate import Estimate
from .held_out import lacking_held_out
from .plan import MOST_ELEMENTS, Plan, round_up
from .replicate import FEW_ON_ELEMENTS, MOST_PATHS, Replicate
from .requests import (
    AddHeldOut,
    AddLight,
    Answer_co,
    FollowMorePaths,
    GiveRadiosity,
    Learn,
    Request,
    SolveFor,
    TakeRadiosity,
)
from .round_result import RoundResult, SolveFigures
from .second_replicate import SecondReplicate
from .solve_cache import Solve, SolveCache, cached_solve

MAX_ROUNDS = 20  # number [rounds] of a bake, at most
ELEMENTS_SHARE = 0.8  # error [of the goal] that finer elements would lower: above it elements get finer
LAST_RESTART = 6  # number [rounds] after which nothing is solved anew: too many samples would be thrown away
RISEN = 2.0  # factor [error of coarser elements]: where that of finer ones is so much larger, it is not the elements'
# Part [of a round] that there is time for: with less none is begun; and part [of that] that it is made of, as numbers are rounded.
LEAST_PART, SAFE_PART = 0.1, 0.7
# Error [of the goal] by a bias that is known and not corrected: above it more paths along the residual are followed.
BIAS_SHARE = 0.7
MOST_MORE_PATHS = 8  # factor [paths along the residual so far] by which they grow in one round, at most
DIRECT_SHARE = 0.4  # share [of the goal's square] by direct light, at most, in the error that rays do not lower: points lower it
CLOSE = 0.95  # error [of what is enough] that rays do not lower: a smaller one is taken as 0
NEAR = 1.1  # factor [of the error that rays do not lower]: where the error is below it, no more rays are traced
SURE = 2.0  # margin [standard deviations] that is taken off an error that rays do not lower
UNEVEN = 0.01  # share [of the surface] of places worse than they may be: fewer get no round of their own
TELLING = 1.25  # factor [rays of the round before]: two rounds that differ by less do not show what rays do not lower


@dataclass(frozen=True)
class Past:
    """A round since the last solve: rays of a receiver, what is squared error of theirs, and by what share
    of itself that is uncertain."""

    rays: float
    square: float
    uncertainty: float


@dataclass(frozen=True)
class Rounds:
    """The rounds of solving and gathering for one set of receivers."""

    first: Replicate
    second: SecondReplicate
    estimator: ErrorEstimator
    deadline: float | None  # perf_counter seconds after which no round may end
    clock: Clock
    cache: SolveCache | None
    radiosity_given: bool = False  # the radiosities are there, and stay as they are
    useful: float = USEFUL  # gain of variance from which on rays are guided

    def run(self, plan: Plan) -> tuple[Estimate, list[SolveFigures]]:
        """A first round for all receivers, then more where the error is, with rays aimed by what the first brought; finer elements before."""
        everyone = np.arange(self.first.placed.count)
        if not self.radiosity_given:
            plan = self._solve(plan)
        direct, gathered = [(everyone, plan.points)], [(everyone, plan.rays)]
        learning, guide, learns, history = None, None, True, list[Past]()
        settled, disputed, checked = np.zeros(len(everyone), bool), everyone[:0], False
        for step in range(MAX_ROUNDS):
            began, work = time.perf_counter(), total(direct, gathered)
            request, disputed = AddLight(direct, gathered, step, guide, learns, disputed), everyone[:0]
            replicates, light, estimate = self._gathered(request, plan.enough)
            pace = (time.perf_counter() - began) / max(work, 1)
            if estimate.error <= plan.enough:
                direct, gathered = ([], []) if checked else self._at_single_places(estimate, plan, light, step)
                checked = True
                if self._pays(total(direct, gathered), pace):
                    continue
                break
            if learns:
                learning, guide = self._learned(learning)
                learns = guide is not None  # the first rays tell well enough whether one pays
            floor = _least_error(history, estimate, light, plan)
            excess = max(_of_elements(replicates, estimate), floor) / (ELEMENTS_SHARE * plan.goal)
            if self._may_restart(step, plan, excess) and self._time_for(self._seconds_of_restart()):
                plan, history, settled = plan.refined(excess), [], np.zeros_like(settled)
                rays, plan = round_up(np.median(light.rays), 4, MAX_SAMPLES), self._solve(plan)  # which forgets rays
                direct, gathered = [], [(everyone, rays)]
                continue
            followed = self._followed_more_paths(estimate, plan)
            if not followed and (estimate.error < NEAR * floor or estimate.sampled <= plan.enough):
                break
            disputed = disputed_receivers(estimate, light, settled)
            settled[disputed] = True
            lacking, at_once = self._lacking(estimate, plan, light), self._at_once(estimate, light, disputed)
            direct, gathered = self._in_time(pace, lacking, light, guide, at_once)
            if not self._pays(total(direct, gathered), pace, followed):
                break
        return estimate, [replicate.figures for replicate in replicates]

    def _gathered(
        self, request: AddLight, enough: float
    ) -> tuple[tuple[RoundResult, RoundResult], Lighting, Estimate]:
        """What both replicates have after one more round, the first one's light, and the estimate. What neighbors have in
        common is left out where it is not asked for: no elements, and the error is ``enough``."""
        replicates = self._both(request)
        light = [replicate.light for replicate in replicates]
        held_out = self._held_out(light[0], request.step)
        estimate = self.estimator.weigh(light, [replicate.uncorrected for replicate in replicates], held_out)
        estimate = estimate.allowing_for_chance()
        share = np.mean([replicate.share_of_elements for replicate in replicates])
        if estimate.error > enough or share > FEW_ON_ELEMENTS:
            estimate = estimate.with_common(self.estimator.common(estimate), share)
        self.clock.lap("gather")
        return replicates, light[0], estimate

    def _learned(self, before: Learning | None) -> tuple[Learning, Guide | None]:
        """What rays have told since and ``before``, and a guide by that, where one pays."""
        learning = joined(before, *self._both(Learn()))
        return learning, make_guide(learning, self.useful)

    def _held_out(self, light: Lighting, step: int) -> list[Lighting] | None:
        """The held-out light of both replicates after the round ``step``; None where none is."""
        chosen = self.estimator.held_out
        if chosen is None:
            return None
        more = lacking_held_out(chosen, light, self.first.held_out and self.first.held_out.light)
        return list(self._both(AddHeldOut(more, step)))

    def _lacking(self, estimate: Estimate, plan: Plan, light: Lighting) -> Lacking:
        """What receivers lack. Colors that are fitted to many are good where single ones are not."""
        lacking = lacking_in_mean(estimate, plan.goal, light, self.estimator.neighborhoods)
        if self.estimator.project is not None:
            return lacking
        points, rays = map(np.maximum, lacking, lacking_at_worst(estimate, plan.goal, light))
        return points, rays

    def _at_single_places(
        self, estimate: Estimate, plan: Plan, light: Lighting, step: int
    ) -> tuple[Samples, Samples]:
        """What receivers lack where the mean error is ``enough``: those that stand out, as rays of the last round may have met
        something bright there, and, after the first round, those that are worse than they may be, where they are so many that this pays."""
        if self.estimator.project is not None:
            return [], []
        points, rays = lacking_at_worst(estimate, plan.goal, light)
        if step or estimate.share[(points > 0) | (rays > 0)].sum() <= UNEVEN:
            points, rays = np.zeros((2, len(points)))
        return bundled((points, rays), light, None, self._at_once(estimate, light, np.zeros(0, int)))

    def _at_once(self, estimate: Estimate, light: Lighting, disputed: np.ndarray) -> np.ndarray:
        """Rays (count,) that are added beyond GROWTH: to receivers that stand out, and to the ``disputed`` (k,) int, whose rays are
        forgotten."""
        if self.estimator.project is not None:
            rays = np.zeros(len(light.rays))
        else:
            rays = lacking_where_outstanding(estimate, light, self.estimator.neighborhoods)
        rays[disputed] += light.rays[disputed, 0]
        return rays

    def _in_time(
        self, pace: float, lacking: Lacking, light: Lighting, guide: Guide | None, at_once: np.ndarray
    ) -> tuple[Samples, Samples]:
        """Samples to add of those ``lacking``, or the part of them that there is time for, at a ``pace`` [s] of each."""
        found = bundled(lacking, light, guide, at_once)
        if self.deadline is None:
            return found
        part = (self.deadline - time.perf_counter()) / max(pace * total(*found), 1e-9)
        return bundled(lacking, light, guide, at_once, SAFE_PART * part) if LEAST_PART < part < 1 else found

    def _pays(self, samples: int, pace: float, followed: bool = False) -> bool:
        """There is something to add, at a ``pace`` [s] of each sample, and time for it."""
        return (samples > 0 or followed) and self._time_for(pace * samples)

    def _may_restart(self, step: int, plan: Plan, excess: float) -> bool:
        """Whether to solve anew with finer elements: their error is too large and, where they were made finer before, has not risen since."""
        may = plan.elements < MOST_ELEMENTS and step < LAST_RESTART and not self.radiosity_given
        return may and 1 < excess < RISEN * plan.excess

    def _seconds_of_restart(self) -> float:
        """About what it takes to solve with finer elements, and to gather anew."""
        laps = self.clock.laps
        return 2 * (laps.get("transport", 0.0) + laps["gather"])

    def _time_for(self, seconds: float) -> bool:
        return self.deadline is None or time.perf_counter() + seconds <= self.deadline

    def _both(self, request: Request[Answer_co]) -> tuple[Answer_co, Answer_co]:
        """What both replicates answer."""
        self.second.ask(request)
        return request.answer(self.first), self.second.answers()[-1]

    def _solve(self, plan: Plan) -> Plan:
        """Start two independent solves, the second of which may still be under way, or take cached ones.
        Returns the plan they were made for: of cached ones it may be finer than ``plan``."""
        keeps = self.cache is not None and self.first.requirements.reflected
        context, error = self.first.split.reflected, self.first.error
        found = cached_solve(self.cache, plan, context, error) if keeps else None
        if found:
            one, other = found.replicates
            self.second.ask(TakeRadiosity(other))
            self.first.take(one)
            self.clock.lap("solve")
            return replace(plan, elements=found.plan.elements, row_rays=found.plan.row_rays)
        self.second.ask(SolveFor(plan))
        solve = self.first.solve(plan)
        if self.first.requirements.reflected:
            self.clock.lap("transport")
            self.clock.move("transport", "solve", solve.seconds)
        if keeps:
            solve = Solve(plan, self._both(GiveRadiosity()), self.first.context.unit)
            self.cache.put(self.cache.key(plan), solve)
        return plan

    def _followed_more_paths(self, estimate: Estimate, plan: Plan) -> bool:
        """Have both replicates follow more paths along the residual, where the bias that they know of and
        cannot correct is too large; whether they did."""
        if not self.first.requirements.reflected or self.first.paths >= MOST_PATHS:
            return False
        excess = estimate.not_sampled / (BIAS_SHARE * plan.goal)
        if excess <= 1:
            return False
        self._both(FollowMorePaths(float(np.clip(excess**2, 2, MOST_MORE_PATHS))))
        self.clock.lap("transport")
        return True


def _of_elements(replicates: tuple[RoundResult, RoundResult], estimate: Estimate) -> float:
    """The relative error that finer elements would lower: the error that neighbors have in common, or, where
    it is larger, the bias that paths along the residual found on elements. That bias is the geometric mean
    of what the two replicates found, as noise makes one alone find some now and then."""
    found = np.prod([replicate.found_on_elements for replicate in replicates])
    return max(estimate.common, float(np.sqrt(found)))


def _least_error(history: list[Past], estimate: Estimate, light: Lighting, plan: Plan) -> float:
    """The error that stays however many rays there are. This round is added to ``history``."""
    shadows, dim = estimate.squares()
    history.append(Past(light.rays.mean(), dim, estimate.uncertainty[1]))
    return least_error_of(history, min(shadows, DIRECT_SHARE * plan.goal**2), plan.enough)


def least_error_of(history: list[Past], shadows: float, enough: float) -> float:
    """The error that stays however many rays there are, if the rest of its square falls as
    1 / rays, from the last two rounds, and ``shadows``, the square that is left to direct light; 0 where
    it is well below ``enough``, or they cannot tell: the first round's rays are not aimed yet, and
    the squares are uncertain."""
    if len(history) < 3 or history[-1].rays <= TELLING * history[-2].rays:
        return 0.0
    before, now = history[-2:]
    if now.square > before.square * (1 + SURE * np.hypot(before.uncertainty, now.uncertainty)):
        return 0.0  # what stays was there before: rare bright rays have come to light
    left = now.rays * now.square - before.rays * before.square
    left -= SURE * np.hypot(*(past.rays * past.square * past.uncertainty for past in (before, now)))
    floor = np.sqrt(max(left, 0.0) / (now.rays - before.rays) + shadows)
    return floor if floor > CLOSE * enough else 0.0
