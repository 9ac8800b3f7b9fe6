"""The benchmarks' own arithmetic, and tiny runs of them, so that they cannot rot."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.ladder import Rung, seconds_for
from benchmarks.scene_parts import matte, plane_under_white_sky, point


def rung(seconds, error, method="Cycles"):
    from verification.error import Measured

    return Rung(method, "", seconds, Measured(error, 0.0))


def test_time_for_an_error():
    """From 8 s at 4 % and 32 s at 2 %: 2.83 % takes 16 s; 1 %, beyond the ladder, 32 · (2/1)²."""
    rungs = [rung(8, 0.04), rung(32, 0.02), rung(1, 0.5, "other")]
    assert seconds_for(0.04 / np.sqrt(2), rungs) == pytest.approx(16)
    assert seconds_for(0.01, rungs) == pytest.approx(128)
    assert seconds_for(0.5, rungs) == 8
    assert np.isnan(seconds_for(0.01, rungs, "nobody"))
    stuck = [rung(1, 0.02, "OIDN"), rung(4, 0.02, "OIDN")]
    assert seconds_for(0.01, stuck, "OIDN") == np.inf


def test_cycles_bake_sees_a_furnace_wall_and_leaves_the_file_as_it_was(blender):
    """A plane under a white sky of radiance 0.5: a matte 0.8 reflects 0.4."""
    from benchmarks.cycles import cycles_bake

    bpy = blender
    plane = plane_under_white_sky("Radiosity")
    before = (len(bpy.data.images), len(bpy.data.materials), bpy.context.scene.render.engine)
    pixels, mask, seconds = cycles_bake(plane, 8, 4, passes=("direct", "indirect", "color"))
    assert mask.all() and seconds > 0
    np.testing.assert_allclose(pixels, 0.4, atol=1e-3)
    after = (len(bpy.data.images), len(bpy.data.materials), bpy.context.scene.render.engine)
    assert after == before
    with pytest.raises(ValueError, match="no UV map 'Missing'"):
        cycles_bake(plane, 8, 1, uv_map="Missing")


def test_references_are_kept_until_the_scene_changes(blender, tmp_path, monkeypatch):
    from benchmarks import references

    monkeypatch.setenv("RADIOSITY_REFERENCES", str(tmp_path))
    bpy = blender
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(matte("Matte", (0.8, 0.8, 0.8)))
    plane.data.uv_layers[0].name = "Radiosity"
    point("Lamp", (0, 0, 1), 10.0, 1.0)
    passes = ("direct", "color")
    first = references.cycles_references(plane, 8, 2, passes)
    again = references.cycles_references(plane, 8, 2, passes)
    assert np.array_equal(first.a, again.a) and not np.array_equal(first.a, first.b)
    assert len(list(tmp_path.iterdir())) == 2
    bpy.data.lights[0].energy *= 2
    references.cycles_references(plane, 8, 2, passes)
    assert len(list(tmp_path.iterdir())) == 4


def test_denoiser_only_where_installed():
    from benchmarks.denoise import available, denoise

    pixels = np.ones((16, 16, 3))
    result = denoise(pixels, np.ones((16, 16), bool))
    assert (result is not None) == available()


def rows_of_a_study():
    """Ours: 3 % asked, 2 % reached in 1 s. Cycles: 4 % in 8 s and 2 % in 32 s: 32 times slower."""
    from benchmarks.study import Row

    return [
        Row("box", "ours", 0.03, 0, 1.0, 0.02, 0.0, 0.025, 0.6, 5000, 10**6),
        Row("box", "ours", 0.01, 0, 2.0, 0.01, 0.0, 0.03, 1.2, 9000, 10**7),
        Row("box", "ours", 0.003, 0, 4.0, 0.005, 0.0, 0.005, 2.4, 9000, 10**8),
        Row("box", "Cycles", 16.0, 0, 8.0, 0.04, 0.0),
        Row("box", "Cycles", 64.0, 0, 32.0, 0.02, 0.0),
    ]


def test_trade_by_hand(tmp_path):
    """2 of 3 bakes keep the asked error; estimated/measured are 1.25, 3 and 1: 2 of 3 are within
    a factor of two; time doubles while the error halves: slope 1."""
    from benchmarks.trade import speedups, summary, time_slopes, write_trade

    rows = rows_of_a_study()
    assert speedups(rows, "Cycles") == {"box": pytest.approx(32.0)}
    assert time_slopes(rows[:3])["box"] == pytest.approx(1.0)
    text = summary(rows)
    assert "in 67 % of 3 bakes" in text and "between 0.5 and 2 in 67 %" in text
    assert "32.0 × faster than Cycles" in text and "error^−1.00" in text
    page = write_trade(rows, tmp_path, "a machine").read_text(encoding="utf-8")
    assert "| box | Cycles | 64 samples | 32.00 | 2.00 % |" in page


def test_being_far_better_than_asked_counts_as_a_third():
    """Ours exact in 1 s, asked for 3 %: judged at 1 %, for which Cycles needs 32 · 2² = 128 s."""
    from dataclasses import replace

    from benchmarks.trade import speedups

    rows = rows_of_a_study()
    rows[0] = replace(rows[0], measured=0.0)
    assert speedups(rows, "Cycles") == {"box": pytest.approx(128.0)}


def test_study_rows_survive_the_file(tmp_path):
    from benchmarks.study import read_csv, write_csv

    rows = rows_of_a_study()
    write_csv(rows, tmp_path / "study.csv")
    assert repr(read_csv(tmp_path / "study.csv")) == repr(rows)


def test_quads_face_where_they_should():
    """Signed volumes ∫ x·n/3 dA: a room faces inwards, a block and a column outwards."""
    from benchmarks.quads import block, column, room, wall_with_window

    def volume(quads):
        return sum(np.cross(q[1] - q[0], q[2] - q[0]) @ q[0] for q in quads) / 3

    assert volume([quad for _, quad in room((1, 1, 1), (2, 3, 4))]) == pytest.approx(-6)
    assert volume(block((1, 1, 1), (2, 3, 4))) == pytest.approx(6)
    assert len(block((0, 0, 0), (1, 1, 1))) == 5
    hexagon = 6 * np.sqrt(3) / 4  # area of radius 1; the side alone gives 2/3 of the volume
    assert volume(column((0, 0), 1.0, 2.0, 6)) == pytest.approx(2 / 3 * 2 * hexagon)
    wall = wall_with_window((0, 4), (0, 3), 0.0, 0.2, (1, 2), (1, 2))
    areas = [np.linalg.norm(np.cross(q[1] - q[0], q[3] - q[0])) for q in wall]
    assert sum(areas) == pytest.approx(4 * 3 - 1 + 4 * 0.2)


@pytest.mark.parametrize("name", ["cornell", "window_room", "lamp_hall", "street", "furnace"])
def test_scenes_build(blender, name):
    from benchmarks.scenes import SCENES

    obj = SCENES[name].build()
    mesh = obj.data
    assert not mesh.validate() and len(mesh.polygons) >= 16
    assert all(slot.material for slot in obj.material_slots)
    assert max(face.material_index for face in mesh.polygons) < len(mesh.materials)


def test_a_scene_whose_file_is_missing_is_named(blender, monkeypatch, tmp_path):
    from benchmarks.scenes import SCENES, SceneMissing

    monkeypatch.setenv("RADIOSITY_SCENES", str(tmp_path))
    with pytest.raises(SceneMissing, match=r"room\.blend does not exist"):
        SCENES["room"].build()


def test_a_look_at_a_bake_shows_its_colors(blender, tmp_path):
    """Every face emits the image's 0.5: the center of the picture, in sRGB, is 188 of 255."""
    from benchmarks.look import picture, show
    from benchmarks.scenes import SCENES

    bpy = blender
    obj = SCENES["cornell"].build()
    obj.data.uv_layers.new(name="Radiosity")
    show(obj, np.full((8, 8, 3), 0.5))
    picture("cornell", tmp_path / "look.png", width=32)
    image = bpy.data.images.load(str(tmp_path / "look.png"))
    assert tuple(image.size) == (32, 20)
    center = np.array(image.pixels[:]).reshape(20, 32, 4)[10, 16, :3]
    np.testing.assert_allclose(center, 188 / 255, atol=2 / 255)


