"""Half: one of two independent halves, in which everything that is random is done twice.

The halves' mean is the result, their difference tells the error. Neither looks at the other, so the
second may live in another process: it is *asked*, works beside the first, and gives its *answers*
later.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..gather.lighting import Lighting, add_direct, add_gathered, no_light, place_on
from ..geometry.footprints import Footprints, build_footprints
from ..lights.context import Context, build_context
from ..progress import silent
from ..sampling.guide import Guide, Learning, clusters_of, start_learning
from ..transport.radiosity import Radiosity, solve_radiosity, without_reflection
from .plan import Plan
from .requirements import Requirements, requirements_of

# Edges of elements differ by half between the halves, so that few coincide: what the elements'
# size does to the light then shows in the difference of the halves.
SHARE_OF_ELEMENTS = (0.6, 1.35)
SHARE_OF_ROW_RAYS = (1.5, 0.75)  # so that the halves cost about the same


@dataclass(frozen=True)
class SolveFigures:
    """Figures of a half's linear system: unknowns, iterations, residual, seconds it took."""

    unknowns: int
    iterations: int
    residual: float
    seconds: float


@dataclass(frozen=True)
class RoundResult:
    """What a half knows after a round: all its light so far."""

    light: Lighting
    solved: SolveFigures


@dataclass
class Replicate:
    """One half of a bake: its own solve, and its own light at the receivers."""

    number: int  # 0 or 1
    context: Context
    footprints: Footprints
    needs: Requirements
    error: float  # relative, that the bake is for
    radiosity: Radiosity | None = None
    light: Lighting = field(init=False)
    lessons: list = field(default_factory=list)  # of the last round

    def __post_init__(self):
        self.light = no_light(self.footprints.count, self.context.channels)

    @cached_property
    def clusters(self) -> np.ndarray:
        """(count,) of receivers that learn together."""
        return clusters_of(*self.footprints.middle(), self.footprints.area)

    def solve(self, plan: Plan) -> SolveFigures:
        """Radiosities for ``plan``; what was gathered by others is forgotten."""
        context, size = self.context, int(plan.elements * SHARE_OF_ELEMENTS[self.number])
        rays = int(plan.row_rays * SHARE_OF_ROW_RAYS[self.number])
        if not self.needs.reflected:
            return self.take(without_reflection(context, size))
        key = (context.seed, 10, self.number, plan.elements)
        everyone = np.arange(self.footprints.count)
        place = place_on(self.footprints, everyone, plan.row_points, *key)
        return self.take(
            solve_radiosity(
                context, len(everyone), place, size, rays, plan.row_points, self.error, key
            )
        )

    def take(self, radiosity: Radiosity) -> SolveFigures:
        """Gather with these radiosities from now on."""
        self.radiosity = radiosity
        self.light.forget_gathered()
        return self._solved()

    def give(self) -> Radiosity:
        """The radiosities of now."""
        return self.radiosity

    def add(self, direct, gathered, step: int, guide: Guide | None, learn: bool) -> RoundResult:
        """Add light of the round ``step``: (owners, points of each) of explicit light, and (owners,
        rays of each), aimed by ``guide``."""
        self.lessons = []
        if self.needs.explicit:
            add_direct(self.context, self.footprints, self.light, *direct, step, self.number)
        if self.needs.rays:
            self.radiosity, self.lessons = add_gathered(
                self.context, self.footprints, self.light, self.radiosity, *gathered, step,
                self.number, guide=guide, learns=learn,
            )
        return RoundResult(self.light, self._solved())

    def learn(self) -> Learning:
        """What the rays of the last round teach."""
        learning = start_learning(self.clusters)
        for lesson in self.lessons:
            learning.add(lesson(learning) if callable(lesson) else lesson)
        return learning

    def _solved(self) -> SolveFigures:
        found = self.radiosity
        return SolveFigures(len(found.solution), found.iterations, found.residual, found.seconds)


def build_replicate(scene, receivers, settings, threads: int) -> Replicate:
    """The second half, from what ``sequence.solve`` is given."""
    context = build_context(scene, settings.seed, threads, silent)
    footprints = build_footprints(context.geometry, receivers)
    needs = requirements_of(context, settings.passes)
    if needs.reflected:
        context.crossings  # found now: the first half counts the rays for both
    return Replicate(1, context, footprints, needs, settings.target_error)


class ReplicateLost(RuntimeError):
    """The process of the second half has ended; the message says how and what to do."""


class LocalReplicate:
    """The second half in this process: it works when its answers are wanted."""

    rays, embree_seconds = 0, 0.0  # counted by the context that it shares with the first

    def __init__(self, half: Replicate):
        self._half = half
        self._asked: list[tuple] = []

    def ask(self, name: str, *words) -> None:
        """Call a method of the half."""
        self._asked.append((name, words))

    def answers(self) -> list:
        """What the methods returned that were asked for since the last answers."""
        asked, self._asked = self._asked, []
        return [getattr(self._half, name)(*words) for name, words in asked]
