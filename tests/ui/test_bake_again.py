"""A second bake over the first: other target, same names."""

from __future__ import annotations

import numpy as np
import pytest

from tests.ui.bakes import ALL_PASSES

pytestmark = pytest.mark.usefixtures("solver_here")


@pytest.fixture
def file(file):
    file.context.scene.radiosity.resolution = 16
    return file


@pytest.mark.parametrize("order", [("VERTEX", "IMAGE"), ("IMAGE", "VERTEX")])
def test_both_targets_in_one_file_with_the_default_names(file, order):
    """Attributes and UV maps of a mesh share one set of names, so the second gets another."""
    from radiosity_addon.ui.results import has_result

    properties = file.context.scene.radiosity
    for target in order:
        properties.target = target
        assert file.ops.radiosity.bake() == {"FINISHED"}
    for target in order:
        properties.target = target
        assert has_result(file.data.objects["Box"], properties)


def test_baking_twice_changes_nothing_but_the_report(file):
    colors = []
    for _ in range(2):
        file.ops.radiosity.bake()
        layers = file.data.objects["Box"].data.color_attributes
        assert len(layers) == 1
        colors.append([tuple(item.color) for item in layers[0].data])
    assert colors[0] == colors[1]


@pytest.fixture
def bake(file):
    """A function: bake, all passes at first, and return the report and the colors (n, 4)."""
    from radiosity_addon.ui.report_store import load_report

    file.context.scene.radiosity.passes = ALL_PASSES

    def run(**options):
        for name, value in options.items():
            setattr(file.context.scene.radiosity, name, value)
        assert file.ops.radiosity.bake() == {"FINISHED"}
        layer = file.data.objects["Box"].data.color_attributes.get("Radiosity")
        values = np.empty(0 if layer is None else 4 * len(layer.data), np.float32)
        if layer is not None:
            layer.data.foreach_get("color", values)
        return load_report(file.context.scene), values.reshape(-1, 4)

    return run


def test_what_has_not_changed_is_not_done_again(bake, file):
    first, before = bake()
    assert first["reused"] == "" and first["seconds"]["transport"] > 0
    for options in ({"passes": {"INDIRECT"}}, {"target": "IMAGE"}):
        again, _ = bake(**options)
        assert again["reused"] == "solution", options
        assert again["seconds"]["transport"] == 0
        assert again["estimated_error"] < again["target_error"]
    file.data.lights["Bulb"].energy *= 2  # and so is the light, up to the error asked for, 10 %
    again, after = bake(target="VERTEX", passes=ALL_PASSES)
    assert again["reused"] == "transport" and again["seconds"]["transport"] == 0
    assert np.allclose(after[:, :3], 2 * before[:, :3], rtol=0.1)
    file.data.objects["Bulb"].location.x = 0.5
    assert bake()[0]["reused"] == ""


def test_what_is_kept_goes_with_the_file(bake, file):
    from radiosity_addon.ui.session import kept_file

    bake()
    assert kept_file().exists()
    file.ops.wm.read_homefile(use_empty=True)
    assert not kept_file().exists()


@pytest.mark.parametrize("content", [b"", b"radiosity_addon\n", b"radiosity_addon\nN.", b"\xff"])
def test_unreadable_file_is_ignored(tmp_path, content):
    """Empty, cut short, something else, not even text."""
    from radiosity_addon.ui import keep_file

    (tmp_path / "kept").write_bytes(content)
    assert keep_file.read_kept(tmp_path / "kept").solves == {}
    assert keep_file.read_kept(tmp_path / "none").solves == {}


def test_nothing_is_kept_beyond_the_limit_or_on_a_full_disk(tmp_path, monkeypatch):
    from radiosity_addon.solver.adaptive.solve_cache import SolveCache
    from radiosity_addon.ui import keep_file

    path = tmp_path / "kept"
    kept = SolveCache({"key": np.zeros(100)}, changed=True)  # 800 bytes
    keep_file.write_kept(path, kept, most=800)
    assert len(keep_file.read_kept(path).solves) == 1
    keep_file.write_kept(path, kept, most=799)
    assert keep_file.read_kept(path).solves == {}

    def full(path, content):
        path.write_bytes(b"half")
        raise OSError("No space left on device")

    monkeypatch.setattr(keep_file, "write_payload", full)
    keep_file.write_kept(path, kept)
    assert list(tmp_path.iterdir()) == []
