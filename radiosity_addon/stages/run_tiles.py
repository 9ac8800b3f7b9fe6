"""Run tiles: ``run`` for more texels than are worked on together. Imports no bpy."""

from __future__ import annotations

from ..overall_progress import OverallProgress
from ..solver.lights.context import Context
from ..solver.progress import Progress
from ..solver.tracing.buried import Surroundings
from .bury import open_part, surroundings_of
from .darkness import brightest, warn_of_darkness
from .drawing import Drawing
from .job import Job, Result
from .layout import Layout, lay_out, lay_out_part, shaded_layout
from .tiling import Tiling, Window, covered_shares, part_of, survey_of, texels_of

PHASE = "tiles"
SURVEY = 0.05  # share [of the time] that the survey takes


class Portions:
    """A progress callback for a bake of several solves: each has a share of the whole."""

    def __init__(self, progress: Progress):
        self._progress, self._low, self._high = progress, 0.0, 0.0
        self._solve = OverallProgress(self._advance)

    def next(self, share: float) -> None:
        """Start with the next one."""
        self._low, self._high = self._high, self._high + share
        self._solve = OverallProgress(self._advance)

    def _advance(self, phase: str, fraction: float) -> None:
        self._progress(PHASE, min(self._low + (self._high - self._low) * fraction, 1.0))

    def __call__(self, phase: str, fraction: float) -> None:
        self._solve(phase, fraction)


def run_tiles(
    job: Job, tiles: list[list[Window]], tiling: Tiling, progress: Progress, cache=None, beside=None
) -> Result:
    """What ``run`` gives, tile by tile. Warnings of the layout are those of the survey."""
    from ..solver.sequence import open_scene
    from ..solver.tiles import TiledSolve

    portions = Portions(progress)
    portions.next(SURVEY)
    coarse, factor = survey_of(job, tiling)
    survey = lay_out(coarse, portions)
    context = open_scene(job.scene, survey.receivers, job.settings, portions, beside)
    ground = surroundings_of(context)
    survey, ground = _opened(survey, context, ground)
    receivers = shaded_layout(coarse, survey).receivers
    solve = TiledSolve(context, receivers, job.settings, cache, beside)
    drawing, texels = Drawing(job, tiles), texels_of(tiles, covered_shares(job))
    shown = 0.0
    for number, windows in enumerate(tiles):
        portions.next((1 - SURVEY) * texels[number] / sum(texels))
        part = part_of(job, windows)
        layout = lay_out_part(part, portions)
        layout = shaded_layout(part, open_part(layout, context, ground))
        solution, share = None, texels[number] / sum(texels[number:])
        if layout.receivers.count:
            most = receivers.count * factor**2
            solution = solve.light_of(layout.receivers, share, most)
            shown = max(shown, brightest(solution))
        drawing.add(part, layout, windows, solution)
        del solution
        solve.skip()
    dark, figures = warn_of_darkness(job.settings.passes, shown), solve.statistics()
    return Result(
        colors=drawing.images(context),
        statistics=figures,
        warnings=(*survey.warnings, *drawing.warnings, *dark, *figures.warnings),
        seconds={"fit": drawing.seconds},
        receivers=drawing.texels,
        bare=survey.bare,
    )


def _opened(
    survey: Layout, context: Context, ground: Surroundings | None
) -> tuple[Layout, Surroundings | None]:
    """The survey's layout without buried parts, and what buries; None where all would be buried: then nothing counts
    as buried."""
    opened = open_part(survey, context, ground)
    return (opened, ground) if opened.receivers.count else (survey, None)