def test_flip_of_pictures(blender, tmp_path):
    """A picture and itself: 0. Black and white: 0.967, as 1 is what saturated green and blue differ by, and
    half of it where only half of the picture is white; what does not count does not. A tiny table has a line of noise, one of ours and one of Cycles'."""
    pytest.importorskip("flip_evaluator")
    from benchmarks import flip

    paths = {}
    for name, white in (("black", 0), ("half", 16), ("white", 32)):
        image = blender.data.images.new(name, 32, 20)
        pixels = np.zeros((20, 32, 4), np.float32)
        pixels[..., 3], pixels[:, :white] = 1, 1
        image.pixels.foreach_set(pixels.ravel())
        paths[name] = tmp_path / f"{name}.png"
        image.filepath_raw, image.file_format = str(paths[name]), "PNG"
        image.save()
    every, left = np.ones((20, 32), bool), np.arange(32) < np.full((20, 1), 16)
    assert flip.flip(paths["half"], paths["half"], every) == (0, 0)
    assert flip.flip(paths["black"], paths["white"], every) == pytest.approx((0.967, 0.967), abs=0.005)
    mean, most = flip.flip(paths["black"], paths["half"], every)
    assert mean == pytest.approx(0.967 / 2, abs=0.1) and most == pytest.approx(0.967, abs=0.04)
    assert flip.flip(paths["black"], paths["half"], left)[0] == pytest.approx(1, abs=0.1)
    assert flip.flip(paths["black"], paths["half"], ~left) == (0, 0)  # what does not count shows nowhere
    options = {"errors": (0.3,), "size": 16, "samples": 1, "truth": 1, "width": 32, "folder": tmp_path / "views"}
    rows = list(flip.measure("cornell", SimpleNamespace(**options)))
    assert [row.name.split(",")[0] for row in rows[:3]] == ["path-traced again", "ours", "Cycles"]
    assert all(0 < row.mean <= row.most <= 1 for row in rows)


