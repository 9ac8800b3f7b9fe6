"""Tiles: a bake in parts gives the light of one in one piece, with the error it tells."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import ExportedObject
from radiosity_addon.bake.windows import TexelRect, full_rect
from radiosity_addon.bake_job import Job, run
from radiosity_addon.replicate_process import start_replicate_process
from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.scene import Material, PointLamp, Scene
from radiosity_addon.stages.spool import Spool, drop_pages
from radiosity_addon.stages.tiling import Tiling, part_of, survey_of, tiles_of, windows_of

SMALL = Tiling(undivided=3000, tile=600, survey=1000, overlap=8)  # a 96² image: 16 tiles
SIZE = 96
CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
# The faces of a box, seen from inside: floor, ceiling, and four walls.
SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def room(size: int = SIZE, error: float = 0.04, objects: int = 1, **options) -> Job:
    """A closed box of reflectance 0.5 with a lamp in it; its sides lie on an image in two rows, or
    each half of them on an image of its own."""
    triangles, uv = [], []
    for k, (a, b, c, d) in enumerate(SIDES):
        triangles += [(a, b, c), (a, c, d)]
        corner = np.array([k % 3 / 3, k // 3 / 2]) + np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) / (3, 2)
        uv += [corner[[0, 1, 2]], corner[[0, 2, 3]]]
    uv = np.array(uv)
    each = len(uv) // objects
    targets = tuple(
        ExportedObject(f"Part {k}", k * each, (k + 1) * each, uv[k * each : (k + 1) * each], None, None, None)
        for k in range(objects)
    )  # fmt: skip
    scene = Scene(
        vertices=CORNERS,
        triangles=np.array(triangles, np.int32),
        material=np.zeros(12, np.int32),
        object=np.repeat(np.arange(objects, dtype=np.int32), each),
        materials=(Material("Gray", Constant(np.full(3, 0.5))),),
        objects=tuple(target.name for target in targets),
        lamps=(PointLamp("Lamp", np.array([0.3, 0.4, 0.8]), np.full(3, 10.0), 0.05),),
    )
    settings = Settings(target="image", resolution=size, error=error, threads=1, margin=2, **options)
    return Job(settings, scene, targets, (), (), ())


def relative(image, other) -> float:
    """Root mean square difference of covered texels, relative to max(L, L̄/4) of ``other``; all
    texels of the room have the same area."""
    mine = (image[..., 3] > 0) & (other[..., 3] > 0)
    one, two = (each[mine][:, :3].mean(axis=1) for each in (image, other))
    level = np.maximum(two, two.mean() / 4)
    return float(np.sqrt((((one - two) / level) ** 2).mean()))


@pytest.fixture(scope="module")
def bakes():
    """(in tiles, whole, whole and finer)."""
    return run(room(), tiling=SMALL), run(room()), run(room(error=0.012))


def test_windows_cover_an_image_and_their_weights_add_up_to_one():
    for width, height in ((96, 96), (40, 200), (44, 44), (300, 7)):
        total = np.zeros((height, width))
        for each in windows_of(0, full_rect((width, height)), SMALL):
            assert each.width * each.height <= 2 * SMALL.tile  # with the overlap
            row, column = np.divmod(np.arange(each.width * each.height), each.width)
            total[each.row + row, each.column + column] += each.weight(row, column)
        assert total == pytest.approx(1, abs=1e-6)


def test_small_bakes_are_not_divided():
    job = room()
    assert tiles_of(job, Tiling()) == []
    assert tiles_of(replace(job, settings=replace(job.settings, target="vertex")), SMALL) == []


def test_objects_of_an_atlas_are_divided_by_what_their_faces_cover():
    """The rectangle around an object's UVs is about the whole atlas, of which it has a small part."""
    job = room()
    apart = job.targets[0].uv * 0.1
    apart[-1] += 0.9  # an island in the opposite corner
    targets = tuple(replace(job.targets[0], name=f"Part {k}", uv=apart) for k in range(10))
    many = replace(job, targets=targets)
    assert tiles_of(many, replace(SMALL, undivided=0.11 * SIZE**2)) == []
    assert survey_of(many, SMALL)[1] == 2  # not ceil(sqrt(10 · 96² / 1000)) = 10


def test_parts_have_the_texels_of_the_whole():
    """Every texel of every window lies where it did: the same triangle's same places."""
    from radiosity_addon.solver.progress import silent
    from radiosity_addon.stages.layout import lay_out, lay_out_part

    job = room(size=48)
    receivers = lay_out(job, silent).receivers
    known = {tuple(g[1:]): k for k, g in enumerate(receivers.grid)}
    seen = set()
    for windows in tiles_of(job, replace(SMALL, undivided=1000, tile=700)):
        part = part_of(job, windows)
        found = lay_out_part(part, silent).receivers
        for k, (image, row, column) in enumerate(found.grid):
            rect = part.targets[image].rect
            other = known[row + rect.row, column + rect.column]
            seen.add(other)
            one, two = (
                r.corners[np.flatnonzero(r.receiver == i)] for r, i in ((found, k), (receivers, other))
            )
            assert one == pytest.approx(two, abs=1e-12)
    assert len(seen) == receivers.count


def test_survey_is_coarse_and_covers_the_same_surface():
    from radiosity_addon.solver.progress import silent
    from radiosity_addon.stages.layout import lay_out

    coarse, factor = survey_of(room(), SMALL)
    assert factor == 4  # ceil(sqrt(96² / 1000)) = ceil(3.04)
    receivers = lay_out(coarse, silent).receivers
    assert receivers.count == (SIZE // factor) ** 2
    u, v = (receivers.corners[:, k] - receivers.corners[:, 0] for k in (1, 2))
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) * np.where(receivers.square, 2, 1)
    assert np.bincount(receivers.triangle, area) == pytest.approx(1)


