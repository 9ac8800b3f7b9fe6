"""Replicate: one of two, independent in all that is random, so that everything is done twice.

Their mean is the result, their difference tells the error. Neither looks at the other, so the
second may live in another process (``second_replicate``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np

from ..direct.beams import Split
from ..gather.lighting import (
    Aim,
    Lighting,
    Samples,
    add_direct,
    add_gathered,
    no_light,
    points_on_footprints,
)
from ..gather.reflectors import Reflectors, find_reflectors, lit_as_rows
from ..gather.residual import Residuals, follow_residual, join_residuals
from ..lights.context import Context
from ..receivers import Receivers
from ..sampling.guide import Guide, Learning, Lesson, start_learning
from ..sampling.streams import Stream
from ..transport.radiosity import Radiosity
from ..transport.receiver_patches import ReceiverPatches
from ..transport.solve_patches import divided, solve_radiosity, without_reflection
from .correction import Correction, biased_elements, find_correction, irradiance_scale
from .held_out import HeldOut, HeldOutLight, no_held_out_light
from .placed_receivers import PlacedReceivers, placed
from .plan import Plan
from .relative_error import area_shares
from .requirements import Requirements
from .round_result import RoundResult, SolveFigures

# Shares [of the plan's elements] of the two replicates: edges differ by half, so that few coincide, and
# what the size of elements does to the light shows in the difference of the replicates.
SHARE_OF_ELEMENTS = (0.6, 1.35)
SHARE_OF_ROW_RAYS = (1.5, 0.75)  # shares [of the plan's rays of a row]: both replicates cost about the same
FEWEST_PATHS, MOST_PATHS = 2000, 40_000  # numbers [paths along the residual]: at the start, and in all
DIVISION_PATHS = 4000  # number [paths], at most, to find elements to divide
MORE_PATHS = 1.5  # factor [paths so far]: fewer more are not worth following
MEAN_ERROR = 0.25  # error [of that asked for] of the mean over paths: sets their number
MANY_ELEMENTS = 5_000  # number [elements at the start]: with more, none is divided, as it does not pay
FEW_ON_ELEMENTS = 0.01  # share [of rows' rays] on elements: with fewer, none is divided
MAX_DIVISIONS = 15  # number [rounds] of dividing elements that bring a bias
MOST_DIVIDED = 30  # factor [elements at the start]: with more, no further one is divided
SMALL_BIAS = 0.2  # bias [of the error asked for] of all elements: less is left to the correction


class PathsFor(IntEnum):
    """What paths along the residual are followed for: a word of the key of their random numbers."""

    CORRECTION = 0
    DIVISION = 1


@dataclass
class Replicate:
    """One replicate of a bake: its own solve, and its own light at the receivers."""

    number: int  # 0 or 1
    context: Context
    split: Split
    placed: PlacedReceivers
    requirements: Requirements
    error: float  # relative, that the bake is for
    taken: Radiosity | None = None  # as it was before reflectors were found
    radiosity: Radiosity | None = None  # that rays look up
    row_radiosity: np.ndarray | None = None  # (n, channels) of receivers' patches, by their rows
    reflectors: Reflectors | None = None  # with these radiosities
    light: Lighting = field(init=False)
    held_out: HeldOutLight | None = None
    residuals: Residuals | None = None  # of paths with these radiosities
    correction: Correction | None = None
    found_on_elements: float = 0.0  # relative bias, see ``RoundResult``
    share_of_elements: float = 0.0
    lessons: list[Lesson] = field(default_factory=list)  # of the last round

    def __post_init__(self) -> None:
        self.light = no_light(self.placed.count, self.context.channels)

    def solve(self, plan: Plan) -> SolveFigures:
        """Radiosities for ``plan``; what was gathered by others is forgotten."""
        self.reflectors, context = None, self.split.reflected
        size = int(plan.elements * SHARE_OF_ELEMENTS[self.number])
        rays = int(plan.row_rays * SHARE_OF_ROW_RAYS[self.number])
        if not self.requirements.reflected:
            return self.take(without_reflection(context, size))
        key = (context.seed, Stream.SOLVE, self.number, plan.elements)
        everyone = np.arange(self.placed.footprints.count)
        sample_points = points_on_footprints(self.placed.footprints, everyone, plan.row_points, *key)
        own = replace(plan, elements=size, row_rays=rays)
        radiosity = solve_radiosity(
            context, len(everyone), sample_points, self.placed.patches(plan.elements), own, self.error, key
        )
        return self.take(self._without_bias(radiosity, size, key))

    def _without_bias(self, radiosity: Radiosity, size: int, key: tuple[int, ...]) -> Radiosity:
        """The radiosity solved again with elements divided that bring the receivers a bias."""
        many = radiosity.patches.elements.count > MANY_ELEMENTS
        if many or radiosity.share_of_elements() < FEW_ON_ELEMENTS:
            return radiosity
        for step in range(MAX_DIVISIONS):
            if radiosity.patches.elements.count > MOST_DIVIDED * size:
                break
            residuals = self._followed(radiosity, PathsFor.DIVISION, DIVISION_PATHS)
            chosen, bias = self._biased(radiosity, residuals)
            if bias < SMALL_BIAS * self.error:
                break
            radiosity = divided(
                self.split.reflected, radiosity, chosen, residuals.visits.places, (*key, 15, step)
            )
        return radiosity

    def _biased(self, radiosity: Radiosity, residuals: Residuals) -> tuple[np.ndarray, float]:
        """Elements worth dividing, and the bias they bring: see ``biased_elements``."""
        places, patches = residuals.visits.places, radiosity.patches
        return biased_elements(
            residuals,
            irradiance_scale(residuals, self._regions(residuals)),
            patches.of(places.entry) - patches.first,
            self.context.geometry.at(places.triangle, places.uv),
        )

    def _regions(self, residuals: Residuals) -> list[np.ndarray]:
        return self.placed.regions(len(residuals.paths.owner))

    def _followed(self, radiosity: Radiosity, purpose: PathsFor, most: int) -> Residuals:
        """As many paths along the residual as the error asked for wants, at ``most``. Few tell too small a deviation
        where rare ones have most of it: it is measured again with each further lot."""
        residuals = self._more_paths(radiosity, purpose, FEWEST_PATHS, 0)
        while True:
            scale = irradiance_scale(residuals, self._regions(residuals))
            deviation = float((residuals.paths.lack.mean(axis=1) / scale).std())
            wanted = int(min((deviation / (MEAN_ERROR * self.error)) ** 2, most))
            paths = len(residuals.paths.owner)
            if wanted < MORE_PATHS * paths:
                return residuals
            more = self._more_paths(radiosity, purpose, wanted - paths, paths)
            residuals = join_residuals([residuals, more])

    def _more_paths(self, radiosity: Radiosity, purpose: PathsFor, paths: int, before: int) -> Residuals:
        """Further ``paths`` after those ``before``. Every purpose and every division of the surface has
        random numbers of its own: noise that chose elements is not measured again with them."""
        elements = radiosity.patches.elements.count
        context, radiosity = lit_as_rows(self.reflectors, self.split.reflected, radiosity)
        key = (self.context.seed, Stream.RESIDUAL, purpose, elements, before, self.number, self.placed.tile)
        return follow_residual(
            context, self.placed.footprints, radiosity, paths, *key, direct=self.requirements.direct
        )

    def take(self, radiosity: Radiosity) -> SolveFigures:
        """Gather with these radiosities from now on."""
        self.taken = radiosity
        self.reflectors, radiosity = find_reflectors(
            self.split.reflected, radiosity, (self.context.seed, Stream.REFLECTORS, self.number)
        )
        self.radiosity = radiosity
        self.row_radiosity = radiosity.reflected[: radiosity.patches.first].copy()
        self.light.forget_gathered()
        self.residuals = self.correction = self.held_out = None
        self.found_on_elements, reflects = 0.0, radiosity.transport is not None
        self.share_of_elements = radiosity.share_of_elements() if reflects else 0.0
        return self._figures()

    def move_to(self, receivers: Receivers, tile: int) -> None:
        """Find the light of other receivers from now on, with the radiosities of now and what has been
        gathered where those before are patches. ``tile``: see ``PlacedReceivers``."""
        if self.residuals is not None:
            self._use_gathered()
        self.placed, self.lessons = placed(self.context, receivers, tile), []
        self.residuals, self.correction, self.found_on_elements = None, None, 0.0
        self.light = no_light(self.placed.count, self.context.channels)

    def _key(self, *key: int) -> tuple[int, ...]:
        """Of random numbers: of this replicate and tile."""
        return (*key, self.number, *([self.placed.tile] if self.placed.tile else []))

    def follow_more_paths(self, factor: float) -> None:
        """Follow ``factor`` times as many paths as so far."""
        paths = len(self.residuals.paths.owner)
        more = int(min(paths * (factor - 1), MOST_PATHS))
        more = self._more_paths(self.radiosity, PathsFor.CORRECTION, more, paths)
        self.residuals = join_residuals([self.residuals, more])
        self._correct()

    def _correct(self) -> None:
        """Find the correction, and the part of the bias that elements bring."""
        regions, light = self._regions(self.residuals), self._gathered_light()
        self.correction = find_correction(self.residuals, regions, *light)
        on_elements = self.residuals.visits.places.entry >= self.radiosity.patches.cells
        if on_elements.any():
            theirs = find_correction(self.residuals.of_visits(on_elements), regions, *light)
            self.found_on_elements = theirs.found

    def _gathered_light(self) -> tuple[np.ndarray, np.ndarray]:
        """(R, channels) mean irradiance that rays brought to receivers, and (R,) these' shares of the surface."""
        return self.light.bounced / np.maximum(self.light.rays, 1), area_shares(self.placed.footprints.area)

    def add(
        self, direct: Samples, gathered: Samples, step: int, guide: Guide | None, learn: bool
    ) -> RoundResult:
        """Add light of the round ``step``: [(owners, points of each)] of explicit light, and
        [(owners, rays of each)], aimed by ``guide``."""
        self.lessons = []
        if self.residuals is not None:
            self._use_gathered()
        if self.requirements.explicit:
            for part in direct:
                add_direct(self.split, self.placed.footprints, self.light, *part, *self._key(step))
        if self.requirements.rays:
            split, radiosity = self._for_rays()
            radiosity, self.lessons = add_gathered(
                split, self.placed.footprints, self.light, radiosity, gathered,
                *self._key(step), aim=Aim(guide, learn),
            )
            self.radiosity = replace(radiosity, patches=self.radiosity.patches)
        if self.requirements.reflected and self.residuals is None:
            self._use_gathered()
            self.residuals = self._followed(self.radiosity, PathsFor.CORRECTION, MOST_PATHS)
            self._correct()
        return self.now()

    def _for_rays(self) -> tuple[Split, Radiosity]:
        """What rays look up, reflectors sampled as lights."""
        if self.reflectors is None:
            return self.split, self.radiosity
        return self.reflectors.applied(self.split, self.radiosity)

    def add_held_out(self, more: HeldOut, step: int) -> Lighting:
        """Add held-out light in the round ``step``, and give all there is."""
        if self.held_out is None:
            self.held_out = no_held_out_light(self.placed.footprints, more.chosen, self.context.channels)
        radiosity = self.held_out.add(*self._for_rays(), more, *self._key(step))
        self.radiosity = replace(radiosity, patches=self.radiosity.patches)
        return self.held_out.corrected(self.light)

    def leave_out(self, disputed: np.ndarray) -> None:
        """Let no ray read what is known of the receivers ``disputed`` (k,) int, and forget what these gathered."""
        if self._own_patches is None:
            return
        patches = self.radiosity.patches.without(disputed)
        self.radiosity = replace(self.radiosity, patches=patches)
        self.reflectors = self.reflectors and self.reflectors.with_patches(patches)
        self.light.forget_gathered(disputed)
        if self.held_out is not None:
            self.held_out.forget_gathered(disputed)

    def _use_gathered(self) -> None:
        """Let rays read, where they end on receivers, the mean of what the rows' rays brought and of what
        has been gathered there: more rays, one reflection later."""
        if self._own_patches is None or not self.requirements.reflected:
            return
        light, turned = self.light, self.placed.footprints.turned()
        known = light.rays[:, 0] > 0
        if turned is not None:
            known &= ~turned
        some = np.flatnonzero(known)
        arriving = (light.direct[some] - light.beams[some]) / np.maximum(light.points[some], 1)
        arriving += (light.bounced[some] + light.first[some]) / light.rays[some]
        self.radiosity = self.radiosity.with_gathered(
            self.row_radiosity, some, self.placed.reflectance[some] * arriving, light.rays[some, 0]
        )

    @property
    def _own_patches(self) -> ReceiverPatches | None:
        """Those of the receivers; None where there are none, or of others only."""
        own = self.radiosity.patches.receivers
        return own if own is not None and own.are_of(self.placed.footprints) else None

    @property
    def paths(self) -> int:
        """Along the residual so far."""
        return 0 if self.residuals is None else len(self.residuals.paths.owner)

    def now(self) -> RoundResult:
        """All light so far, with what corrects its bias."""
        uncorrected = None
        if self.correction is not None:
            self.light.correction[:], uncorrected = self.correction.share(*self._gathered_light())
        return RoundResult(
            self.light, self._figures(), uncorrected, self.found_on_elements, self.share_of_elements
        )

    def learn(self) -> Learning:
        """What the rays of the last round teach."""
        learning = start_learning(self.placed.clusters)
        for lesson in self.lessons:
            learning.add(lesson)
        return learning

    def _figures(self) -> SolveFigures:
        found = self.radiosity
        return SolveFigures(len(found.solution), found.iterations, found.residual, found.seconds)