def test_tiny_study(blender, tmp_path, monkeypatch):
    """A cube room at 24²: our bake keeps 10 % (and the noise of 64-sample references, 5 times its
    standard error), the page is written, and a budget of nothing leaves the scene out by name."""
    from dataclasses import replace

    from benchmarks.scenes import StudyScene, lit_by_a_lamp_panel
    from benchmarks.study import Plan, run_study, write_csv
    from benchmarks.trade import write_trade

    monkeypatch.setenv("RADIOSITY_REFERENCES", str(tmp_path / "references"))
    scene = StudyScene("cube", lit_by_a_lamp_panel, size=24, reference=64)
    plan = Plan((scene,), errors=(0.1,), seeds=(0,), samples=(1,))
    said = []
    rows = run_study(plan, said.append)
    ours = [row for row in rows if row.method == "ours"]
    assert len(ours) == 1 and ours[0].rays > 0 and ours[0].elements > 0
    assert ours[0].measured <= 0.1 + 5 * ours[0].uncertainty
    assert any(row.method == "Cycles" and row.measured > ours[0].measured for row in rows)
    write_csv(rows, tmp_path / "study.csv")
    assert "| cube | ours | 10 % |" in write_trade(rows, tmp_path, "here").read_text("utf-8")
    assert run_study(replace(plan, budget=-1.0), said.append) == []
    assert said[-1] == "cube: left out, the budget of -1 s is spent"


def test_tiny_cornell(blender, tmp_path, monkeypatch):
    from benchmarks.cornell import measure

    monkeypatch.setenv("RADIOSITY_REFERENCES", str(tmp_path))
    said = []
    result = measure((0.1,), (0,), (1,), 16, size=32, say=said.append)
    methods = [rung.method for rung in result["rungs"]]
    assert methods[:2] == ["ours", "Cycles"]
    assert any("as good: Cycles" in line for line in said)


def test_tiny_bakes_again(blender):
    from benchmarks.again import measure, table
    from benchmarks.scenes import lit_by_a_lamp_panel

    rows = measure(lit_by_a_lamp_panel, error=0.1, size=16)
    assert [row.reused for row in rows] == ["solution"] * 3 + ["transport"]
    assert sum(row.again for row in rows) < 0.9 * sum(row.fresh for row in rows)
    assert table(rows).count("\n") == 5


def test_small_large_mesh(blender):
    """A head's 468 quads and 32 triangles become 1,968 quads at level 1, four times as many at
    level 2; each two triangles. Two heads of level 1, one of level 2, and the box's 12."""
    from benchmarks.large import FIGURES, measure

    report = measure(2, 0.5)
    assert set(FIGURES) < set(report)
    assert report["triangles"] == 2 * 2 * 1968 + 2 * 4 * 1968 + 12
    assert report["estimated_error"] <= 0.5


def test_vertex_colors_beside_finer_ones(blender):
    """The cube room: what is found is near what was said, and the finer bakes near each other."""
    from benchmarks.scenes import lit_by_a_lamp_panel
    from benchmarks.vertices import measure

    said = []
    (row,) = measure(lit_by_a_lamp_panel(), [0.1], [0], 0.04, said.append)
    assert len(said) == 2 and row.most.error <= row.found.error <= row.asked
    assert row.found.error < 2 * row.said


def test_shares_of_a_bake(blender):
    """Every work takes a part, none more than all; a function that got another name would be 0."""
    from benchmarks.scenes import lit_by_a_lamp_panel
    from benchmarks.shares import WORKS, shares

    seconds, found = shares(lit_by_a_lamp_panel(), 64, 0.1, 1)
    assert seconds > 0 and len(found) == 1 + len(WORKS)
    assert all(0 < share < 1 for share in found.values())


@pytest.mark.slow
@pytest.mark.parametrize("number", range(4))
def test_real_scenes_in_a_furnace(number, blender):
    from benchmarks.stability import measure
    from benchmarks.stability_real import CASES

    row = measure(CASES[number])
    if np.isnan(row.deviation):
        pytest.skip(row.verdict)
    assert row.held, row.verdict
