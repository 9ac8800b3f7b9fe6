"""The command line end to end: files in, files out, exit statuses, and nothing else touched."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon import command, report  # noqa: E402
from tests.one_core import FAST, main  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
DRAFT = ["--quality", "draft"]


def colors_of(blender, path, name="Radiosity", item="Box") -> np.ndarray:
    """(n, 4) float32 colors of the attribute, read back from the saved file."""
    blender.ops.wm.open_mainfile(filepath=str(path))
    data = blender.data.objects[item].data.color_attributes[name].data
    colors = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", colors)
    return colors.reshape(-1, 4)


@pytest.fixture
def sunlit(blender, tmp_path):
    """A square, reflectance 0.5, below a sun of irradiance π at 60° from its normal.

    Its radiance is ρ E cos 60° / π = 0.5 · π · 0.5 / π = 0.25, the same everywhere; its other
    side is dark and nothing else is there.
    """
    mesh = blender.data.meshes.new("Square")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    material = blender.data.materials.new("Gray")
    if not material.node_tree:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    sun = blender.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = np.pi, 0
    for name, data in (("Box", mesh), ("Sun", sun)):
        blender.context.scene.collection.objects.link(blender.data.objects.new(name, data))
    blender.data.objects["Sun"].rotation_euler = (np.pi / 3, 0, 0)
    path = tmp_path / "sunlit.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def test_vertex_colors_of_a_sunlit_square(sunlit, blender, capfd):
    before = sunlit.read_bytes()
    assert command.main([str(sunlit)]) == 0
    out, err = capfd.readouterr()
    assert len(out.splitlines()) == 5 and str(sunlit.with_name("sunlit_baked.blend")) in out
    assert err == ""
    assert sunlit.read_bytes() == before
    assert sorted(path.name for path in sunlit.parent.iterdir()) == [
        "sunlit.blend",
        "sunlit_baked.blend",
    ]
    colors = colors_of(blender, sunlit.with_name("sunlit_baked.blend"))
    assert colors.shape == (4, 4)
    assert colors[:, :3] == pytest.approx(0.25, rel=1e-5)
    assert colors[:, 3] == pytest.approx(1)
    attribute = blender.data.objects["Box"].data.color_attributes["Radiosity"]
    assert (attribute.data_type, attribute.domain) == ("FLOAT_COLOR", "CORNER")


def test_point_domain_and_name(sunlit, blender):
    output = sunlit.with_name("out.blend")
    words = ["--domain", "point", "--name", "Light", "--output", str(output)]
    assert main([str(sunlit), *words]) == 0
    assert colors_of(blender, output, "Light")[:, :3] == pytest.approx(0.25, rel=1e-5)
    assert blender.data.objects["Box"].data.color_attributes["Light"].domain == "POINT"


@pytest.mark.parametrize(
    ("passes", "radiance"),
    [
        ("direct", 0.5),  # without color: irradiance / π = cos 60°
        ("color", 0.5),  # the reflectance itself
        ("indirect,color", 0.0),  # nothing else is there
        ("emit", 0.0),
    ],
)
def test_passes(passes, radiance, sunlit, blender):
    assert main([str(sunlit), "--passes", passes, "--output", str(sunlit)]) == 0
    assert colors_of(blender, sunlit)[:, :3] == pytest.approx(radiance, rel=1e-5)


def test_image_target_makes_a_uv_map_and_writes_a_file(sunlit, blender):
    folder = sunlit.parent / "images"
    folder.mkdir()
    words = "--target image --resolution 32 --name Lit --format exr --image-dir".split()
    assert main([str(sunlit), *words, str(folder)]) == 0
    blender.ops.wm.open_mainfile(filepath=str(sunlit.with_name("sunlit_baked.blend")))
    assert "Radiosity" in blender.data.objects["Box"].data.uv_layers
    image = blender.data.images["Lit_Box"]
    assert tuple(image.size) == (32, 32) and image.is_float
    check_sunlit_pixels(image)
    written = list(folder.iterdir())
    assert [path.suffix for path in written] == [".exr"]
    check_sunlit_pixels(blender.data.images.load(str(written[0])))


def check_sunlit_pixels(image):
    pixels = np.empty(32 * 32 * 4, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(-1, 4)
    covered = pixels[:, 3] > 0
    assert covered.sum() > 100
    assert pixels[covered, :3] == pytest.approx(0.25, rel=1e-5)


def test_output_named_as_the_input_replaces_it(sunlit, blender):
    assert main([str(sunlit), "--output", str(sunlit)]) == 0
    assert [path.name for path in sunlit.parent.iterdir()] == ["sunlit.blend"]
    assert colors_of(blender, sunlit)[:, :3] == pytest.approx(0.25, rel=1e-5)


def test_only_named_objects_are_baked_and_the_others_still_shadow(sunlit, blender):
    """A roof ten times as wide, 0.1 above the square, hides the sun: the square is black."""
    roof = blender.data.objects.new("Roof", blender.data.objects["Box"].data.copy())
    blender.context.scene.collection.objects.link(roof)
    roof.location.z, roof.scale = 0.1, (10, 10, 1)
    blender.ops.wm.save_as_mainfile(filepath=str(sunlit))
    report = sunlit.with_name("report.json")
    words = ["--objects", "Box", "--output", str(sunlit), "--report", str(report)]
    assert main([str(sunlit), *words, "--passes", "direct"]) == 0
    assert colors_of(blender, sunlit)[:, :3] == pytest.approx(0, abs=1e-6)
    assert "Radiosity" not in blender.data.objects["Roof"].data.color_attributes
    entries = {entry["name"]: entry for entry in json.loads(report.read_text())["objects"]}
    assert entries["Box"] == {"name": "Box", "baked": True, "reason": ""}


def test_report_of_a_real_bake(room):
    report_file = room.with_name("report.json")
    assert main([str(room), *DRAFT, "--report", str(report_file)]) == 0
    report = json.loads(report_file.read_text(encoding="utf-8"))
    assert report["triangles"] == 10
    assert report["target_error"] == 0.1
    assert 0 < report["estimated_error"] <= 0.1
    assert report["receivers"] > 0 and report["rays"] > 0 and report["elements"] > 0
    seconds = report["seconds"]
    stages = sum(value for name, value in seconds.items() if name != "total")
    assert 0 < stages <= seconds["total"] * 1.001
    assert report["peak_memory"] > 50 << 20  # Blender alone has more
    energy = report["energy"]
    # All of a 100 W lamp's light ends somewhere, a sixth at once out of the open front.
    assert energy["emitted"] == pytest.approx(100, rel=1e-9)
    assert energy["absorbed"] + energy["escaped"] == pytest.approx(100, rel=1e-9)
    assert energy["escaped"] > 100 / 6


def test_same_seed_same_colors_whatever_the_threads(room, blender):
    colors = []
    for number, words in enumerate((["--threads=1"], ["--threads=2"], ["--threads=1", "--seed=1"])):
        output = room.with_name(f"{number}.blend")
        assert command.main([str(room), *DRAFT, *words, "--output", str(output)]) == 0
        colors.append(colors_of(blender, output))
    assert np.array_equal(colors[0], colors[1])
    assert not np.array_equal(colors[0], colors[2])


@pytest.mark.parametrize("where, name, words", [
    (command, "_save", []),
    (command, "_export", ["--export", "scene.glb"]),
    (report, "write_report", ["--report", "report.json"]),
])  # fmt: skip
def test_failure_while_writing_leaves_the_earlier_output(where, name, words, room, monkeypatch, capfd):
    output = room.with_name("room_baked.blend")
    output.write_bytes(b"earlier")

    def disk_full(_, path):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(where, name, disk_full)
    words = [*words[:1], *(str(room.with_name(file)) for file in words[1:])]
    assert main([str(room), *FAST, *words]) == 1
    said = capfd.readouterr().err
    assert "No space left" in said
    assert not words or f"{' '.join(words)} cannot be written" in said and "free some space" in said
    assert output.read_bytes() == b"earlier"
    assert sorted(path.name for path in room.parent.iterdir()) == [
        "room.blend",
        "room_baked.blend",
    ]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device on this system")
def test_words_that_nobody_can_read_are_no_failure(room):
    """Standard output is full when the result is in its place: it was written, and that is what the status says."""
    line = [sys.executable, "-m", "radiosity_addon", str(room), *FAST, "--threads", "1"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")
    assert room.with_name("room_baked.blend").exists()


@pytest.mark.parametrize("kind", [KeyError, ValueError, RuntimeError])
def test_a_fault_of_ours_is_one_line_that_says_so(kind, room, monkeypatch, capfd):
    def faulty(*_, **__):
        raise kind("corner")

    monkeypatch.setattr("radiosity_addon.bake_job.run", faulty)
    assert main([str(room)]) == 1
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and f"unexpected {kind.__name__}" in err and "RADIOSITY_DEBUG" in err


def test_demo_through_the_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "radiosity_addon", "--demo", "cornell", *DRAFT],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) == 5
    assert [path.name for path in tmp_path.iterdir()] == ["cornell_baked.blend"]


def test_open_file_never_saved_needs_an_output(blender, capfd):
    assert main([], opened=True) == 1
    assert "--output" in capfd.readouterr().err
