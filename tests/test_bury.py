"""Bakes of floors and boxes whose faces lie partly inside others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import CornerMap, ExportedObject
from radiosity_addon.bake_job import Job, run
from radiosity_addon.settings import Settings
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import slice_receivers
from radiosity_addon.solver.scene import Sky
from radiosity_addon.solver.sequence import open_scene
from radiosity_addon.stages import run as run_stage
from radiosity_addon.stages.bury import seen_layout
from radiosity_addon.stages.layout import lay_out
from radiosity_addon.stages.run import counted_areas
from tests.solver.test_buried import FLOOR, SQUARE, UV, block
from verification import meshes

WALL = block((0.2, 80.0, 40.0), (0.47, -40.0, -0.1))  # x from 0.47 to 0.67, black, all but endless
STANDING = block((0.2, 80.0, 40.0), (0.47, -40.0, 0.0))  # the same, on the floor
RHO = 0.5


def job_of(parts, number: int, uv=UV, others=0.0, **options) -> Job:
    """One of the parts is baked, under a white sky; ``others`` than the first one reflect so much."""
    scene = meshes.scene(parts, [[RHO]] + [[others]] * (len(parts) - 1))
    scene = replace(scene, sky=Sky(np.ones((1, 1, 3), np.float32)))
    mine = np.flatnonzero(scene.object == number)
    loops = 3 * len(mine)
    vertex = np.unique(scene.triangles[mine], return_inverse=True)[1].reshape(-1).astype(np.int32)
    one_hot = CornerMap(np.arange(loops + 1), np.arange(loops), np.ones(loops), loops)
    face = np.repeat(np.arange(len(mine)) % (len(mine) // 2), 3)  # of two triangles each, as ``block`` has
    group = np.unique(100 * face + vertex, return_inverse=True)[1].reshape(-1).astype(np.int32)
    target = ExportedObject("Part", int(mine[0]), int(mine[-1]) + 1, uv, one_hot, vertex, group,
                            n_loops=loops)  # fmt: skip
    settings = Settings(resolution=16, error=0.02, passes=("direct", "indirect", "color"), **options)
    return Job(settings, scene, (target,), (), (), ())


@pytest.mark.parametrize("wall", [WALL, STANDING])
def test_texels_beside_a_wall_are_as_bright_as_what_shows_of_them(wall):
    """Beside a black wall of height h at distance d the sky's factor is ½ + ½ d / √(d² + h²)
    (endless strip). With h = 40 and d <= 0.5 it is ½ within 0.7 %, so that ρ/2 is shown by all
    texels, also by those of which 0.03/0.0625 = 48 % and 28 % lie under the wall, and by those
    that are filled. Counted whole they would have 52 and 72 % of it, and 0 below the wall."""
    image = run(job_of([FLOOR, wall], 0, target="image")).colors[0]
    assert (image[..., 3] == 1).all()
    assert image[..., :3] == pytest.approx(RHO / 2, rel=0.04)


@pytest.mark.parametrize("wall", [WALL, STANDING])
@pytest.mark.parametrize("domain", ["corner", "point"])
def test_vertex_colors_of_a_floor_do_not_see_what_a_wall_covers(domain, wall):
    """The same floor by its four corners."""
    colors = run(job_of([FLOOR, wall], 0, target="vertex", domain=domain)).colors[0]
    assert colors == pytest.approx(RHO / 2, rel=0.06)


def test_a_floor_that_goes_on_below_tiles_is_as_bright_as_what_shows_of_it():
    """Three quarters of the floor lie 1 mm below a flat black slab, which takes none of the rest's sky: that shows ρ. By areas alone
    the corners of the rest would have 0.008: a dark place counts eight times as much as a lit one, and the slab's are three quarters."""
    parts = [FLOOR, block((0.75, 2.0, 1e-4), (0.251, -0.5, 1e-3))]
    job = job_of(parts, 0, target="vertex", domain="point")
    colors, scene = run(job).colors[0], job.scene
    rest = scene.vertices[np.unique(scene.triangles[scene.object == 0]), 0] < 0.25
    assert rest.sum() == 2 and colors[rest] == pytest.approx(RHO, rel=0.1)


