"""The sequence: Scene and receivers in, Solution out. The algorithm, in order.

Everything that is random is done twice, in two independent replicates (``replicate``) whose mean is
the result: their difference tells the error. They work in ``rounds`` until the error asked for is met.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from .adaptive.clock import Clock
from .adaptive.error_estimator import ErrorEstimator
from .adaptive.estimate import Estimate, Surface
from .adaptive.held_out import held_out_receivers
from .adaptive.placed_receivers import placed
from .adaptive.plan import Plan, make_plan
from .adaptive.replicate import Replicate
from .adaptive.requirements import Requirements, SolverSettings, requirements_of
from .adaptive.round_result import SolveFigures
from .adaptive.rounds import Rounds
from .adaptive.second_replicate import (
    LocalReplicate,
    RemoteReplicate,
    SecondReplicate,
)
from .adaptive.solve_cache import SolveCache, scene_key
from .check import check_scene
from .direct.beams import split_beams
from .direct.line_of_sight import LineOfSight
from .energy import energy_balance
from .expected import ProcessLost
from .filtering.graph import build_graph
from .filtering.lattice_weights import build_lattices
from .geometry.triangles import rounding_warning
from .lights.context import Context, build_context
from .materials.region_means import footprint_means
from .passes import Pass
from .progress import Progress, silent
from .receivers import Projection, Receivers
from .sampling.guide import USEFUL
from .scene import Scene
from .solution import Solution, Statistics
from .workers.parallel import thread_count

LATE = 1.5  # factor [of the time limit]: a solve that takes longer gets a warning


@np.errstate(under="ignore")  # light that vanishes beside the brightest is nothing
def solve(
    scene: Scene, receivers: Receivers, settings: SolverSettings, progress: Progress | None = None,
    project: Projection | None = None, cache: SolveCache | None = None,
    beside: RemoteReplicate | None = None,
) -> Solution:
    """Light at the receivers, to the relative error ``settings.target_error``.

    ``project`` tells where the error is judged, for colors that are means over receivers; None
    judges the receivers themselves. ``progress`` may raise to stop. ``cache`` has solves to use
    again and takes those made. ``beside`` does the second replicate in another process; None does
    both here. The result is the same. Raises Refused for a scene that cannot be solved.

    A cube that glows inside with radiance 1 and reflects half: 1 + 1/2 + 1/4 + ... = 2 everywhere.

    >>> from radiosity_addon.settings import Settings
    >>> from radiosity_addon.solver.fields import Constant
    >>> from radiosity_addon.solver.scene import Material
    >>> from radiosity_addon.solver.solution import compose
    >>> corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    >>> quads = [(4, 6, 2, 0), (3, 7, 5, 1), (1, 5, 4, 0), (6, 7, 3, 2), (2, 3, 1, 0), (5, 7, 6, 4)]
    >>> triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.int32)
    >>> number, none = np.arange(12, dtype=np.int32), np.zeros(12, np.int32)
    >>> glow = Material("Glow", Constant(np.full(3, 0.5)), Constant(np.ones(3)))
    >>> scene = Scene(corners, triangles, none, none, (glow,), ("Cube",))
    >>> whole = np.tile([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], (12, 1, 1))  # a receiver a triangle
    >>> receivers = Receivers(12, number, number, whole, np.zeros(12, bool))
    >>> found = solve(scene, receivers, Settings(error=0.01, threads=1))
    >>> light = compose(found, Settings().passes)
    >>> light.shape, bool(np.allclose(light, 2, rtol=0.01))
    ((12, 3), True)
    """
    clock = Clock()
    context = open_scene(scene, receivers, settings, progress, beside)
    return solve_opened(context, receivers, settings, Options(project, cache, beside), clock)


@dataclass(frozen=True)
class Options:
    """Options of a solve: see ``solve``. ``requirements``: the light that is found; None: what the
    passes ask for and the scene can give. ``useful``: rays are guided where that divides the variance by this at least."""

    project: Projection | None = None
    cache: SolveCache | None = None
    beside: RemoteReplicate | None = None
    requirements: Requirements | None = None
    useful: float = USEFUL


@np.errstate(under="ignore")
def solve_opened(
    context: Context, receivers: Receivers, settings: SolverSettings,
    options: Options = Options(), clock: Clock | None = None,
) -> Solution:
    """The same of a scene that ``open_scene`` has opened. ``clock`` started before that; None: now."""
    opened = begin(context, receivers, settings, options, clock or Clock())
    estimate, figures = opened.rounds.run(opened.plan)
    reached = Outcome(estimate.error, estimate.error_95, figures)
    statistics = statistics_of(opened, reached, settings)
    return solution_of(context, opened.rounds.estimator, estimate, statistics)


@dataclass(frozen=True)
class OpenSolve:
    """A solve that is ready for its first round, the plan of that, and warnings of a lost process."""

    rounds: Rounds
    plan: Plan
    lost: tuple[str, ...]


@dataclass(frozen=True)
class Outcome:
    """The relative error that was reached, as estimated, and what each replicate solved."""

    error: float
    error_95: float
    figures: list[SolveFigures]


def begin(
    context: Context, receivers: Receivers, settings: SolverSettings, options: Options, clock: Clock
) -> OpenSolve:
    """A solve with both replicates, ready for its first round. The arguments are those of ``solve_opened``."""
    scene = context.scene
    threads, cache = thread_count(settings.threads), options.cache
    beside = None if threads == 1 else options.beside
    if beside is not None:
        beside.open(scene, receivers, settings, threads - context.threads)
    requirements = options.requirements or requirements_of(context, settings.passes)
    mine, split = placed(context, receivers), split_beams(context)
    if beside is not None and beside.helpers is not None:
        beside.helpers.open(split, context.threads - 1)
    first = Replicate(0, context, split, mine, requirements, settings.target_error)
    estimator = estimator_of(first, settings.passes, options.project, threads)
    corners = options.project is not None
    plan = make_plan(settings.target_error, receivers.count, bool(estimator.neighborhoods), corners)
    estimator = replace(estimator, enough=plan.enough)
    if corners:
        estimator = replace(estimator, held_out=held_out_receivers(estimator.surface.share))
    if cache is not None:
        cache.begin(scene_key(scene, receivers, settings.seed))
    clock.lap("elements")
    deadline = None if settings.time_limit is None else clock.start + settings.time_limit
    second, lost = _second_replicate(beside, first)
    rounds = Rounds(first, second, estimator, deadline, clock, cache, useful=options.useful)
    return OpenSolve(rounds, plan, lost)


def solution_of(
    context: Context, estimator: ErrorEstimator, estimate: Estimate, statistics: Statistics
) -> Solution:
    """The light at the receivers that were judged, in the scene's units."""
    unit = context.unit * estimate.unit
    return Solution(
        emission=_three(estimator.surface.emission * context.unit),
        direct=_three(estimate.direct.astype(float) * unit),
        indirect=_three(estimate.indirect.astype(float) * unit),
        diffuse=_three(estimator.surface.diffuse),
        statistics=statistics,
    )


