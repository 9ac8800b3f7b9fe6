"""Sheets: the images of a bake, each with the texels of one object or of several. No bpy."""

from __future__ import annotations

from dataclasses import dataclass

from ..bake.windows import TexelRect, full_rect
from .job import Job, UnbakedTexels


@dataclass(frozen=True)
class Sheet:
    """An image: what it is called after the bake's name, and whose texels it holds."""

    name: str
    size: tuple[int, int]  # width and height
    targets: tuple[int, ...]
    unbaked: UnbakedTexels | None  # of an earlier bake: the part of objects that are not baked now


def rect_of(job: Job, index: int) -> TexelRect:
    """Where a target's texels lie."""
    return job.targets[index].rect or full_rect(job.settings.size)


def sheets_of(job: Job) -> list[Sheet]:
    """The images of a bake in the order of their first targets."""
    members: dict[str, list[int]] = {}
    for index, target in enumerate(job.targets):
        members.setdefault(rect_of(job, index).sheet or target.name, []).append(index)
    return [
        Sheet(name, rect_of(job, mine[0]).size, tuple(mine), job.unbaked.get(name))
        for name, mine in members.items()
    ]
