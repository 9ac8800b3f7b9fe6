"""Run: from the scene to each target's colours. Imports no bpy: another process may do it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..bake.corners import fit_corners
from ..bake.dilate import extend_islands
from ..bake.faces import receiver_areas
from ..solver.progress import Progress, silent
from ..solver.solution import Solution, Statistics, compose
from .job import Job, Result
from .layout import Layout, lay_out


def run(job: Job, progress: Progress = silent, kept=None) -> Result:
    """Solve the scene and turn the light into each target's colours. Imports no bpy.

    ``kept`` (solver.keep.Kept) has solves of an earlier bake to use again, and takes this one's.
    Raises solver.progress.Cancelled (or whatever else ``progress`` raises) when told to stop.
    """
    from ..solver.sequence import solve

    began = time.perf_counter()
    layout = lay_out(job, progress)
    laid_out = time.perf_counter() - began
    receivers, judged = layout.receivers, _where_judged(job, layout)
    solution = solve(job.scene, receivers, job.settings, progress, judged, kept)
    started = time.perf_counter()
    progress("Write", 0.0)
    light = compose(solution, job.settings.passes)
    make = _image if job.settings.target == "image" else _corners
    colors = []
    for index in range(len(job.targets)):
        colors.append(make(job, layout, index, light))
        progress("Write", (index + 1) / len(job.targets))
    figures = solution.statistics
    return Result(
        colors=tuple(colors),
        statistics=_charged(figures, "elements", laid_out),
        warnings=(*layout.warnings, *_warn_of_darkness(solution), *figures.warnings),
        seconds={"fit": time.perf_counter() - started},
        receivers=receivers.count,
    )


def _charged(figures: Statistics, stage: str, seconds: float) -> Statistics:
    """The figures with more seconds of a stage."""
    return replace(
        figures, seconds={**figures.seconds, stage: figures.seconds.get(stage, 0.0) + seconds}
    )


def _where_judged(job: Job, layout: Layout):
    """Light at all receivers → the colours whose error counts; None: the receivers themselves.

    A vertex colour is a mean over many receivers, and its error less than theirs.
    """
    if job.settings.target == "image":
        return None
    numbers = range(len(job.targets))
    return lambda light: np.concatenate([_corners(job, layout, i, light) for i in numbers])


def _image(job: Job, layout: Layout, index: int, light: np.ndarray) -> np.ndarray:
    """(height, width, 4) float32: the texels' light, and the islands' margin around them."""
    span = slice(*layout.spans[index : index + 2])
    resolution = job.settings.resolution
    part = layout.receivers.grid[span]
    covered = np.zeros((resolution, resolution), bool)
    pixels = np.zeros((resolution, resolution, 3), np.float32)
    covered[part[:, 1], part[:, 2]] = True
    pixels[part[:, 1], part[:, 2]] = light[span]
    return extend_islands(pixels, covered, job.settings.margin)


def _corners(job: Job, layout: Layout, index: int, light: np.ndarray) -> np.ndarray:
    """Colours of the mesh's loops or vertices that fit the light over the object's faces."""
    part = layout.part(index)
    area = receiver_areas(job.scene.vertices, job.scene.triangles, part)
    light = light[slice(*layout.spans[index : index + 2])]
    return fit_corners(job.targets[index], part, light, area, job.settings.domain)


def _warn_of_darkness(solution: Solution) -> list[str]:
    light = (solution.emission, solution.direct, solution.indirect)
    if any(part.any() for part in light):
        return []
    return ["nothing that is baked receives light: the result is black; add a lamp or a sky"]
