"""The sequence: Scene and receivers in, Solution out. The algorithm, in order.

Depends on the rest of the solver; nothing in the solver depends on it.

Everything that is random is done twice, in two independent halves whose mean is the result: their
difference tells the error. More points and rays go to the receivers that need them until the
error asked for is met.
"""

from __future__ import annotations

import time

import numpy as np

from .context import Context, build_context
from .footprints import Footprints, build_footprints
from .judge import Judge, Surface
from .lighting import add_direct, add_gathered, no_light, place_on
from .plan import Plan, make_plan, power_of_two
from .points import footprint_points
from .progress import Progress, silent
from .radiosity import Radiosity, solve_radiosity
from .receivers import Receivers
from .scene import Scene
from .smooth import build_lattices
from .solution import Solution, Statistics

SURFACE_POINTS = 8  # a receiver's reflectance and emission are means over these
MAX_ROUNDS = 10
MAX_SAMPLES = 1 << 14  # rays or points of a receiver in one round


def solve(
    scene: Scene, receivers: Receivers, settings, progress: Progress | None = None, project=None
) -> Solution:
    """Light at the receivers, to the relative error ``settings.target_error``.

    ``project`` maps values at receivers (count, c) to where the error is judged (m, c), for
    colours that are means over receivers; None judges the receivers themselves. ``progress`` may
    raise to stop. Raises ValueError for a scene that cannot be solved.
    """
    clock = Clock()
    context = build_context(scene, settings.seed, settings.threads, progress or silent)
    footprints = build_footprints(context.geometry, receivers)
    judge = _judge(context, footprints, receivers, settings.passes, project)
    plan = make_plan(settings.target_error, receivers.count, bool(judge.lattices))
    clock.lap("elements")
    radiosities = [_half(context, footprints, plan, settings.target_error, k) for k in (0, 1)]
    clock.lap("transport")
    deadline = None if settings.time_limit is None else clock.start + settings.time_limit
    verdict = _gather_rounds(context, footprints, radiosities, judge, plan, deadline)
    clock.lap("gather")
    return Solution(
        emission=judge.surface.emission * context.unit,
        direct=verdict.direct * context.unit,
        indirect=verdict.indirect * context.unit,
        reflectance=judge.surface.reflectance,
        statistics=Statistics(
            elements=sum(len(r.solution) for r in radiosities) // 2,
            rays=context.rays,
            iterations=max(r.iterations for r in radiosities),
            residual=max(r.residual for r in radiosities),
            target_error=settings.target_error,
            estimated_error=verdict.error,
            energy=radiosities[-1].energy,
            warnings=tuple(_warnings(verdict, plan, settings, radiosities)),
            seconds={**clock.laps, "embree": context.embree_seconds},
        ),
    )


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


def _judge(context: Context, footprints: Footprints, receivers: Receivers, passes, project):
    lattices = []
    if receivers.grid is not None:
        lattices = build_lattices(receivers.grid, *footprints.middle())
    return Judge(_surface(context, footprints), lattices, passes, context.threads, project)


def _surface(context: Context, footprints: Footprints) -> Surface:
    """Reflectance and emission, averaged over each footprint."""
    owners = np.arange(footprints.count)
    turn = np.zeros((len(owners), 3), np.float32)
    points = footprint_points(footprints, owners, turn, SURFACE_POINTS, context.seed, 30)
    triangle, uv = points.triangle.ravel(), points.uv.reshape(-1, 2)
    shape = (SURFACE_POINTS, -1, 3)
    return Surface(
        context.reflectance(triangle, uv).reshape(shape).mean(axis=0),
        context.emission(triangle, uv).reshape(shape).mean(axis=0),
    )


def _half(context: Context, footprints: Footprints, plan: Plan, error: float, half: int) -> Radiosity:
    """One independent solve; the halves' elements differ in size, so that this shows too."""
    key = (context.seed, 10, half)
    place = place_on(footprints, np.arange(footprints.count), plan.row_points, *key)
    elements = plan.elements if half else plan.elements // 2
    return solve_radiosity(
        context, footprints.count, place, elements, plan.row_rays, plan.row_points, error, key
    )


def _gather_rounds(context: Context, footprints, radiosities, judge: Judge, plan: Plan, deadline):
    """Light at the receivers: a first round for all, then more where the error is.

    No round starts that would end after ``deadline`` (perf_counter seconds, or None).
    """
    everyone = np.arange(footprints.count)
    light = [no_light(footprints.count) for _ in radiosities]
    direct, gathered = (everyone, plan.points), (everyone, plan.rays)
    for step in range(MAX_ROUNDS):
        began, work = time.perf_counter(), _samples(direct, gathered)
        for half, radiosity in enumerate(radiosities):
            add_direct(context, footprints, light[half], *direct, step, half)
            add_gathered(context, footprints, light[half], radiosity, *gathered, step, half)
        verdict = judge.weigh(light)
        if verdict.error <= plan.goal:
            break
        marked = judge.mark(verdict, plan.goal)
        direct, gathered = (
            (owners, power_of_two(had * min(factor - 1, 3), 4, MAX_SAMPLES))
            for (owners, factor), had in zip(marked, (_most(light[0].points), _most(light[0].rays)))
        )
        ahead = _samples(direct, gathered)
        seconds = (time.perf_counter() - began) * ahead / max(work, 1)
        if ahead == 0 or (deadline and time.perf_counter() + seconds > deadline):
            break
    return verdict


def _samples(*rounds) -> int:
    """Points and rays of a round of (owners, samples of each)."""
    return sum(len(owners) * samples for owners, samples in rounds)


def _warnings(verdict, plan: Plan, settings, radiosities):
    """What the user should know of the numbers."""
    if verdict.error > settings.target_error:
        reason = "within the time limit" if settings.time_limit else f"in {MAX_ROUNDS} rounds"
        yield (
            f"the error asked for, {settings.target_error:.3g}, was not reached {reason}: "
            f"estimated {verdict.error:.3g}"
        )
    residual = max(r.residual for r in radiosities)
    if residual > 0.1 * settings.target_error:
        yield (
            f"the linear system was solved to a residual of {residual:.2g} only; "
            "reflectances this close to 1 need a scene that light can leave"
        )


def _most(numbers: np.ndarray) -> float:
    return float(numbers.max(initial=1))