def statistics_of(opened: OpenSolve, reached: Outcome, settings: SolverSettings) -> Statistics:
    """The figures of the report, at the end."""
    rounds, figures = opened.rounds, reached.figures
    context, second = rounds.first.context, rounds.second
    energy = energy_balance(context)
    rounds.clock.lap("solve")
    return Statistics(
        elements=sum(replicate.unknowns for replicate in figures) // 2,
        rays=context.rays + second.rays,
        iterations=max(replicate.iterations for replicate in figures),
        residual=max(replicate.residual for replicate in figures),
        target_error=settings.target_error,
        estimated_error=reached.error,
        error_95=reached.error_95,
        energy=energy,
        warnings=(
            *opened.lost, *_warnings(context, reached, settings),
            *late_warning(sum(rounds.clock.laps.values()), settings.time_limit),
        ),
        seconds={**rounds.clock.laps, "embree": context.embree_seconds + second.embree_seconds},
    )


def open_scene(
    scene: Scene, receivers: Receivers, settings: SolverSettings, progress: Progress | None = None,
    beside: RemoteReplicate | None = None,
) -> Context:
    """The scene made ready for rays, checked, with the threads that are left where ``beside`` does
    the second replicate. Raises Refused for a scene that cannot be solved."""
    check_scene(scene, receivers)
    threads, helpers = thread_count(settings.threads), None
    if beside is not None:
        threads, helpers = (threads + 1) // 2, beside.helpers
    if helpers is not None:
        helpers.leave()  # the scene before
    return build_context(
        scene, settings.seed, threads, progress or silent, helpers=helpers
    )


