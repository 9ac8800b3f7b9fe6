"""Run: from the scene to each target's colors. Imports no bpy: another process may do it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..settings import Target
from ..solver.lights.context import Context
from ..solver.progress import Progress, silent
from ..solver.receivers import Projection
from ..solver.solution import Statistics, compose
from .bury import open_layout, seen_layout
from .darkness import brightest, warn_of_darkness
from .draw_sheets import draw_sheets
from .job import Job, Result
from .joint_fits import JointFit, joint_fits, shared_color_warnings
from .layout import Layout, lay_out, shaded_layout
from .run_tiles import run_tiles
from .tiling import Tiling, tiles_of

# Share [of the surface]: so much of it, what is least seen, does not count in the error of vertex colors. Rare rays light it.
LEAST_SEEN = 0.01


def run(
    job: Job, progress: Progress = silent, cache=None, beside=None, tiling: Tiling | None = None
) -> Result:
    """Solve the scene and turn the light into each target's colors. Imports no bpy.

    ``cache`` (solver.adaptive.solve_cache.SolveCache) has solves of an earlier bake to use
    again, and takes this one's.
    ``beside`` (replicate_process) does half of the work in another process.
    ``tiling`` says which bakes are done in tiles; None: those of more texels than usual.
    To stop it, ``progress`` may raise any exception, which passes through.
    """
    from ..solver.sequence import Options, open_scene, solve_opened

    tiling = tiling or Tiling()
    tiles = tiles_of(job, tiling)
    if tiles:
        return run_tiles(job, tiles, tiling, progress, cache, beside)
    began = time.perf_counter()
    layout = lay_out(job, progress)
    context = open_scene(job.scene, layout.receivers, job.settings, progress, beside)
    layout, fits = _opened(job, layout, context)
    receivers = layout.receivers
    laid_out = time.perf_counter() - began
    judged = fits and _where_judged(fits)
    solution = solve_opened(context, receivers, job.settings, Options(judged, cache, beside))
    started = time.perf_counter()
    progress("Write", 0.0)
    light = compose(solution, job.settings.passes)
    if fits is None:
        colors, warnings = draw_sheets(job, layout, light, solution, context)
    else:
        colors, warnings = _mesh_colors(fits, light, progress), shared_color_warnings(job, layout, light)
    progress("Write", 1.0)
    figures = solution.statistics
    return Result(
        colors=tuple(colors),
        statistics=_charged(figures, "elements", laid_out),
        warnings=(
            *layout.warnings, *warnings,
            *warn_of_darkness(job.settings.passes, brightest(solution)),
            *figures.warnings,
        ),
        seconds={"fit": time.perf_counter() - started},
        receivers=receivers.count,
        bare=layout.bare,
    )


def _opened(job: Job, layout: Layout, context: Context) -> tuple[Layout, list[JointFit] | None]:
    """The layout of what is open of receivers, and how vertex colors will be fitted; None for images."""
    layout = open_layout(layout, context)
    if job.settings.target == Target.IMAGE:
        return shaded_layout(job, layout), None
    layout, seen = seen_layout(layout, context)
    layout = shaded_layout(job, layout)
    return layout, joint_fits(job, layout, context, seen)


def _mesh_colors(fits: list[JointFit], light: np.ndarray, progress: Progress) -> list[np.ndarray]:
    """Colors of each target, in order."""
    colors = {}
    for number, each in enumerate(fits):
        colors.update(zip(each.targets, each.colors(light)))
        progress("Write", (number + 1) / len(fits))
    return [colors[index] for index in sorted(colors)]


def _charged(figures: Statistics, phase: str, seconds: float) -> Statistics:
    """The figures with more seconds of a phase."""
    return replace(
        figures, seconds={**figures.seconds, phase: figures.seconds.get(phase, 0.0) + seconds}
    )


def _where_judged(fits: list[JointFit]) -> Projection:
    """From light at all receivers to the colors whose error counts.

    A vertex color is a mean over many receivers, and its error less than theirs. It counts by the area of its faces (``counted_areas``).
    """

    def apply(light: np.ndarray) -> np.ndarray:
        return np.concatenate([each.fit.rough_colors(each.light(light)) for each in fits])

    def of_light(light: np.ndarray) -> list[np.ndarray]:
        light = np.repeat(light, 3 // light.shape[1], axis=1)
        return [each.light(light) for each in fits]

    def limits(light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = (each.fit.limits(mine) for each, mine in zip(fits, of_light(light)))
        return tuple(np.concatenate(bound)[:, : light.shape[1]] for bound in zip(*found))

    def show(light: np.ndarray) -> np.ndarray:
        return np.concatenate([each.fit.colors(mine) for each, mine in zip(fits, of_light(light))])

    areas = [each.fit.areas() for each in fits]
    area = counted_areas(np.concatenate(areas), np.concatenate([each.fit.seen() for each in fits]))
    ends = np.cumsum([len(each) for each in areas])[:-1]

    def receiver_factors(errors: np.ndarray, own: np.ndarray) -> np.ndarray:
        found = np.zeros(len(own))
        for each, mine in zip(fits, np.split(errors, ends)):
            each.put(each.fit.receiver_factors(mine, each.light(own)), found)
        return found

    return Projection(apply, limits, show, receiver_factors, area)


def counted_areas(area: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The ``area`` (m,) of colors, but 0 for those that are least ``seen`` (m,), which have up to LEAST_SEEN of it."""
    order = np.argsort(seen, kind="stable")
    least = order[np.cumsum(area[order]) <= LEAST_SEEN * area.sum()]
    result = area.copy()
    result[least] = 0.0
    return result
