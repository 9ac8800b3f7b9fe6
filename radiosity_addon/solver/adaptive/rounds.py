"""Rounds: solve, gather, estimate, and again where the error is, until it is what was asked for.

More points and rays go to the receivers that need them; finer elements come first where the error
is theirs.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from ..gather.lighting import Lighting, Samples
from ..sampling.guide import Guide, joined, make_guide
from .error_estimator import DIRECT_SHARE, ErrorEstimator, Estimate
from .plan import Plan, round_up
from .replicate import MOST_PATHS, Replicate, SolveFigures
from .requests import (
    AddLight,
    Answer_co,
    FollowMorePaths,
    GiveRadiosity,
    Learn,
    Request,
    SolveFor,
    TakeRadiosity,
)
from .second_replicate import SecondReplicate
from .solve_cache import Solve, SolveCache, solved_before

MAX_ROUNDS = 20
MAX_SAMPLES = 1 << 14  # rays or points of a receiver in one round
ELEMENTS_SHARE = 0.8  # of the goal: a larger error common to neighbours wants finer elements
MOST_ELEMENTS = 200_000
LAST_RESTART = 6  # rounds: later, too much would be gathered anew
GROWTH = 8  # times the samples so far, at most, in one round;
LARGE_ROUND, LARGE_GROWTH = 1.5e7, 3  # with so many rays this: the elements may be too coarse
AUDIT_SHARE = 0.7  # of the goal: a larger error of the elements wants more paths along the residual
MOST_MORE_PATHS = 8  # times the paths along the residual, at most, in one round
CLOSE = 0.95  # of what is enough: an error that stays so near to it leaves rays next to no room
NEAR = 1.1  # times what more rays would not lower: they are not worth their time
TELLING = 1.25  # times the rays, from which on two rounds tell what more rays would not lower


class Clock:
    """Wall seconds of each stage."""

    def __init__(self):
        self.laps: dict[str, float] = {}
        self.start = self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """Book the time since the last lap on ``stage``."""
        now = time.perf_counter()
        self.laps[stage] = self.laps.get(stage, 0.0) + now - self._last
        self._last = now

    def skip(self) -> None:
        """Book the time since the last lap on nothing: somebody else counts it."""
        self._last = time.perf_counter()

    def move(self, stage: str, other: str, seconds: float) -> None:
        """Book ``seconds`` of ``stage`` on ``other`` instead."""
        self.laps[stage] -= seconds
        self.laps[other] = self.laps.get(other, 0.0) + seconds


@dataclass(frozen=True)
class Rounds:
    """The rounds of solving and gathering for one set of receivers."""

    first: Replicate
    second: SecondReplicate
    estimator: ErrorEstimator
    deadline: float | None  # perf_counter seconds after which no round may end
    clock: Clock
    kept: SolveCache | None
    solved: bool = False  # the radiosities are there, and stay as they are

    def run(self, plan: Plan) -> tuple[Estimate, list[SolveFigures]]:
        """A first round for all receivers, then more where the error is, with rays aimed by what
        the first brought; finer elements first where the error is theirs."""
        everyone = np.arange(self.first.footprints.count)
        if not self.solved:
            plan = self._solve(plan)
        direct, gathered = [(everyone, plan.points)], [(everyone, plan.rays)]
        learning = guide = None
        learns = True
        told = []  # since the last solve: rays of a receiver, and what is squared error of theirs
        for step in range(MAX_ROUNDS):
            began, work = time.perf_counter(), _samples(direct, gathered)
            halves = self._both(AddLight(direct, gathered, step, guide, learns))
            light = [half.light for half in halves]
            estimate = self.estimator.weigh(light, [half.left for half in halves])
            self.clock.lap("gather")
            if estimate.error <= plan.enough:
                break
            if learns:
                learning = joined(learning, *self._both(Learn()))
                guide = make_guide(learning)
                learns = guide is not None  # the first rays tell well enough whether one pays
            shadows, dim = estimate.squares()
            told.append((light[0].rays.mean(), dim))
            floor = _floor(told, min(shadows, DIRECT_SHARE * plan.goal**2), plan.enough)
            excess = max(self.estimator.common(estimate), floor) / (ELEMENTS_SHARE * plan.goal)
            coarse = excess > 1 and plan.elements < MOST_ELEMENTS
            if coarse and step < LAST_RESTART and not self.solved:
                plan, told = plan.refined(excess), []
                laps = self.clock.laps
                if not self._time_for(2 * (laps.get("transport", 0.0) + laps["gather"])):
                    break
                plan = self._solve(plan)
                rays = round_up(np.median(light[0].rays), 4, MAX_SAMPLES)
                direct, gathered = [], [(everyone, rays)]
                continue
            audited = self._audited(estimate, plan)
            if not audited and (estimate.error < NEAR * floor or estimate.sampled <= plan.enough):
                break
            direct, gathered = self._more(estimate, plan, light, guide)
            ahead = _samples(direct, gathered)
            if ahead == 0 and not audited:
                break
            if not self._time_for((time.perf_counter() - began) * ahead / max(work, 1)):
                break
        return estimate, [half.solved for half in halves]

    def _time_for(self, seconds: float) -> bool:
        return self.deadline is None or time.perf_counter() + seconds <= self.deadline

    def _both(self, request: Request[Answer_co]) -> tuple[Answer_co, Answer_co]:
        """What both replicates answer."""
        self.second.ask(request)
        return request.answer(self.first), self.second.answers()[-1]

    def _solve(self, plan: Plan) -> Plan:
        """Two independent solves, of which the second may still be under way. The plan they were
        made for is finer than ``plan`` where such solves were kept."""
        keeps = self.kept is not None and self.first.needs.reflected
        context, error = self.first.split.reflected, self.first.error
        found = solved_before(self.kept, plan, context, error) if keeps else None
        if found:
            one, other = found.replicates
            self.second.ask(TakeRadiosity(other))
            self.first.take(one)
            self.clock.lap("solve")
            return replace(plan, elements=found.plan.elements, row_rays=found.plan.row_rays)
        self.second.ask(SolveFor(plan))
        solved = self.first.solve(plan)
        if self.first.needs.reflected:
            self.clock.lap("transport")
            self.clock.move("transport", "solve", solved.seconds)
        if keeps:
            solved = Solve(plan, self._both(GiveRadiosity()), self.first.context.unit)
            self.kept.put(self.kept.key(plan), solved)
        return plan

    def _audited(self, estimate: Estimate, plan: Plan) -> bool:
        """Whether both replicates have followed more paths along the residual, as they know of a
        bias that is too large and not corrected."""
        if not self.first.needs.reflected or self.first.paths >= MOST_PATHS:
            return False
        known = np.sqrt(max(estimate.error**2 - estimate.sampled**2, 0.0))
        excess = known / (AUDIT_SHARE * plan.goal)
        if excess <= 1:
            return False
        self._both(FollowMorePaths(float(np.clip(excess**2, 2, MOST_MORE_PATHS))))
        self.clock.lap("transport")
        return True

    def _more(self, estimate: Estimate, plan: Plan, light: list[Lighting], guide: Guide | None):
        """[(owners, samples of each)] to add, of points for direct light and of rays."""
        points, rays = self.estimator.lacking(estimate, plan.goal, light[0])
        points = _bounded(points, light[0].points[:, 0], GROWTH)
        large = GROWTH * light[0].rays.sum() > LARGE_ROUND
        rays = _bounded(rays, light[0].rays[:, 0], LARGE_GROWTH if large else GROWTH)
        if guide is not None:
            rays /= guide.worth[guide.cluster]
        return _alike(points, 4), _alike(rays, 8)


def _bounded(more: np.ndarray, number: np.ndarray, growth: float) -> np.ndarray:
    """(count,) samples to add to ``number`` (count,), to ``growth`` times as many at most."""
    return np.minimum(more, (growth - 1) * number)


def _alike(samples: np.ndarray, least: int) -> list[tuple[np.ndarray, int]]:
    """[(owners, samples)] of about ``samples`` (count,) for each: powers of two, as Sobol sets
    want."""
    some = np.flatnonzero(samples >= least / 2)
    exponent = np.rint(np.log2(np.clip(samples[some], least, MAX_SAMPLES))).astype(int)
    return [(some[exponent == e], 1 << int(e)) for e in np.unique(exponent)]


def _floor(told: list[tuple[float, float]], shadows: float, enough: float) -> float:
    """The error that stays however many rays there are, if the rest of its square falls as
    1 / rays, from (rays, squared error) of the last two rounds, and ``shadows``, the square that
    is left to direct light; 0 where it is well below ``enough``, or they cannot tell: the first
    round's rays are not aimed yet."""
    if len(told) < 3 or told[-1][0] < TELLING * told[-2][0]:
        return 0.0
    (few, high), (many, low) = told[-2:]
    floor = np.sqrt(max(many * low - few * high, 0.0) / (many - few) + shadows)
    return floor if floor > CLOSE * enough else 0.0


def _samples(*rounds: Samples) -> int:
    """Points and rays of rounds of [(owners, samples of each)]."""
    return sum(len(owners) * samples for parts in rounds for owners, samples in parts)
