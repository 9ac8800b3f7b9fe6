"""Rounds: solve, gather, judge, and again where the error is, until it is what was asked for.

More points and rays go to the receivers that need them; finer elements come first where the error
is theirs.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ..gather.lighting import Lighting
from ..sampling.guide import Guide, joined, make_guide
from .error_estimator import DIRECT_SHARE, ErrorEstimator, Estimate
from .plan import Plan, round_up
from .replicate import LocalReplicate, Replicate, SolveFigures
from .solve_cache import SolveCache

MAX_ROUNDS = 20
MAX_SAMPLES = 1 << 14  # rays or points of a receiver in one round
ELEMENTS_SHARE = 0.8  # of the goal: a larger error common to neighbours wants finer elements
MOST_ELEMENTS = 200_000
LAST_RESTART = 6  # rounds: later, too much would be gathered anew
GROWTH = 8  # times the samples so far, at most, in one round;
LARGE_ROUND, LARGE_GROWTH = 1.5e7, 3  # with so many rays this: the elements may be too coarse
DIRECT_RATE = 0.8  # points for shadows to lower their squared error by a factor: its power
CLOSE = 0.95  # of what is enough: an error that stays so near to it leaves rays next to no room
NEAR = 1.1  # times what more rays would not lower: they are not worth their time
TELLING = 1.5  # times the rays, from which on two rounds tell what more rays would not lower


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

    def move(self, stage: str, other: str, seconds: float) -> None:
        """Book ``seconds`` of ``stage`` on ``other`` instead."""
        self.laps[stage] -= seconds
        self.laps[other] = self.laps.get(other, 0.0) + seconds


@dataclass(frozen=True)
class Rounds:
    """The rounds of solving and gathering for one set of receivers."""

    first: Replicate
    second: LocalReplicate  # or another process that is spoken to alike
    judge: ErrorEstimator
    deadline: float | None  # perf_counter seconds after which no round may end
    clock: Clock
    kept: SolveCache | None

    def run(self, plan: Plan) -> tuple[Estimate, list[SolveFigures]]:
        """A first round for all receivers, then more where the error is, with rays aimed by what
        the first brought; finer elements first where the error is theirs."""
        everyone = np.arange(self.first.footprints.count)
        plan = self._solve(plan)
        direct, gathered = (everyone, plan.points), (everyone, plan.rays)
        learning = guide = None
        learns = True
        told = []  # since the last solve: rays of a receiver, and what is squared error of theirs
        for step in range(MAX_ROUNDS):
            began, work = time.perf_counter(), _samples(direct, gathered)
            halves = self._both("add", direct, gathered, step, guide, learns)
            light = [half.light for half in halves]
            verdict = self.judge.weigh(light)
            self.clock.lap("gather")
            if verdict.error <= plan.enough:
                break
            if learns:
                learning = joined(learning, *self._both("learn"))
                guide = make_guide(learning)
                learns = guide is not None  # the first rays tell well enough whether one pays
            shadows, dim = verdict.squares()
            told.append((light[0].rays.mean(), dim))
            floor = _floor(told, min(shadows, DIRECT_SHARE * plan.goal**2), plan.enough)
            excess = max(self.judge.common(verdict), floor) / (ELEMENTS_SHARE * plan.goal)
            if excess > 1 and step < LAST_RESTART and plan.elements < MOST_ELEMENTS:
                plan, told = plan.refined(excess), []
                laps = self.clock.laps
                if not self._time_for(2 * (laps.get("transport", 0.0) + laps["gather"])):
                    break
                plan = self._solve(plan)
                direct, gathered = (everyone[:0], plan.points), (everyone, plan.rays)
                continue
            if verdict.error < NEAR * floor:
                break
            direct, gathered = self._more(verdict, plan, light, guide)
            ahead = _samples(direct, gathered)
            if ahead == 0:
                break
            if not self._time_for((time.perf_counter() - began) * ahead / max(work, 1)):
                break
        return verdict, [half.solved for half in halves]

    def _time_for(self, seconds: float) -> bool:
        return self.deadline is None or time.perf_counter() + seconds <= self.deadline

    def _both(self, name: str, *words) -> tuple:
        """What both halves answer."""
        self.second.ask(name, *words)
        return getattr(self.first, name)(*words), self.second.answers()[-1]

    def _solve(self, plan: Plan) -> Plan:
        """Two independent solves, of which the second may still be under way. The plan they were
        made for is finer than ``plan`` where such solves were kept."""
        keeps = self.kept is not None and self.first.needs.reflected
        found = self.kept.find(self.first.context, plan, self.first.error) if keeps else None
        if found:
            plan, (one, other) = found
            self.second.ask("take", other)
            self.first.take(one)
            self.clock.lap("solve")
            return plan
        self.second.ask("solve", plan)
        solved = self.first.solve(plan)
        if self.first.needs.reflected:
            self.clock.lap("transport")
            self.clock.move("transport", "solve", solved.seconds)
        if keeps:
            self.kept.add(self.first.context, plan, list(self._both("give")))
        return plan

    def _more(self, verdict: Estimate, plan: Plan, light: list[Lighting], guide: Guide | None):
        """(owners, samples of each) to add, of points for direct light and of rays."""
        (shaded, direct_factor), (dim, gather_factor) = self.judge.mark(verdict, plan.goal)
        points = light[0].points.max() * (min(direct_factor**DIRECT_RATE, GROWTH) - 1)
        large = GROWTH * light[0].rays.sum() > LARGE_ROUND
        rays = light[0].rays.mean() * (min(gather_factor, LARGE_GROWTH if large else GROWTH) - 1)
        if guide is not None and len(dim):
            rays /= guide.worth[guide.cluster[dim]].mean()
        return (shaded, round_up(points, 4, MAX_SAMPLES)), (dim, round_up(rays, 8, MAX_SAMPLES))


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


def _samples(*rounds) -> int:
    """Points and rays of a round of (owners, samples of each)."""
    return sum(len(owners) * samples for owners, samples in rounds)