def _second_replicate(
    beside: RemoteReplicate | None, first: Replicate
) -> tuple[SecondReplicate, tuple[str, ...]]:
    """The second replicate, and warnings; it is in this process where there is no other, or the other has ended."""
    lost = ()
    if beside is not None:
        try:
            beside.answers()
            return beside, lost
        except ProcessLost as error:
            lost = (f"{error}; the bake was done by one process, which takes longer",)
    return LocalReplicate(replace(first, number=1)), lost


def _three(values: np.ndarray) -> np.ndarray:
    """(count, 3) of values (count, 3) or (count, 1)."""
    return np.repeat(values, 3 // values.shape[1], axis=1)


def estimator_of(
    first: Replicate, passes: tuple[Pass, ...], project: Projection | None, threads: int,
    brightness: float | None = None,
) -> ErrorEstimator:
    """The estimator of the error at the replicate's receivers. ``brightness``: see ``ErrorEstimator``."""
    context, footprints, receivers = first.context, first.placed.footprints, first.placed.receivers
    position, normal = footprints.middle()
    walls = first.placed.walls
    if receivers.grid is not None:
        facing, rounded = footprints.facing()
        neighborhoods = build_lattices(
            receivers.grid, position, facing, threads, walls=walls, rounded=rounded
        )
    else:
        neighborhoods = build_graph(position, normal, footprints.area, threads, walls)
    sees = LineOfSight(context, footprints, position, normal).sees_all_of
    emission = footprint_means(lambda regions: context.mean_emission(regions)[0], footprints)
    surface = Surface(first.placed.diffuse, emission, footprints.area)
    return ErrorEstimator(surface, neighborhoods, passes, threads, sees, project, brightness)


def late_warning(seconds: float, limit: float | None) -> list[str]:
    """A warning where ``seconds`` of solving are far above the ``limit``: all receivers get their first rays, whatever
    it is."""
    if limit is None or seconds < LATE * limit:
        return []
    return [
        f"solving took {seconds:.1f} s, above the time limit of {limit:g} s: every texel or face gets its first "
        "rays, whatever the limit; lower the resolution, or bake fewer objects"
    ]


def _warnings(context: Context, reached: Outcome, settings: SolverSettings) -> Iterator[str]:
    """What the user should know of the numbers."""
    rounded = rounding_warning(context.scene, context.geometry)
    if rounded:
        yield rounded
    if reached.error > settings.target_error:
        reason = " within the time limit" if settings.time_limit else ""
        yield (
            f"the error asked for, {100 * settings.target_error:.3g} %, was not reached{reason}: "
            f"estimated {100 * reached.error:.3g} %"
        )
    residual = max(replicate.residual for replicate in reached.figures)
    if residual > 0.1 * settings.target_error:
        yield (
            f"the linear system was solved to a residual of {residual:.2g} only: reflectances are too close to 1 "
            "for a scene that light cannot leave; lower them"
        )
