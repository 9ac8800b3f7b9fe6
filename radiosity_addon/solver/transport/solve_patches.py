"""Solve patches: one independent solve of the surface, from rays to radiosities of patches.

Elements are divided where the direct light on them varies and receivers look: solve for what
matters, where it matters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..elements.discontinuities import MAX_GROWTH, split_at_discontinuities
from ..elements.elements import build_elements, refine
from ..geometry.clusters import labels
from ..lights.context import Context
from ..sampling.points import PointSampler
from ..scene import Scene
from ..workers.parallel import ranges
from .covered import lit_unlike_cover
from .emission import emission_to_find
from .lit_patches import LitPatches, brightness_and_noise, light_patches, light_receivers
from .patches import Patches
from .places import Places, no_places, places_hit
from .radiosity import Radiosity, solve_rows
from .rays import shared_directions, shoot
from .receiver_patches import ReceiverPatches
from .rows import RowSamples, light_patches_met, trace_transport

SEEDS_PER_ELEMENT = 40  # number [rays of receivers for each element] that find which elements matter to them
SEEDS_PER_CHUNK = 2048  # number [receivers] of a chunk
SEED_RAYS = 16  # number [rays] of each receiver that takes part in this
MAX_REFINEMENTS = 6  # number [rounds] of dividing elements on which direct light varies
# Deviation [of the error asked for, relative to the mean light]: rays that end on a patch whose direct
# light deviates by more from its mean go onward, as no one value stands for it.
VARIED = 100.0
# Radiosity [of the error asked for, relative to the mean light]: rays go onward from a brighter patch where the choice
# among many lights makes so much noise, as beside a lamp of many faces, that it hides how much the light varies
# inside; and number [points of a patch] by which its brightness and that noise are measured.
BRIGHT, BRIGHT_POINTS = 300.0, 16
HALVINGS = 2  # number [halvings of its edges] of an element that brings a bias


class SolvePlan(Protocol):
    """How fine a solve is."""

    @property
    def elements(self) -> int:
        """About how many there are at the start."""

    @property
    def row_rays(self) -> int:
        """Rays of each element's row."""

    @property
    def row_points(self) -> int:
        """Points on each element that these start from, and that are lit."""

    @property
    def patch_rays(self) -> int:
        """The same of each patch of a receiver,"""

    @property
    def patch_points(self) -> int:
        """and its points."""


def solve_radiosity(
    context: Context, receivers: int, sample_points: PointSampler, own: ReceiverPatches | None,
    plan: SolvePlan, tolerance: float, key: tuple[int, ...],
) -> Radiosity:
    """Solve with the patches ``own`` of receivers, and on about ``plan.elements`` elements elsewhere.

    ``sample_points`` gives Points of the ``receivers``, whose rays find the elements.
    """
    target, per = plan.elements, plan.row_points
    elements = build_elements(context.geometry, _groups(context.scene), target)
    patches = Patches(elements, own)
    places, all_places = _seeds(context, patches, receivers, sample_points, target, key)
    known, other_lit = [], None
    if own is not None:
        lit = light_receivers(context, own.footprints, plan.patch_points, (*key, 9))
        known.append((lit, plan.patch_rays))
        varied, other_lit = varied_patches(context, own, plan, tolerance, key)
        patches = replace(patches, receivers=own.without(varied))
    share = len(places.entry) / max(all_places, 1)
    if len(places.entry):
        elements = split_at_discontinuities(context, elements, target, tolerance)
        patches = replace(patches, elements=elements)
        places = places.on(patches)
        places = places.take(patches.somewhere(places.entry))
        patches, lit = _refined(context, patches, places, share, plan, tolerance, key)
        known.append((lit, plan.row_rays))
    patches = patches.measured(context.geometry)
    samples = RowSamples(plan.row_rays, per, plan.patch_rays, plan.patch_points)
    transport = trace_transport(context, patches, known, samples, (*key, 12))
    return replace(solve_rows(context, patches, transport, tolerance), other_lit=other_lit)


