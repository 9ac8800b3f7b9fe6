"""Layout: where the light is wanted, from the targets of a Job. Imports no bpy.

For large images this takes longer than reading the scene, so it belongs to the solver's side.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..bake.cell_normals import shading_of
from ..bake.faces import face_receivers, receiver_budget, triangle_areas
from ..bake.sourceless import sourceless_share, sourceless_warning
from ..bake.texels import overlapping_texels, texel_receivers
from ..bake.uv_cover import missed_shares, missed_warning
from ..bake.windows import full_rect
from ..settings import Domain, Target
from ..solver.expected import Refused
from ..solver.progress import Progress
from ..solver.receivers import Receivers, concatenate, slice_receivers
from ..solver.workers.parallel import map_chunks
from .job import Job
from .leave_out import NO_TEXEL

PHASE = "receivers"


@dataclass(frozen=True)
class Layout:
    """The receivers of all targets in order; target i has ``spans[i]`` to ``spans[i + 1]``. Those
    that are ``buried`` get no light of their own, and of those that are ``cut`` (count,) bool a part
    is buried (see ``bury``)."""

    receivers: Receivers
    spans: tuple[int, ...]
    warnings: tuple[str, ...]
    buried: Receivers | None = None
    cut: np.ndarray | None = None
    bare: tuple[int, ...] = ()  # numbers of the targets without a texel

    def part(self, index: int) -> Receivers:
        """One target's receivers, numbered from 0."""
        return slice_receivers(self.receivers, *self.spans[index : index + 2])


def lay_out(job: Job, progress: Progress) -> Layout:
    """The receivers of every target, on all threads, and warnings about UV maps. Raises Refused
    where none has a texel."""
    layout = lay_out_part(job, progress)
    if not layout.receivers.count and job.settings.target == Target.IMAGE:
        warnings = layout.warnings or [f"{job.targets[0].name!r}: {NO_TEXEL}"]
        raise Refused("there is no texel to bake: " + warnings[-1])
    return layout


def lay_out_part(job: Job, progress: Progress) -> Layout:
    """``lay_out`` for targets that may all be without a texel."""
    make = _texels(job) if job.settings.target == Target.IMAGE else _faces(job)
    parts = map_chunks(
        make, range(len(job.targets)), job.settings.threads, lambda done: progress(PHASE, done)
    )
    receivers, warnings = zip(*parts)
    counts = [part.count for part in receivers]
    return Layout(
        concatenate(list(receivers)),
        tuple(np.cumsum([0, *counts]).tolist()),
        tuple(text for texts in warnings for text in texts),
        bare=tuple(index for index, count in enumerate(counts) if not count),
    )


def _faces(job: Job):
    """A function of a target's number: its receivers, and a warning of faces that get no color."""
    scene = job.scene
    areas = triangle_areas(scene.vertices, scene.triangles)
    baked = [areas[target.start : target.stop] for target in job.targets]
    budget = receiver_budget(np.concatenate(baked))

    def make(index: int):
        target = job.targets[index]
        own = scene.triangles[target.start : target.stop]
        part = face_receivers(scene.vertices, own, _numbers(target), budget)
        return part, list(filter(None, [_sourceless(job, target, baked[index])]))

    return make


def _sourceless(job: Job, target, area: np.ndarray) -> str:
    """A warning of faces that get no color as their corners come from none of the user's. On the vertex domain there
    is none: a face shows the colors of its vertices, whatever face it came from."""
    if target.corner_map is None or job.settings.domain == Domain.POINT:
        return ""
    share = sourceless_share(target.corner_map, area)
    return sourceless_warning(target.name, share, target.modifiers)


def _texels(job: Job):
    """A function of a target's number: its texels, and warnings."""
    areas = triangle_areas(job.scene.vertices, job.scene.triangles)

    def make(index: int):
        target = job.targets[index]
        rect = target.rect or full_rect(job.settings.size)
        size = rect.width, rect.height
        part = texel_receivers(target.uv, _numbers(target), size, index)
        shared = overlapping_texels(part, target.uv, target.start, size)
        missed = missed_shares(part, target.uv, target.start, areas[target.start : target.stop])
        warnings = [_overlap(target, shared)] if shared else []
        warnings += filter(None, [missed_warning(target.name, missed, target.modifiers)])
        return part, warnings

    return make


def _overlap(target, shared: int) -> str:
    """The warning of faces that overlap in a UV map. Modifiers such as Bevel and Mirror make such faces."""
    remedy = (
        f"its modifiers ({', '.join(target.modifiers)}) make faces that share the UVs of others: "
        "apply the modifiers, then unwrap or bake again"
        if target.modifiers
        else "bake to a map without overlaps"
    )
    return (
        f"{target.name!r}: faces overlap in its UV map on {shared} texels, which get their mean; "
        f"{remedy}"
    )


def shaded_layout(job: Job, layout: Layout) -> Layout:
    """The layout with the normals by which light counts. To be called after buried parts are cut off, as that changes
    the cells."""
    pairs = enumerate(job.targets)
    parts = [_shaded(job, target, layout.part(index)) for index, target in pairs]
    if all(part.shading is None for part in parts):
        return layout
    return replace(layout, receivers=concatenate(parts))


def _shaded(job: Job, target, part: Receivers) -> Receivers:
    """The receivers, with the normals by which their light counts where these are not the faces'."""
    if target.normals is None or not job.settings.shading_normals:
        return part
    own = job.scene.triangles[target.start : target.stop]
    return replace(part, shading=shading_of(
        part, job.scene.vertices, own, target.start, target.normals, target.texel_normals,
        target.fades,
    ))  # fmt: skip


def _numbers(target) -> np.ndarray:
    return np.arange(target.start, target.stop, dtype=np.int32)
