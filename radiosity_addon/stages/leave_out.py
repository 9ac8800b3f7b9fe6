"""Leave out: targets that get nothing of a bake after all. Imports no bpy."""

from __future__ import annotations

from dataclasses import replace

from ..settings import Target
from .job import Job, Result
from .sheets import sheets_of

NO_TEXEL = (
    "its UV map covers no texel: its UVs lie outside the tile from 0 to 1, or have no area there, or too little for so "
    "few texels"
)


def leave_out(job: Job, result: Result, reasons: dict[int, str]) -> tuple[Job, Result]:
    """The job and the result without the targets of these numbers, which are skipped for the
    ``reasons`` given. Images that hold no other target go with them."""
    if not reasons:
        return job, result
    kept = numbers = [index for index in range(len(job.targets)) if index not in reasons]
    if job.settings.target == Target.IMAGE:
        sheet = {each: n for n, sheet in enumerate(sheets_of(job)) for each in sheet.targets}
        numbers = list(dict.fromkeys(sheet[index] for index in kept))
    skipped = [(job.targets[index].name, reason) for index, reason in reasons.items()]
    return (
        replace(job, targets=tuple(job.targets[index] for index in kept),
                skipped=(*job.skipped, *skipped)),
        replace(result, colors=tuple(result.colors[number] for number in numbers), bare=()),
    )  # fmt: skip


def without_bare(job: Job, result: Result) -> tuple[Job, Result]:
    """The job and the result without the targets that have no texel."""
    return leave_out(job, result, dict.fromkeys(result.bare, NO_TEXEL))
