"""What a bake, done just now or earlier, asks of the export. No bpy."""

from __future__ import annotations

from ..settings import Settings
from ..solver.passes import Pass
from ..stages.job import Job
from .export import Baked


def of_job(job: Job) -> Baked:
    """All objects of a bake."""
    return of_settings(job.settings, tuple(target.name for target in job.targets))


def of_settings(settings: Settings, objects: tuple[str, ...]) -> Baked:
    """These objects, baked with these settings."""
    return Baked(
        objects=objects,
        target=settings.target,
        name=settings.name,
        uv_map=settings.uv_map or Settings().name,
        colored=Pass.COLOR in settings.passes,
        atlas=settings.atlas,
    )
