"""The sequence: Scene and receivers in, Solution out. The algorithm, in order.

Depends on the rest of the solver; nothing in the solver depends on it.

Everything that is random is done twice, in two independent halves (``half``) whose mean is the
result: their difference tells the error. More points and rays go to the receivers that need them
until the error asked for is met.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from .check import check_scene
from .context import Context, build_context
from .energy import energy_balance
from .footprints import Footprints, build_footprints
from .geometry import rounding_warning
from .graph import build_graph
from .guide import Guide, make_guide, start_learning
from .half import Gone, Half, Here, Solved
from .judge import Judge, Surface, Verdict
from .keep import Kept
from .lattice import build_lattices
from .lighting import Lighting
from .needs import needs_of
from .parallel import thread_count
from .plan import Plan, make_plan, round_up
from .points import footprint_points
from .progress import Progress, silent
from .receivers import Receivers
from .scene import Scene
from .solution import Solution, Statistics
from .ways import Sight

SURFACE_POINTS = 8  # a receiver's reflectance and emission are means over these
MAX_ROUNDS = 20
MAX_SAMPLES = 1 << 14  # rays or points of a receiver in one round
ELEMENTS_SHARE = 0.8  # of the goal: a larger error common to neighbours wants finer elements
MOST_ELEMENTS = 200_000
LAST_RESTART = 6  # rounds: later, too much would be gathered anew
GROWTH = 8  # times the samples so far, at most, in one round;
LARGE_ROUND, LARGE_GROWTH = 1.5e7, 3  # with so many rays this: the elements may be too coarse
DIRECT_RATE = 0.8  # points for shadows to lower their squared error by a factor: its power
TELLING = 1.5  # times the rays, from which on two rounds tell what more rays would not lower


@np.errstate(under="ignore")  # light that vanishes beside the brightest is nothing
def solve(
    scene: Scene, receivers: Receivers, settings, progress: Progress | None = None, project=None,
    kept: Kept | None = None, beside=None,
) -> Solution:
    """Light at the receivers, to the relative error ``settings.target_error``.

    ``project`` maps values at receivers (count, c) to where the error is judged (m, c), linearly,
    for colours that are means over receivers; None judges the receivers themselves. ``progress``
    may raise to stop. ``kept`` has solves to use again and takes those made. ``beside`` does the
    second half in another process (see ``half.Here`` for how it is spoken to); None does both here.
    The result is the same. Raises ValueError for a scene that cannot be solved.
    """
    clock = Clock()
    check_scene(scene, receivers)
    threads = mine = thread_count(settings.threads)
    if threads == 1:
        beside = None
    if beside is not None:
        mine = (threads + 1) // 2
        beside.ask("open", scene, receivers, settings, threads - mine)
    context = build_context(scene, settings.seed, mine, progress or silent)
    footprints = build_footprints(context.geometry, receivers)
    judge = _judge(context, footprints, receivers, settings.passes, project, threads)
    plan = make_plan(settings.target_error, receivers.count, bool(judge.lattices))
    if kept is not None:
        kept.expect(scene, receivers, settings.seed)
    clock.lap("elements")
    deadline = None if settings.time_limit is None else clock.start + settings.time_limit
    needs = needs_of(context, settings.passes)
    first, second = (
        Half(number, context, footprints, needs, settings.target_error) for number in (0, 1)
    )
    beside, lost = _opened(beside, second)
    bake = _Rounds(first, beside, judge, deadline, clock, kept)
    verdict, solved = bake.run(plan)
    energy = energy_balance(context)
    clock.lap("solve")
    return Solution(
        emission=_three(judge.surface.emission * context.unit),
        direct=_three(verdict.direct * context.unit),
        indirect=_three(verdict.indirect * context.unit),
        reflectance=_three(judge.surface.reflectance),
        statistics=Statistics(
            elements=sum(half.unknowns for half in solved) // 2,
            rays=context.rays + beside.rays,
            iterations=max(half.iterations for half in solved),
            residual=max(half.residual for half in solved),
            target_error=settings.target_error,
            estimated_error=verdict.error,
            energy=energy,
            warnings=(*lost, *_warnings(context, verdict, settings, solved)),
            seconds={**clock.laps, "embree": context.embree_seconds + beside.embree_seconds},
        ),
    )


def _opened(beside, second: Half):
    """What does the second half, and warnings: this process where the other is not there."""
    if beside is None:
        return Here(second), ()
    try:
        beside.answers()
    except Gone as error:
        return Here(second), (f"{error}; the bake was done by one process, which takes longer",)
    return beside, ()


def _three(values: np.ndarray) -> np.ndarray:
    """(count, 3) of values (count, 3) or (count, 1)."""
    return np.repeat(values, 3 // values.shape[1], axis=1)


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


def _judge(context: Context, footprints, receivers: Receivers, passes, project, threads: int):
    position, normal = footprints.middle()
    if receivers.grid is not None:
        lattices = build_lattices(receivers.grid, position, normal, threads)
    else:
        lattices = build_graph(position, normal, footprints.area, threads)
    sees = Sight(context, footprints).sees_whole
    return Judge(_surface(context, footprints), lattices, passes, threads, sees, project)


def _surface(context: Context, footprints: Footprints) -> Surface:
    """Reflectance and emission, averaged over each footprint: cell by cell, or at points where
    they vary within a triangle."""
    if context.varies:
        owners = np.arange(footprints.count)
        turn = np.zeros((len(owners), 3), np.float32)
        points = footprint_points(footprints, owners, turn, SURFACE_POINTS, context.seed, 30)
        triangle, uv = points.triangle.ravel(), points.uv.reshape(-1, 2)

        def mean(values: np.ndarray) -> np.ndarray:
            return values.reshape(SURFACE_POINTS, -1, context.channels).mean(axis=0)
    else:
        triangle, uv = footprints.triangle, np.zeros((len(footprints.triangle), 2))
        mean = footprints.mean_of_cells
    return Surface(
        mean(context.reflectance(triangle, uv)), mean(context.emission(triangle, uv))
    )


@dataclass(frozen=True)
class _Rounds:
    """The rounds of solving and gathering for one set of receivers."""

    first: Half
    second: Here  # or another process that is spoken to alike
    judge: Judge
    deadline: float | None  # perf_counter seconds after which no round may end
    clock: Clock
    kept: Kept | None

    def run(self, plan: Plan) -> tuple[Verdict, list[Solved]]:
        """A first round for all receivers, then more where the error is, with rays aimed by what
        the first brought; finer elements first where the error is theirs."""
        everyone = np.arange(self.first.footprints.count)
        plan = self._solve(plan)
        direct, gathered = (everyone, plan.points), (everyone, plan.rays)
        learning = start_learning(self.first.clusters)
        guide = None
        told = []  # since the last solve: rays of a receiver, and their light's squared error
        for step in range(MAX_ROUNDS):
            began, work = time.perf_counter(), _samples(direct, gathered)
            halves = self._both("add", direct, gathered, step, guide, learning is not None)
            light = [half.light for half in halves]
            verdict = self.judge.weigh(light)
            self.clock.lap("gather")
            if verdict.error <= plan.enough:
                break
            if learning is not None:
                learning.join([half.learnt for half in halves])
                guide = make_guide(learning)
            if guide is None:  # the first rays tell well enough whether one would pay
                learning = None
            told.append((light[0].rays.mean(), max(verdict.gather_square.mean(), 0.0)))
            excess = max(self.judge.common(verdict), _floor(told, plan.enough))
            excess /= ELEMENTS_SHARE * plan.goal
            if excess > 1 and step < LAST_RESTART and plan.elements < MOST_ELEMENTS:
                plan, told = plan.refined(excess), []
                laps = self.clock.laps
                if not self._time_for(2 * (laps.get("transport", 0.0) + laps["gather"])):
                    break
                plan = self._solve(plan)
                direct, gathered = (everyone[:0], plan.points), (everyone, plan.rays)
                continue
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

    def _more(self, verdict: Verdict, plan: Plan, light: list[Lighting], guide: Guide | None):
        """(owners, samples of each) to add, of points for direct light and of rays."""
        (shaded, direct_factor), (dim, gather_factor) = self.judge.mark(verdict, plan.goal)
        points = light[0].points.max() * (min(direct_factor**DIRECT_RATE, GROWTH) - 1)
        large = GROWTH * light[0].rays.sum() > LARGE_ROUND
        rays = light[0].rays.mean() * (min(gather_factor, LARGE_GROWTH if large else GROWTH) - 1)
        if guide is not None and len(dim):
            rays /= guide.worth[guide.cluster[dim]].mean()
        return (shaded, round_up(points, 4, MAX_SAMPLES)), (dim, round_up(rays, 8, MAX_SAMPLES))


def _floor(told: list[tuple[float, float]], enough: float) -> float:
    """The error that stays however many rays there are, if the rest of its square falls as
    1 / rays, from (rays, squared error) of the last two rounds; 0 where it is no more than
    ``enough``, or they cannot tell: the first round's rays are not aimed yet."""
    if len(told) < 3 or told[-1][0] < TELLING * told[-2][0]:
        return 0.0
    (few, high), (many, low) = told[-2:]
    floor = np.sqrt(max(many * low - few * high, 0.0) / (many - few))
    return floor if floor > enough else 0.0


def _samples(*rounds) -> int:
    """Points and rays of a round of (owners, samples of each)."""
    return sum(len(owners) * samples for owners, samples in rounds)


def _warnings(context: Context, verdict: Verdict, settings, solved: list[Solved]):
    """What the user should know of the numbers."""
    rounded = rounding_warning(context.scene.vertices, context.geometry)
    if rounded:
        yield rounded
    if verdict.error > settings.target_error:
        reason = "within the time limit" if settings.time_limit else f"in {MAX_ROUNDS} rounds"
        yield (
            f"the error asked for, {settings.target_error:.3g}, was not reached {reason}: "
            f"estimated {verdict.error:.3g}"
        )
    residual = max(half.residual for half in solved)
    if residual > 0.1 * settings.target_error:
        yield (
            f"the linear system was solved to a residual of {residual:.2g} only; "
            "reflectances this close to 1 need a scene that light can leave"
        )
