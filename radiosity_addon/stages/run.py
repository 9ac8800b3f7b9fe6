"""Run: from the scene to each target's colours. Imports no bpy: another process may do it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..bake.corner_fit import CornerFit, corner_fit
from ..bake.faces import receiver_areas
from ..solver.progress import Progress, silent
from ..solver.receivers import Projection
from ..solver.solution import Statistics, compose
from .bury import open_layout
from .draw_sheets import draw_sheet
from .job import Job, Result
from .layout import Layout, lay_out, shaded_layout
from .light import has_light, warn_of_darkness
from .run_tiles import run_tiles
from .sheets import sheets_of
from .tiling import Tiling, tiles_of


def run(
    job: Job, progress: Progress = silent, kept=None, beside=None, tiling: Tiling | None = None
) -> Result:
    """Solve the scene and turn the light into each target's colours. Imports no bpy.

    ``kept`` (solver.adaptive.solve_cache.SolveCache) has solves of an earlier bake to use
    again, and takes this one's.
    ``beside`` (replicate_process) does half of the work in another process.
    ``tiling`` tells which bakes are done in tiles; None: those of more texels than usual.
    Raises solver.progress.Cancelled (or whatever else ``progress`` raises) when told to stop.
    """
    from ..solver.sequence import open_scene, solve

    tiling = tiling or Tiling()
    tiles = tiles_of(job, tiling)
    if tiles:
        return run_tiles(job, tiles, tiling, progress, kept, beside)
    began = time.perf_counter()
    layout = lay_out(job, progress)
    context = open_scene(job.scene, layout.receivers, job.settings, progress, beside)
    layout = shaded_layout(job, open_layout(layout, context))
    laid_out = time.perf_counter() - began
    receivers, fits = layout.receivers, _fits(job, layout)
    judged = fits and _where_judged(layout, fits)
    solution = solve(job.scene, receivers, job.settings, progress, judged, kept, beside, context)
    started = time.perf_counter()
    progress("Write", 0.0)
    light = compose(solution, job.settings.passes)
    colors = []
    told: list[str] = []
    sheets = [] if fits else sheets_of(job)
    for index, fit in enumerate(fits or ()):
        colors.append(fit.colors(light[slice(*layout.spans[index : index + 2])]))
        progress("Write", (index + 1) / len(fits))
    for index, sheet in enumerate(sheets):
        image, warnings = draw_sheet(job, sheet, layout, light)
        colors.append(image)
        told += warnings
        progress("Write", (index + 1) / len(sheets))
    figures = solution.statistics
    return Result(
        colors=tuple(colors),
        statistics=_charged(figures, "elements", laid_out),
        warnings=(
            *layout.warnings, *told,
            *([] if has_light(solution) else warn_of_darkness(job.settings.passes)),
            *figures.warnings,
        ),
        seconds={"fit": time.perf_counter() - started},
        receivers=receivers.count,
    )


def _charged(figures: Statistics, stage: str, seconds: float) -> Statistics:
    """The figures with more seconds of a stage."""
    return replace(
        figures, seconds={**figures.seconds, stage: figures.seconds.get(stage, 0.0) + seconds}
    )


def _fits(job: Job, layout: Layout) -> list[CornerFit] | None:
    """What turns light into each mesh's colours; None for images."""
    if job.settings.target == "image":
        return None
    fits = []
    for index, target in enumerate(job.targets):
        part = layout.part(index)
        area = receiver_areas(job.scene.vertices, job.scene.triangles, part)
        hidden = _hidden_faces(layout, target.start, target.stop)
        fits.append(corner_fit(target, part, area, job.settings.domain, hidden))
    return fits


def _hidden_faces(layout: Layout, start: int, stop: int) -> np.ndarray:
    """(n,) bool: triangles from ``start`` to ``stop`` whose receivers are all buried."""
    buried, shown = (
        np.isin(np.arange(start, stop), [] if some is None else some.triangle)
        for some in (layout.buried, layout.receivers)
    )
    return buried & ~shown


def _where_judged(layout: Layout, fits: list[CornerFit]) -> Projection:
    """From light at all receivers to the colours whose error counts.

    A vertex colour is a mean over many receivers, and its error less than theirs.
    """
    spans = [slice(*layout.spans[i : i + 2]) for i in range(len(fits))]

    def apply(light: np.ndarray) -> np.ndarray:
        return np.concatenate([fit.rough_colors(light[span]) for fit, span in zip(fits, spans)])

    return Projection(apply, np.concatenate([fit.areas() for fit in fits]))
