"""Buried texels: those that a bake of ours leaves out, or a part of them, and Cycles counts as black. Needs bpy."""

from __future__ import annotations

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.stages.bury import open_layout
from radiosity_addon.stages.layout import lay_out
from radiosity_addon.stages.prepare import prepare


def buried_texels(obj, size: int, **options) -> np.ndarray:
    """(size, size) bool: texels of ``obj`` of which a part, or all, lies inside other geometry, when it is baked
    with further ``options``."""
    import bpy

    settings = Settings(objects=(obj.name,), target="image", resolution=size, **options)
    job = prepare(bpy.context, settings)
    context = build_context(job.scene, 0, 2, silent)
    opened = open_layout(lay_out(job, silent), context)
    found = np.zeros((size, size), bool)
    if opened.cut is None:
        return found
    for grid in (opened.buried.grid, opened.receivers.grid[opened.cut]):
        found[grid[:, 1], grid[:, 2]] = True
    return found
