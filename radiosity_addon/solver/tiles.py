"""Tiles: receivers that come part by part, so that memory does not grow with their number.

A *survey*, coarse receivers all over the surface, comes first: it is solved like any bake. Its
patches and elements are what the rays of all tiles end on, and its mean brightness is what the
errors of all are judged against. Then each tile is gathered, judged and smoothed, and forgotten.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from .adaptive.clock import Clock
from .adaptive.estimate import Estimate
from .adaptive.plan import make_plan
from .adaptive.relative_error import bound_of_most
from .adaptive.requests import MoveTo
from .adaptive.requirements import SolverSettings
from .adaptive.round_result import SolveFigures
from .adaptive.second_replicate import RemoteReplicate
from .adaptive.solve_cache import SolveCache
from .lights.context import Context
from .receivers import Receivers
from .sequence import Options, Outcome, begin, estimator_of, solution_of, statistics_of
from .solution import Solution, Statistics
from .workers.parallel import thread_count

SURVEY = 0.2  # share [of the time limit] for the survey, at most


class TiledSolve:
    """One solve, and light at tiles of receivers one after the other."""

    @np.errstate(under="ignore")
    def __init__(
        self, context: Context, survey: Receivers, settings: SolverSettings,
        cache: SolveCache | None = None, beside: RemoteReplicate | None = None,
    ) -> None:
        """Solve the ``survey``; the arguments are as in ``sequence.solve_opened``."""
        self._settings, self._context, clock = settings, context, Clock()
        self._open = begin(context, survey, settings, Options(None, cache, beside), clock)
        limit = settings.time_limit
        deadline = None if limit is None else clock.start + SURVEY * limit
        rounds = replace(self._open.rounds, deadline=deadline)
        estimate, self._figures = rounds.run(self._open.plan)
        self._brightness = estimate.brightness
        self._tiles: list[tuple[float, float, np.ndarray]] = []  # area, squared error, bounds

    @np.errstate(under="ignore")
    def light_of(self, tile: Receivers, share: float, smaller: int) -> Solution:
        """Light at one tile of receivers, whose part of those that are left is ``share``, in (0, 1];
        all tiles have about ``smaller`` receivers. The statistics are empty."""
        rounds, settings = self._open.rounds, self._settings
        first, second = rounds.first, rounds.second
        request = MoveTo(tile, len(self._tiles) + 1)
        second.ask(request)
        request.answer(first)
        threads = thread_count(settings.threads)
        estimator = estimator_of(first, settings.passes, None, threads, self._brightness)
        second.answers()
        rounds.clock.lap("elements")
        plan = make_plan(settings.target_error, smaller, bool(estimator.neighborhoods))
        mine = replace(
            rounds, estimator=estimator, deadline=self._deadline(share), cache=None, radiosity_given=True
        )
        estimate, figures = mine.run(plan)
        self._note(estimate, figures)
        return solution_of(self._context, estimator, estimate, Statistics())

    def skip(self) -> None:
        """Do not count the time since the last light as the solver's."""
        self._open.rounds.clock.skip()

    def _deadline(self, share: float) -> float | None:
        """When a tile that is such a ``share`` of the rest must be done."""
        last = self._open.rounds.deadline
        now = time.perf_counter()
        return None if last is None else now + share * max(last - now, 0.0)

    def _note(self, estimate: Estimate, figures: list[SolveFigures]) -> None:
        area = float(self._open.rounds.first.placed.footprints.area.sum())
        self._tiles.append((area, estimate.error**2, estimate.bounds))
        self._figures = figures

    def statistics(self) -> Statistics:
        """The figures of all tiles so far: the squared error is their mean by area."""
        area, square, bounds = (np.array(column) for column in zip(*self._tiles))
        share = area / (area.sum() or 1.0)
        each = bounds.shape[1]
        reached = Outcome(
            error=float(np.sqrt(share @ square)),
            error_95=bound_of_most(np.repeat(share / each, each), bounds.reshape(-1, 1)),
            figures=self._figures,
        )
        return statistics_of(self._open, reached, self._settings)
