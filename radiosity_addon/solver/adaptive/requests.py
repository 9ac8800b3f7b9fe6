"""Requests: what a replicate can be asked for, as data, so that they reach another process.

``request.answer(replicate)`` does what is asked, wherever the replicate is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from ..direct.beams import split_beams
from ..gather.lighting import Lighting, Samples
from ..lights.context import build_context
from ..progress import silent
from ..receivers import Receivers
from ..sampling.guide import Guide, Learning
from ..scene import Scene
from ..transport.radiosity import Radiosity
from ..workers.parallel import Helpers
from .held_out import HeldOut
from .placed_receivers import placed
from .plan import Plan
from .processes import OpenHelpers
from .replicate import Replicate
from .requirements import SolverSettings, requirements_of
from .round_result import RoundResult, SolveFigures

Answer_co = TypeVar("Answer_co", covariant=True)


class Request(Protocol[Answer_co]):
    """Something to ask a replicate for. Can be pickled."""

    def answer(self, replicate: Replicate) -> Answer_co:
        """Do it."""


@dataclass(frozen=True)
class OpenScene:
    """An Opening: make the second replicate, of what ``sequence.solve`` is given."""

    scene: Scene
    receivers: Receivers
    settings: SolverSettings
    threads: int

    def opened(self, helpers: OpenHelpers | None) -> Replicate:
        """A new one, with ``helpers`` of its own."""
        replicate = build_replicate(
            self.scene, self.receivers, self.settings, self.threads, helpers
        )
        if helpers is not None:
            helpers.open(replicate.split, self.threads - 1)
        return replicate


@dataclass(frozen=True)
class SolveFor:
    """Radiosities for a plan."""

    plan: Plan

    def answer(self, replicate: Replicate) -> SolveFigures:
        """See ``Replicate.solve``."""
        return replicate.solve(self.plan)


@dataclass(frozen=True)
class TakeRadiosity:
    """Gather with these radiosities from now on."""

    radiosity: Radiosity

    def answer(self, replicate: Replicate) -> SolveFigures:
        """See ``Replicate.take``."""
        return replicate.take(self.radiosity)


@dataclass(frozen=True)
class GiveRadiosity:
    """The radiosities as they were solved."""

    def answer(self, replicate: Replicate) -> Radiosity:
        """The replicate's, which may take them again."""
        return replicate.taken


@dataclass(frozen=True)
class MoveTo:
    """Find the light of other receivers from now on, which are a ``tile``."""

    receivers: Receivers
    tile: int

    def answer(self, replicate: Replicate) -> None:
        """See ``Replicate.move_to``."""
        replicate.move_to(self.receivers, self.tile)


@dataclass(frozen=True)
class AddLight:
    """Light of the round ``step``."""

    direct: Samples
    gathered: Samples
    step: int
    guide: Guide | None
    learns: bool
    disputed: np.ndarray  # (k,) int: receivers whose gathered light is found anew, see ``disputed_receivers``

    def answer(self, replicate: Replicate) -> RoundResult:
        """See ``Replicate.add``."""
        if len(self.disputed):
            replicate.leave_out(self.disputed)
        return replicate.add(self.direct, self.gathered, self.step, self.guide, self.learns)


@dataclass(frozen=True)
class AddHeldOut:
    """Light that is ``held_out``, in the round ``step``."""

    held_out: HeldOut
    step: int

    def answer(self, replicate: Replicate) -> Lighting:
        """See ``Replicate.add_held_out``."""
        return replicate.add_held_out(self.held_out, self.step)


@dataclass(frozen=True)
class FollowMorePaths:
    """``factor`` times as many along the residual as so far."""

    factor: float

    def answer(self, replicate: Replicate) -> None:
        """See ``Replicate.follow_more_paths``."""
        replicate.follow_more_paths(self.factor)


@dataclass(frozen=True)
class Learn:
    """What the rays of the last round teach."""

    def answer(self, replicate: Replicate) -> Learning:
        """See ``Replicate.learn``."""
        return replicate.learn()


def build_replicate(
    scene: Scene, receivers: Receivers, settings: SolverSettings, threads: int,
    helpers: Helpers | None = None,
) -> Replicate:
    """The second replicate, from what ``sequence.solve`` is given."""
    context = build_context(scene, settings.seed, threads, silent, helpers=helpers)
    requirements = requirements_of(context, settings.passes)
    if requirements.reflected:
        context.scene_crossings.get()  # now: the first replicate counts the rays for both
    split = split_beams(context)
    mine = placed(context, receivers)
    return Replicate(1, context, split, mine, requirements, settings.target_error)
