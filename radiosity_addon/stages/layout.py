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
from ..figures import quoted
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
    receivers, shared, warnings = zip(*parts)
    counts = [part.count for part in receivers]
    return Layout(
        concatenate(list(receivers)),
        tuple(np.cumsum([0, *counts]).tolist()),
        (*_overlap_warnings(job.targets, shared), *filter(None, warnings)),
        bare=tuple(index for index, count in enumerate(counts) if not count),
    )


def _faces(job: Job):
    """A function of a target's number: its receivers, 0 of them shared, and a warning of faces that get no color."""
    scene = job.scene
    areas = triangle_areas(scene.vertices, scene.triangles)
    baked = [areas[target.start : target.stop] for target in job.targets]
    budget = receiver_budget(np.concatenate(baked))

    def make(index: int):
        target = job.targets[index]
        own = scene.triangles[target.start : target.stop]
        part = face_receivers(scene.vertices, own, _numbers(target), budget)
        return part, 0, _sourceless(job, target, baked[index])

    return make


def _sourceless(job: Job, target, area: np.ndarray) -> str:
    """A warning of faces that get no color as their corners come from none of the user's. On the vertex domain there
    is none: a face shows the colors of its vertices, whatever face it came from."""
    if target.corner_map is None or job.settings.domain == Domain.POINT:
        return ""
    share = sourceless_share(target.corner_map, area)
    return sourceless_warning(target.name, share, target.modifiers)


def _texels(job: Job):
    """A function of a target's number: its texels, the number of those where its faces overlap, and a warning of
    faces that get none."""
    areas = triangle_areas(job.scene.vertices, job.scene.triangles)

    def make(index: int):
        target = job.targets[index]
        rect = target.rect or full_rect(job.settings.size)
        size = rect.width, rect.height
        part = texel_receivers(target.uv, _numbers(target), size, index)
        shared = overlapping_texels(part, target.uv, target.start, size)
        missed = missed_shares(part, target.uv, target.start, areas[target.start : target.stop])
        return part, shared, missed_warning(target.name, missed, target.modifiers)

    return make


def _overlap_warnings(targets, shared) -> list[str]:
    """Warnings of faces that overlap in UV maps, on ``shared`` texels of each target: one of all without modifiers,
    and one of all with them, as modifiers such as Bevel and Mirror make such faces."""
    every = sorted(zip(targets, shared), key=lambda pair: -pair[1])
    groups = ([pair for pair in every if pair[1] and bool(pair[0].modifiers) == made] for made in (False, True))
    return [_overlap(*zip(*group)) for group in groups if group]


def _overlap(targets, shared) -> str:
    """One sentence on the faces that overlap in the UV maps of these targets."""
    its, maps = ("their", "UV maps") if len(targets) > 1 else ("its", "UV map")
    modifiers = dict.fromkeys(name for target in targets for name in target.modifiers)
    remedy = (
        f"{its} modifiers ({', '.join(modifiers)}) make faces that share the UVs of others: "
        "apply the modifiers, then unwrap or bake again"
        if modifiers
        else "bake to a map without overlaps"
    )
    return (
        f"{quoted([target.name for target in targets])}: faces overlap in {its} {maps} on {sum(shared)} texels, which "
        f"get their mean; {remedy}"
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