def test_tiles_give_the_light_of_the_whole(bakes):
    """Two independent estimates with errors e and f are √(e² + f²) apart in the mean; the told errors
    are right within a factor of 1.5."""
    tiles, one, _ = bakes
    told = np.hypot(tiles.statistics.estimated_error, one.statistics.estimated_error)
    assert relative(tiles.colors[0], one.colors[0]) < 1.5 * told
    assert tiles.receivers == one.receivers == SIZE**2
    assert np.array_equal(tiles.colors[0][..., 3], one.colors[0][..., 3])


def test_the_told_error_is_true(bakes):
    """Against a bake three times as fine: 0.5 to 2 of what is told, as in docs/cost.md."""
    tiles, _, fine = bakes
    found = relative(tiles.colors[0], fine.colors[0])
    other = fine.statistics.estimated_error
    assert tiles.statistics.estimated_error <= 0.04
    assert found < 2 * np.hypot(tiles.statistics.estimated_error, other)
    assert np.hypot(found, other) > 0.5 * tiles.statistics.estimated_error
    assert 0 < tiles.statistics.error_95 < 0.2


def test_no_seam_between_tiles(bakes):
    """Jumps from row to row, less those of the finer bake: over the borders between tiles, and where
    these begin to fade into each other, no larger than 1.3 times those everywhere. 2 borders and 4
    edges have 96 jumps each: as texels that are smoothed together are alike over about 6, their mean
    square is known to √(2 · 6 / 192) = 25 %, its root to 13 %."""
    tiles, _, fine = bakes
    apart = tiles.colors[0][..., 0] / fine.colors[0][..., 0]
    jumps = np.diff(apart, axis=0)
    windows = [w for tile in tiles_of(room(), SMALL) for w in tile]
    borders = sorted({w.row + w.fade[2] // 2 for w in windows if w.fade[2]})
    edges = sorted({edge for w in windows if w.fade[2] for edge in (w.row, w.row + w.fade[2])})
    inner = [row for row in range(1, SIZE) if row != SIZE // 2]  # the room's own edge lies there
    everywhere = np.sqrt((jumps[np.array(inner) - 1] ** 2).mean())
    for rows in (borders, edges):
        rows = np.array([row for row in rows if row in inner])
        assert len(rows)
        assert np.sqrt((jumps[rows - 1] ** 2).mean()) < 1.3 * everywhere


def test_tiles_of_objects_do_not_depend_on_threads_and_processes():
    """Images of two objects, of which each is a tile or two: the same bits with one thread, and with two
    in two processes."""
    job = room(size=48, error=0.1, objects=2)
    tiling = replace(SMALL, undivided=2000, tile=1500)
    assert {w.target for tile in tiles_of(job, tiling) for w in tile} == {0, 1}
    two = replace(job, settings=replace(job.settings, threads=2))
    with start_replicate_process(2) as twin:
        beside = run(two, tiling=tiling, beside=twin)
        assert twin.rays > 0
    for one, other in zip(run(job, tiling=tiling).colors, beside.colors):
        assert np.array_equal(one, other)


def test_texels_of_several_objects_are_their_mean():
    """Two objects on one image: texels that both have, on the line between them, hold both's light."""
    job = room(size=47, error=0.1, objects=2)
    rect = TexelRect("Atlas", (47, 47), 0, 0, 47, 47)
    job = replace(job, targets=tuple(replace(target, rect=rect) for target in job.targets))
    tiles, one = (run(job, tiling=tiling) for tiling in (replace(SMALL, undivided=2000), None))
    assert len(tiles.colors) == 1
    row = 23  # v = 1/2 lies in the middle of it
    level = one.colors[0][row, :, :3]
    assert np.abs(tiles.colors[0][row, :, :3] / level - 1).mean() < 0.2
    assert len(one.warnings) == 1 and "beside seams" in one.warnings[0]
    assert tiles.warnings == one.warnings


def test_spooled_images_are_what_they_were(tmp_path):
    images = [np.random.default_rng(k).random((5, 7, 4)).astype(np.float32) for k in range(3)]
    for most in (1, 1 << 30):
        spool = Spool(1 << 20, most)
        for kept, image in zip([spool.keep(image) for image in images], images):
            assert np.array_equal(kept, image)
            assert isinstance(kept, np.memmap) == (most == 1)
            kept[2, 3] = 7  # the fit writes to it
            assert (kept[2, 3] == 7).all()


@pytest.mark.skipif(sys.platform != "linux", reason="reads Linux' tables")
def test_what_was_read_of_a_spool_is_given_back():
    """64 MB are read and dropped: the pages that are mapped to files grow by them and fall again."""

    def mapped() -> int:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("RssFile"))

    kept = Spool(1, 1).keep(np.ones((2000, 2000, 4), np.float32))
    before = mapped()
    assert kept.sum() == 2000 * 2000 * 4
    assert mapped() - before > 60e6
    drop_pages(kept)
    assert mapped() - before < 4e6
    assert kept[7, 7, 2] == 1
    drop_pages(np.ones(3))


def test_a_full_disk_is_told(monkeypatch):
    spool = Spool(1, 1)

    class Full:
        def seek(self, *_):
            return 0

        def write(self, _):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(spool, "_file", Full())
    with pytest.raises(OSError, match="takes no image of 0 MB .*No space.*TMPDIR"):
        spool.keep(np.zeros((1, 1, 4), np.float32))


def test_progress_of_tiles_rises_to_the_end():
    told = []
    run(room(size=48, error=0.1), lambda phase, fraction: told.append(fraction), tiling=replace(SMALL, undivided=2000))
    assert told == sorted(told) and 0.9 < told[-1] <= 1
