"""Run: from the scene to each target's colours. Imports no bpy: another process may do it."""

from __future__ import annotations

import time

import numpy as np

from ..bake.corners import fit_corners
from ..bake.dilate import extend_islands
from ..bake.faces import receiver_areas
from ..solver.progress import Progress, silent
from ..solver.receivers import Receivers
from ..solver.solution import Solution, compose
from .job import Job, Result


def run(job: Job, progress: Progress = silent, kept=None) -> Result:
    """Solve the scene and turn the light into each target's colours. Imports no bpy.

    ``kept`` (solver.keep.Kept) has solves of an earlier bake to use again, and takes this one's.
    Raises solver.progress.Cancelled (or whatever else ``progress`` raises) when told to stop.
    """
    from ..solver.sequence import solve

    solution = solve(job.scene, job.receivers, job.settings, progress, _where_judged(job), kept)
    started = time.perf_counter()
    progress("Write", 0.0)
    light = compose(solution, job.settings.passes)
    make = _image if job.settings.target == "image" else _corners
    colors = []
    for index in range(len(job.targets)):
        colors.append(make(job, index, light))
        progress("Write", (index + 1) / len(job.targets))
    return Result(
        colors=tuple(colors),
        statistics=solution.statistics,
        warnings=(*_warn_of_darkness(solution), *solution.statistics.warnings),
        seconds={"fit": time.perf_counter() - started},
    )


def _where_judged(job: Job):
    """Light at all receivers → the colours whose error counts; None: the receivers themselves.

    A vertex colour is a mean over many receivers, and its error less than theirs.
    """
    if job.settings.target == "image":
        return None
    return lambda light: np.concatenate([_corners(job, i, light) for i in range(len(job.targets))])


def _image(job: Job, index: int, light: np.ndarray) -> np.ndarray:
    """(height, width, 4) float32: the texels' light, and the islands' margin around them."""
    light = light[job.spans[index] : job.spans[index + 1]]
    resolution = job.settings.resolution
    part = job.receivers.grid[job.spans[index] : job.spans[index + 1]]
    covered = np.zeros((resolution, resolution), bool)
    pixels = np.zeros((resolution, resolution, 3), np.float32)
    covered[part[:, 1], part[:, 2]] = True
    pixels[part[:, 1], part[:, 2]] = light
    return extend_islands(pixels, covered, job.settings.margin)


def _corners(job: Job, index: int, light: np.ndarray) -> np.ndarray:
    """Colours of the mesh's loops or vertices that fit the light over the object's faces."""
    light = light[job.spans[index] : job.spans[index + 1]]
    part = slice_receivers(job.receivers, job.spans[index], job.spans[index + 1])
    area = receiver_areas(job.scene.vertices, job.scene.triangles, part)
    return fit_corners(job.targets[index], part, light, area, job.settings.domain)


def slice_receivers(receivers: Receivers, start: int, stop: int) -> Receivers:
    """The receivers ``start`` to ``stop`` alone, numbered from 0."""
    first, last = np.searchsorted(receivers.receiver, (start, stop))
    return Receivers(
        count=stop - start,
        receiver=receivers.receiver[first:last] - np.int32(start),
        triangle=receivers.triangle[first:last],
        corners=receivers.corners[first:last],
        square=receivers.square[first:last],
        grid=None if receivers.grid is None else receivers.grid[start:stop],
    )


def _warn_of_darkness(solution: Solution) -> list[str]:
    light = (solution.emission, solution.direct, solution.indirect)
    if any(part.any() for part in light):
        return []
    return ["nothing that is baked receives light: the result is black; add a lamp or a sky"]