def test_what_is_hidden_in_a_gap_counts_as_buried():
    """Two sheets at 1 mm: all but a few receivers at their edges. A third sheet 1 m below is seen."""
    sheet = SQUARE * 20 - 10, FLOOR[1]
    sheet[0][:, 2] = 0
    above, below = ((sheet[0] * (1, 1, 0) + (0, 0, z), sheet[1]) for z in (0.001, -1))
    over = above[0], above[1][:, ::-1]
    job = job_of([sheet, over, below], 0, target="vertex")
    scene = job.scene
    targets = [replace(job.targets[0], name=str(i), start=2 * i, stop=2 * i + 2) for i in range(3)]
    job = replace(job, targets=tuple(targets))
    layout = lay_out(job, silent)
    context = open_scene(scene, layout.receivers, job.settings, silent)
    seen, lengths = seen_layout(layout, context)
    count = layout.spans[1]
    few, shown = seen.spans[2:]
    assert few < 0.01 * count and shown - few == count and len(lengths) == shown
    assert seen.receivers.count == shown and seen.buried.count == 3 * count - shown
    covered = replace(layout, receivers=slice_receivers(layout.receivers, 100, 110), spans=(0, 10))
    assert seen_layout(covered, context)[0].receivers.count == 10, "where all are hidden, all stay"


def test_colors_of_a_small_covered_sheet_do_not_count():
    """A sheet of 1 × 1 with a black one 20 cm above it, beside a sheet of 20 × 20: it has a four-hundredth of the surface."""
    large, faces = SQUARE * 20 - 10, FLOOR[1]
    large[:, 2] = 0
    small = SQUARE * 1.0 + (12, 0, 0)
    small[:, 2] = 0
    parts = [(large, faces), (small, faces), (small + (0, 0, 0.2), faces[:, ::-1])]
    job = job_of(parts, 0, target="vertex")
    targets = tuple(replace(job.targets[0], name=str(i), start=2 * i, stop=2 * i + 2) for i in range(2))
    job = replace(job, targets=targets)
    layout = lay_out(job, silent)
    _, fits = run_stage._opened(job, layout, open_scene(job.scene, layout.receivers, job.settings, silent))
    area = run_stage._where_judged(fits).area
    seen = np.concatenate([each.fit.seen() for each in fits])
    assert seen[6:].max() < 0.5 * seen[:6].min()
    assert area[:6].sum() == pytest.approx(400, rel=1e-3) and not area[6:].any()


def test_the_least_seen_hundredth_of_the_surface_does_not_count():
    area, seen = np.full(300, 2.0), np.arange(300.0)[::-1]
    counted = counted_areas(area, seen)
    assert (counted[:297] == 2).all() and (counted[297:] == 0).all()
    assert (counted_areas(np.ones(4), seen[:4]) == 1).all(), "a quarter of all is more than a hundredth"


def test_the_underside_of_a_box_on_a_sheet_is_black():
    """From just below the sheet the whole sky could be seen."""
    floor = SQUARE * 20 - 10, FLOOR[1]
    floor[0][:, 2] = 0
    colors = run(job_of([floor, block()], 1, others=RHO, target="vertex")).colors[0]
    triangles = np.arange(len(colors)).reshape(-1, 3)
    vertices, faces = block()
    p = vertices[faces]
    down = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])[:, 2] < 0
    assert down.sum() == 2 and not colors[triangles[down]].any()
    assert (colors[triangles[~down]] > 0).all()


def test_the_underside_of_a_box_on_a_sheet_is_black_in_images():
    """Faces of two triangles each in cells of a grid of 4 × 2, with 4 of 16 texels' width, a texel apart:
    the underside's own is black, the others' are not."""
    floor = SQUARE * 20 - 10, FLOOR[1]
    floor[0][:, 2] = 0
    vertices, faces = block()
    p = vertices[faces]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    axis = np.abs(normal).argmax(1)
    side = 2 * axis + (normal[np.arange(12), axis] > 0)  # of 6
    inside = np.stack([np.delete(p[i], axis[i], 1) - np.delete(vertices, axis[i], 1).min(0)
                       for i in range(12)])  # fmt: skip
    inside /= np.ptp(inside, axis=(1), keepdims=True)
    uv = (4 * np.stack([side % 4, side // 4], 1)[:, None] + 0.5 + 3 * inside) / 16
    box = vertices, faces
    image = run(job_of([floor, box], 1, uv, others=RHO, target="image", margin=0)).colors[0]
    for number in range(6):
        row, column = 4 * (number // 4) + 1, 4 * (number % 4) + 1
        own = image[row : row + 2, column : column + 2]
        assert (own[..., 3] == 1).all() and own[..., :3].any() == (number != 4)