def varied_patches(
    context: Context, own: ReceiverPatches, plan: SolvePlan, tolerance: float, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(P,) bool: patches of receivers in which direct light varies by much; and what they reflect of it (P, channels). This is
    measured at other points than those that light the rows: if it were the same ones, patches whose bright parts no point met
    would be kept, and the patches that rays end on would be too dark. Bright patches where noise hides the variation count as well."""
    lit = light_receivers(context, own.footprints, plan.patch_points, (*key, 16))
    unit = tolerance * float((lit.share @ lit.lit).mean())
    varied, bright = lit.deviation > VARIED * unit, np.flatnonzero(lit.lit.mean(axis=1) > VARIED * unit)
    if len(bright):
        brightness, noise = brightness_and_noise(
            context, own.footprints, bright, BRIGHT_POINTS, (*key, 17)
        )
        varied[bright] |= (brightness > BRIGHT * unit) & (noise > VARIED * unit)
    varied[lit_unlike_cover(context, own.footprints, tolerance, (*key, 18))] = True
    return varied, lit.lit.astype(np.float32)


def extended(
    context: Context, radiosity: Radiosity, places: Places, key: tuple[int, ...]
) -> Radiosity:
    """The radiosity with rows for the patches that ``places`` lie on, and for what their rays meet.

    No ray of the rows before met any of these patches, so that the radiosities known before stay as they are.
    """
    patches, before = radiosity.patches, radiosity.transport
    first = before.count
    known = light_patches_met(context, patches, places, before.samples, (*key, 11))
    more = trace_transport(context, patches, known, before.samples, (*key, 12), before.row)
    found = solve_rows(
        context, patches, more.numbered_from(first), radiosity.tolerance, radiosity
    )
    return replace(
        radiosity,
        reflected=radiosity.reflected + found.reflected,
        unknown=patches.table(more.row == -1, False),
        transport=replace(more, blocks=before.blocks + more.blocks),
        solution=np.concatenate([radiosity.solution, found.solution]),
        iterations=max(radiosity.iterations, found.iterations),
        residual=max(radiosity.residual, found.residual),
        seconds=radiosity.seconds + found.seconds,
    )


def divided(
    context: Context, radiosity: Radiosity, chosen: np.ndarray, places: Places,
    key: tuple[int, ...],
) -> Radiosity:
    """The radiosity solved again with the elements ``chosen`` (k,) int divided; their parts are lit where ``places``
    lie on them."""
    before, patches = radiosity.transport, radiosity.patches
    elements = patches.elements
    parts = chosen
    for _ in range(HALVINGS):
        first = elements.count
        elements = refine(context.geometry, elements, parts)
        parts = np.arange(first, elements.count)
    inside = np.isin(patches.element_of(patches.of(places.entry)), chosen)
    known = []
    for block in before.blocks:
        kept = ~np.isin(patches.element_of(block.patches.patch), chosen)
        known.append((block.patches.take(np.flatnonzero(kept)), block.rays))
    patches = replace(patches, elements=elements).measured(context.geometry)
    places = places.take(np.flatnonzero(inside)).on(patches)
    places = places.take(patches.somewhere(places.entry))
    known += light_patches_met(context, patches, places, before.samples, (*key, 13))
    transport = trace_transport(context, patches, known, before.samples, (*key, 14))
    anew = solve_rows(context, patches, transport, radiosity.tolerance)
    return replace(anew, other_lit=radiosity.other_lit)


def without_reflection(context: Context, target: int) -> Radiosity:
    """A table for rays where only emitted light counts, none that is reflected: no unknowns, no rows."""
    patches = Patches(build_elements(context.geometry, _groups(context.scene), target))
    nothing = np.zeros((patches.entries, context.channels), np.float32)
    emitted, known = emission_to_find(context, patches), np.zeros(len(nothing), bool)
    return Radiosity(patches, nothing, *emitted, known, None, nothing[:0], 0, 0.0, 0.0, 1.0)


def _seeds(
    context: Context, patches: Patches, receivers: int, sample_points: PointSampler, target: int,
    key: tuple[int, ...],
) -> tuple[Places, int]:
    """Where rays from a sample of the receivers meet elements, and how many met the surface."""
    wanted = int(np.ceil(SEEDS_PER_ELEMENT * target / SEED_RAYS))
    some = np.unique((np.arange(wanted) * (receivers / wanted)).astype(int))
    work = _SeedChunk(context, patches, sample_points, some, key)
    parts = context.map_chunks(work, ranges(len(some), SEEDS_PER_CHUNK), "elements")
    places = Places.join(parts or [no_places()])
    return places.take(places.entry >= patches.cells), len(places.entry)


@dataclass(frozen=True)
class _SeedChunk:
    """Places that rays of a slice of receivers, ``some`` (n,) int, meet."""

    context: Context
    patches: Patches
    sample_points: PointSampler
    some: np.ndarray
    key: tuple[int, ...]

    def __call__(self, chunk: slice) -> Places:
        points = self.sample_points(self.some[chunk], 0)
        directions = shared_directions(points, SEED_RAYS, *self.key, 10, chunk.start)
        shot = shoot(self.context, self.patches, points, directions)
        return Places.join([places_hit(part, self.patches) for part in shot.met])


def _refined(
    context: Context, patches: Patches, places: Places, part: float, plan: SolvePlan,
    tolerance: float, key: tuple[int, ...],
) -> tuple[Patches, LitPatches]:
    """The patches, with elements divided where direct light varies; and, lit, those sides of elements that receivers
    see. The ``places`` on elements are the share ``part`` of all places that rays met."""
    target, per = plan.elements, plan.row_points
    known = light_patches(context, places, patches.of(places.entry), per, (*key, 11))
    mean = float((known.share @ known.lit).mean())
    for step in range(MAX_REFINEMENTS):
        worth = part * known.share * known.deviation > tolerance * mean / np.sqrt(target)
        worth &= known.share * len(places.entry) > 2
        chosen = np.unique(patches.element_of(known.patch[worth]))
        if len(chosen) == 0 or patches.elements.count > MAX_GROWTH * target:
            break
        kept = ~np.isin(patches.element_of(known.patch), chosen)
        patches = replace(patches, elements=refine(context.geometry, patches.elements, chosen))
        places = places.on(patches)
        known = known.take(np.flatnonzero(kept))
        patch = patches.of(places.entry)
        fresh = np.flatnonzero(~np.isin(patch, known.patch))
        lit = light_patches(context, places.take(fresh), patch[fresh], per, (*key, 11, step))
        lit = replace(lit, share=lit.share * (len(fresh) / len(patch)))
        known = LitPatches.join([known, lit])
    return patches, known


def _groups(scene: Scene) -> np.ndarray:
    """(n_triangles,) int64: the same number for the same object and material, without gaps: ten
    thousand of either would make a table of all pairs too large."""
    return labels(scene.object, scene.material)
