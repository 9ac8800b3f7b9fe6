"""Objects that were deleted, renamed or edited between the export and the write."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy


@dataclass(frozen=True)
class Followed:
    """The job and the result with the targets' names of today and without the lost ones."""

    job: object
    result: object
    in_edit_mode: str  # the name of a target whose mesh cannot be written now, or ""


def follow(job, result) -> Followed:
    """Find today's objects. Raises RuntimeError when none of the targets is left."""
    objects = {item.session_uid: item for item in bpy.data.objects}
    kept, lost = [], []
    for index, target in enumerate(job.targets):
        item = objects.get(target.identity)
        reason = _why_lost(item, target)
        if reason:
            lost.append((target.name, reason))
        else:
            kept.append((index, item))
    if not kept:
        name, reason = lost[0]
        raise RuntimeError(f"nothing is left to write to: {name} {reason}; bake again")
    busy = next((item.name for _, item in kept if item.data.is_editmode), "")
    return Followed(_keep_targets(job, kept, lost), _keep_colors(job, result, kept, lost), busy)


def _why_lost(item, target) -> str:
    """Why ``target`` cannot be written any more; empty when it can."""
    if item is None:
        return "was deleted while the bake ran"
    if item.type != "MESH":
        return "is no mesh any more"
    if not item.data.is_editmode and target.n_loops != len(item.data.loops):
        return "was edited while the bake ran"
    return ""


def _keep_targets(job, kept, lost):
    targets = tuple(replace(job.targets[index], name=item.name) for index, item in kept)
    today = {job.targets[index].name: item.name for index, item in kept}
    maps = tuple((today[name], layer) for name, layer in job.made_uv_maps if name in today)
    return replace(job, targets=targets, skipped=(*job.skipped, *lost), made_uv_maps=maps)


def _keep_colors(job, result, kept, lost):
    """The colors of targets that are left, or of images that hold some of them."""
    numbers = [index for index, _ in kept]
    if job.settings.target == "image":
        from ..stages.sheets import sheets_of

        sheet = {each: n for n, sheet in enumerate(sheets_of(job)) for each in sheet.targets}
        numbers = list(dict.fromkeys(sheet[index] for index in numbers))
    warnings = tuple(f"{name} {reason}; it was left out" for name, reason in lost)
    colors = tuple(result.colors[index] for index in numbers)
    return replace(result, colors=colors, warnings=(*result.warnings, *warnings))
