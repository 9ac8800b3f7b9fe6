"""The report's keys, which scripts rely on, and the five lines people read."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon import __version__
from radiosity_addon.bake_job import Result
from radiosity_addon.report import build_report, summarize, write_report
from radiosity_addon.settings import Settings
from radiosity_addon.solver.solution import Statistics

KEYS = [
    "version", "triangles", "elements", "receivers", "rays", "iterations", "residual",
    "target_error", "estimated_error", "error_95", "encoded_error", "scale", "energy", "seconds",
    "peak_memory", "objects", "warnings",
]  # fmt: skip
SECONDS = ["export", "elements", "transport", "solve", "gather", "write", "total"]


@pytest.fixture
def report():
    job = SimpleNamespace(
        scene=SimpleNamespace(triangles=np.zeros((36, 3), np.int32)),
        settings=Settings(error=0.03),
        targets=(SimpleNamespace(name="Box"),),
        skipped=(("Lamp", "is not a mesh"),),
        warnings=("first", "second"),
    )
    figures = Statistics(
        elements=5300,
        rays=1_234_567,
        iterations=12,
        residual=1e-9,
        target_error=0.03,
        estimated_error=0.021,
        error_95=0.043,
        energy={"emitted": 10.0, "absorbed": 7.5, "escaped": 2.5},
        seconds={"elements": 0.1, "transport": 0.2, "solve": 0.3, "gather": 0.4, "embree": 0.5},
    )
    result = Result((), figures, ("second", "third"), receivers=54000)
    times = {"export": 0.05, "write": 0.06, "total": 1.25}
    return build_report(job, result, times, 512 << 20)


def test_keys(report):
    assert list(report) == KEYS
    assert list(report["seconds"]) == SECONDS
    assert list(report["energy"]) == ["emitted", "absorbed", "escaped"]


def test_values(report):
    assert report["version"] == __version__
    assert (report["triangles"], report["elements"], report["receivers"]) == (36, 5300, 54000)
    assert (report["target_error"], report["estimated_error"]) == (0.03, 0.021)
    assert report["error_95"] == 0.043
    assert report["seconds"]["gather"] == 0.4
    assert report["peak_memory"] == 512 << 20
    assert report["objects"] == [
        {"name": "Box", "baked": True, "reason": ""},
        {"name": "Lamp", "baked": False, "reason": "is not a mesh"},
    ]


def test_a_warning_is_told_once(report):
    assert report["warnings"] == ["first", "second", "third"]


def test_summary_is_five_lines_and_one_for_each_warning_and_object_left_out(report):
    lines = summarize(report, "room_baked.blend").splitlines()
    assert len(lines) == 9
    assert lines[0] == "Baked 1 object into room_baked.blend, 1 object left out:"
    assert lines.pop(1) == "  'Lamp': is not a mesh"
    assert "1,234,567 rays" in lines[1]
    assert "2.1 % estimated, 3 % asked; 95 % of the surface within 4.3 %" in lines[2]
    assert "1.25 s" in lines[3] and "512 MB" in lines[3]
    assert lines[4:] == ["Warnings: 3", "  first", "  second", "  third"]
    report["objects"] += [{"name": f"Box {n}", "baked": False, "reason": "why"} for n in range(5)]
    lines = summarize(report, "room_baked.blend").splitlines()
    assert lines[0].endswith("6 objects left out:")
    assert lines[1:3] == ["  'Lamp': is not a mesh", "  'Box 0', 'Box 1', 'Box 2' and 2 more, each: why"]
    report["warnings"], report["objects"] = [f"number {n}" for n in range(9)], []
    lines = summarize(report, "room_baked.blend").splitlines()[4:]
    assert lines[0] == "Warnings: 9" and lines[5:] == ["  number 4", "  and 4 more (--report has all)"]
    report["warnings"] = ["alone"]
    assert summarize(report, "room_baked.blend").splitlines()[4:] == ["Warnings: alone"]


def test_summary_has_no_exponents_and_no_idle_digits(report):
    report["energy"] = {"emitted": 12345.678, "absorbed": 12300.0, "escaped": 45.678}
    report["error_95"] = 0.9999
    line = summarize(report, "room_baked.blend").splitlines()[3]
    assert "energy 12,300 W emitted, 12,300 W absorbed, 45.7 W escaped" in line
    assert "95 % of the surface within 100 %" in line


def test_json_reads_back_and_keeps_letters(report, tmp_path):
    report["objects"][0]["name"] = "Küche"
    write_report(report, tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text(encoding="utf-8")) == report
    assert "Küche" in (tmp_path / "r.json").read_text(encoding="utf-8")


def test_json_has_no_nan(report, tmp_path):
    report["estimated_error"] = float("nan")
    write_report(report, tmp_path / "r.json")
    assert json.loads((tmp_path / "r.json").read_text())["estimated_error"] is None
