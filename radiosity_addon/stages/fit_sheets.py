"""Fit sheets: the fit of texels beside seams where all come at once, and what cannot be fitted. No bpy."""

from __future__ import annotations

import numpy as np

from ..bake.faces import triangle_areas
from ..bake.texel_parts import crowded_shares, unfit_shares, unfit_warning
from ..solver.geometry.planar import doubled_areas
from ..solver.lights.context import Context
from ..solver.solution import Solution
from .job import Job
from .layout import Layout
from .seam_fit import Charts, Drawn, SeamFit
from .sheets import Sheet


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
    return _warn_of_unfit(job, fit, layout, charts)


def _warn_of_unfit(job: Job, fit: SeamFit, layout: Layout, charts: Charts) -> list[str]:
    charted, island, parts = fit.charted, fit.island[charts.triangle], charts.parts
    texel = fit.every.texel(charts.sheet, charts.row, charts.column)[layout.receivers.receiver]
    uv_area = np.abs(doubled_areas(charted.uv))
    scale = 2 * triangle_areas(charted.vertices, charted.triangles) / np.where(uv_area > 0, uv_area, 1)
    surface = parts.area * scale[charts.triangle]
    crowded = crowded_shares(fit.every, parts, texel, island)
    columns = texel, island, parts.area, surface, crowded
    warnings = []
    for index, target in enumerate(job.targets):
        own = charts.target == index
        shares = unfit_shares(*(column[own] for column in columns))
        warnings.append(unfit_warning(target.name, *shares))
    return [text for text in warnings if text]
