"""Changed objects: those that were deleted, renamed or edited between the export and the write."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from ..solver.expected import Refused


@dataclass(frozen=True)
class Followed:
    """The job and the result with the targets' names of today and without the lost ones."""

    job: object
    result: object
    in_edit_mode: str  # the name of a target whose mesh cannot be written now, or ""


def follow(job, result) -> Followed:
    """Find today's objects. Raises Refused when none of the targets is left."""
    from ..stages.leave_out import leave_out, without_bare

    objects = {item.session_uid: item for item in bpy.data.objects}
    job, result = without_bare(job, result)
    items = [objects.get(target.identity) for target in job.targets]
    why = enumerate(map(_why_lost, items, job.targets))
    lost = {index: reason for index, reason in why if reason}
    reasons = [f"{job.targets[index].name} {reason}" for index, reason in lost.items()]
    if len(lost) == len(items):
        raise Refused(f"nothing is left to write to: {reasons[0]}; bake again")
    kept = {job.targets[index].name: item for index, item in enumerate(items) if index not in lost}
    job, result = leave_out(job, result, lost)
    warnings = (*result.warnings, *(f"{text}; it was left out" for text in reasons))
    busy = next((item.name for item in kept.values() if item.data.is_editmode), "")
    return Followed(_renamed(job, kept), replace(result, warnings=warnings), busy)


def _why_lost(item, target) -> str:
    """Why ``target`` cannot be written any more; empty when it can."""
    if item is None:
        return "was deleted while the bake ran"
    if item.type != "MESH":
        return "is no mesh any more"
    if not item.data.is_editmode and target.n_loops != len(item.data.loops):
        return "was edited while the bake ran"
    return ""


def _renamed(job, kept: dict):
    """The job with the names that its targets, by the names they had, have today."""
    targets = tuple(replace(each, name=kept[each.name].name) for each in job.targets)
    maps = tuple((kept[name].name, layer) for name, layer in job.made_uv_maps if name in kept)
    return replace(job, targets=targets, made_uv_maps=maps)
