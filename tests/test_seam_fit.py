"""Bakes of two slabs side by side, an image each: what both show along their common edge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import ExportedObject
from radiosity_addon.bake.shown import Sheets
from radiosity_addon.bake_job import Job, run
from radiosity_addon.settings import Settings
from radiosity_addon.solver.scene import PointLamp
from radiosity_addon.stages.tiling import Tiling, tiles_of
from verification import meshes

QUAD = np.array([(0, 1, 2), (0, 2, 3)])
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
WALL = np.array([(1, -3, 0), (1, 4, 0), (1, 4, 3), (1, -3, 3)], float), QUAD
SIZE = 16
EDGE = 0.61  # of the image: the slab's extent; 9.76 texels from 3.12 on
LOW = 0.195


def slab_images(*args, **options):
    """Images of the slabs of ``slab_job``."""
    return run(slab_job(*args, **options)).colors


def slab_job(parts=(), reflectances=(0.5, 0.5), low=LOW, edge=EDGE, **options):
    """Two slabs, side by side along x, that stand in [low, low + edge]² of an image each."""
    every = [(SQUARE, QUAD), (SQUARE + [1, 0, 0], QUAD), *parts]
    rho = [[r] for r in reflectances] + [[0.5]] * len(parts)
    scene = meshes.scene(every, rho)
    lamp = PointLamp("Lamp", np.array([0.7, 0.5, 0.5]), np.full(3, 10.0))
    targets = []
    for number in range(2):
        own = np.flatnonzero(scene.object == number)
        place = scene.vertices[scene.triangles[own]][..., :2] - (number, 0)
        targets.append(ExportedObject(
            f"Slab{number}", int(own[0]), int(own[-1]) + 1, low + edge * place, None, None, None
        ))  # fmt: skip
    settings = Settings(target="image", resolution=SIZE, error=0.02, **options)
    return Job(settings, replace(scene, lamps=(lamp,)), tuple(targets), (), (), ())


def along_the_edge(*args, low=LOW, edge=EDGE, inside=0.0, tiling=None, **options):
    """What both slabs show at places (50,) on their common edge, or ``inside`` texels before it."""
    images = run(slab_job(*args, low=low, edge=edge, **options), tiling=tiling).colors
    y, before = np.linspace(0.02, 0.98, 50), inside / SIZE / edge
    return [shown(images[0], low + edge * np.c_[np.full(50, 1 - before), y]),
            shown(images[1], low + edge * np.c_[np.full(50, before), y])]  # fmt: skip


def shown(image, uv) -> np.ndarray:
    """(k,) what is shown at ``uv`` (k, 2)."""
    sheets = Sheets(np.array([SIZE]), np.array([SIZE]))
    stencils = sheets.stencils(np.zeros(len(uv), int), SIZE * uv)
    return stencils.of(image.reshape(-1, 4).astype(float))[:, 0]


def test_slabs_side_by_side_show_the_same():
    """The lamp is h = 0.5 above and x = 0.3 beside the edge: light falls as (h² + x²)^-2, by
    4 x / (h² + x²) = 3.5 / m, 36 % a texel of 0.102 m. 0.88 of the outermost texels are covered, so
    that their means, which are shown at the edge, are those of places 0.88 of a texel apart: some
    25 % jump. With the fit they differ by what the weight λ leaves: less than a fiftieth of that."""
    plain = along_the_edge(margin=0)
    fitted = along_the_edge()
    inner = slice(8, 42)  # without a margin the ends of the edge show black too
    jumps = [np.abs(a - b)[inner] / ((a + b) / 2)[inner] for a, b in (plain, fitted)]
    assert jumps[0].max() > 0.05
    assert jumps[1].max() < 0.005


def test_slabs_in_tiles_show_the_same():
    """Each image in two tiles, which overlap by four texels: whatever is known of texels near the seam comes in four
    parts. The jumps are as small as those of one piece, and so is what is shown but for the error of both, 2 %."""
    tiling = Tiling(undivided=100, tile=60, survey=64, overlap=4)
    assert [len(tile) for tile in tiles_of(slab_job(), tiling)] == [1, 1, 1, 1]
    inner = slice(8, 42)
    plain, tiled, one = (
        np.array(along_the_edge(**options))[:, inner]
        for options in ({"margin": 0, "tiling": tiling}, {"tiling": tiling}, {})
    )
    jumps = [np.abs(a - b) / ((a + b) / 2) for a, b in (plain, tiled)]
    assert jumps[0].max() > 0.05
    assert jumps[1].max() < 0.005
    assert np.sqrt(((tiled / one - 1) ** 2).mean()) < 0.03


def test_jumps_are_smaller_than_steps_between_two_texels_inside():
    """As our unwrap lays slabs out: 13 texels wide, ending in the middles of texels. There is shown what
    is known a quarter of a texel before: the slabs jump by half of what the light falls a texel of
    1/13 m, 26 %, so by some 13 % where the lamp is nearest. With the fit both sides of the border show what
    lies on the line through what is known 1/4 and 1 texel before, off by half of the light's curvature
    times 1/4, the same for both; less than a tenth of the step from 1.5 to 2.5 texels before the border
    is left."""
    layout = {"low": 1.5 / SIZE, "edge": 13 / SIZE}
    near, far = (along_the_edge(**layout, inside=at) for at in (1.5, 2.5))
    inner = slice(8, 42)
    step = np.abs(near[0] - far[0])[inner] / near[0][inner]
    jumps = [np.abs(a - b)[inner] / a[inner]
             for a, b in (along_the_edge(**layout, margin=0), along_the_edge(**layout))]  # fmt: skip
    assert jumps[0].max() > 0.08
    assert jumps[1].max() < 0.1 * step.max()


def test_texels_of_which_a_part_is_buried_keep_their_means():
    """A block stands across the seam, sunk into both slabs: x from 0.77 to 1.23, y from 0.31 to 0.69.
    In texels of 1/13 m the slabs' 13 from 1.5 on end in the middles of texels; the block's sides are at
    0.77 · 13 + 1.5 = 11.51 of the first and 0.23 · 13 + 1.5 = 4.49 of the second slab, at rows 5.53 and
    10.47. Texels beside the seam, column 14 and 1, that it cuts are those of rows 5 and 10. Dark or not,
    they keep the means of what shows of them, and so do all that lie on a face wholly; the others in
    the column beside the seam change."""
    corners = np.array([(x, y, z) for z in (-0.1, 0.3) for x, y in
                        ((0.77, 0.31), (1.23, 0.31), (1.23, 0.69), (0.77, 0.69))])  # fmt: skip
    quads = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    block = corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    layout = {"low": 1.5 / SIZE, "edge": 13 / SIZE}
    plain, fitted = (slab_images([block], **layout, margin=margin) for margin in (0, 8))
    for column, one, other in zip((14, 1), plain, fitted):
        same = (one == other).all(-1) | (one[..., :3] == 0).all(-1)  # wholly buried: filled
        rows = np.arange(2, 14)
        assert same[rows][:, np.arange(SIZE) != column].all()
        assert same[[5, 10], column].all()
        assert not same[[2, 3, 4, 11, 12, 13], column].any()


def test_light_does_not_bleed_where_a_wall_stands_on_the_seam():
    """Behind the wall there is nothing but what is reflected from far: less than a hundredth."""
    bright, dark = along_the_edge([WALL])
    assert dark.max() < 0.01 * bright.min()


def test_slabs_of_two_colors_keep_them():
    """Of reflectances 0.8 and 0.1: 8 to 1 by their color. Nothing joins them, so that each shows at
    the edge what it knows 0.38 of a texel before: up to 2 · 0.38 · 36 % = 27 % besides."""
    one, other = along_the_edge(reflectances=(0.8, 0.1), passes=("direct", "color"))
    assert (one / other > 8).all() and (one / other < 8 * 1.28).all()


def test_slabs_of_two_colors_have_the_same_light():
    """Without their color they are one surface."""
    one, other = along_the_edge(reflectances=(0.8, 0.1), passes=("direct",))
    assert one / other == pytest.approx(1, abs=0.005)


def crowded_job(**options):
    """The second slab as thin as 0.3 of a texel in its image, beside another that shares its texels: that one is 5 m
    above, with a lamp that lights nothing else, a hundred times as bright."""
    job = slab_job([(SQUARE + [0, 0, 5], QUAD)], **options)
    first, second = job.targets
    above = LOW + 0.5 / SIZE + np.array([0.3, EDGE]) * job.scene.vertices[job.scene.triangles[4:6], :2]
    uv = np.concatenate([LOW + (second.uv - LOW) * [0.3 / SIZE / EDGE, 1], above])
    crowded = replace(second, stop=6, uv=uv)
    lamp = PointLamp("Above", np.array([0.5, 0.5, 5.5]), np.full(3, 1000.0))
    scene = replace(job.scene, lamps=(*job.scene.lamps, lamp))
    return replace(job, scene=scene, targets=(first, crowded))


def test_no_light_comes_over_a_seam_from_another_island():
    """What is shown of the second slab is mostly what is above it, of which the first one gets nothing."""
    plain, fitted = (run(crowded_job(margin=margin)).colors for margin in (0, 8))
    assert np.nanmax(plain[1][..., :3]) > 50 * plain[0][..., :3].max()
    on = plain[0][..., 3] == 1
    assert on.sum() == 100 and np.array_equal(plain[0][on], fitted[0][on])


def test_tiles_tell_what_cannot_be_fitted():
    """Slabs half a texel wide and 9.76 long, in tiles of two texels: the same words as of one piece."""
    job = slab_job(edge=np.array([0.5 / SIZE, EDGE]))
    tiling = Tiling(undivided=5, tile=2, survey=16, overlap=2)
    assert len(tiles_of(job, tiling)) > 2
    one, tiled = (run(job, tiling=each).warnings for each in (None, tiling))
    assert sum("'Slab0', 'Slab1': " in text and "thinner than a texel (up to 100 %)" in text for text in one) == 1
    assert one == tiled


@pytest.mark.parametrize(("edge", "told"), [(EDGE, False), (0.5 / SIZE, True)])
def test_slabs_thinner_than_a_texel_are_warned_of(edge, told):
    """Half a texel wide and high, inside one texel of theirs: all of their surface."""
    warnings = [text for text in run(slab_job(edge=edge)).warnings if "could not be fitted" in text]
    assert len(warnings) == told
    assert all("'Slab0', 'Slab1': 2 texels" in text and "thinner than a texel (up to 100 %)" in text for text in warnings)


def test_triangles_with_vertices_of_their_own_are_fitted():
    """As meshes from games have them: the same image as with vertices in common, and no warning."""
    job = slab_job()
    scene, count = job.scene, 3 * len(job.scene.triangles)
    own = replace(scene, vertices=scene.vertices[scene.triangles].reshape(-1, 3),
                  triangles=np.arange(count).reshape(-1, 3))  # fmt: skip
    first, second = run(job), run(replace(job, scene=own))
    assert first.warnings == second.warnings == ()
    for one, other in zip(first.colors, second.colors):
        assert one == pytest.approx(other, abs=1e-6)
