"""Fit sheets: the fit of texels beside seams where all come at once, and what cannot be fitted. No bpy."""

from __future__ import annotations

from ..solver.lights.context import Context
from ..solver.solution import Solution
from .job import Job
from .layout import Layout
from .seam_fit import Drawn, SeamFit
from .sheets import Sheet
from .unfit_sheets import UnfitSheets


def fit_sheets(
    job: Job, sheets: list[Sheet], layout: Layout, drawn: list[Drawn], solution: Solution,
    context: Context,
) -> list[str]:
    """Fit texels beside seams in the images; warnings of texels that cannot be fitted."""
    fit = SeamFit(job, sheets)
    charts = fit.charts(job, layout, range(len(job.targets)))
    fit.add(charts, layout, solution)
    for number, each in enumerate(drawn):
        fit.draw(number, each)
    fit.fit([each.image for each in drawn], context)
    unfit = UnfitSheets(job, fit)
    unfit.add(charts, layout)
    return unfit.warnings()
