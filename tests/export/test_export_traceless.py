"""Traceless: after an export the file is what it was, whatever goes wrong. What a bake that ends well leaves, its
export included, ``test_bake_leaves_no_trace.py`` shows."""

from __future__ import annotations

import importlib

import pytest

from radiosity_addon.export import export_scene
from radiosity_addon.settings import Settings
from tests.export.scene_building import add_object, add_plane
from tests.snapshot import add_everything, differences, settled, snapshot


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "VERTEX_PAINT"])
def test_mode_stays_and_materials_are_still_evaluated(blender, export, mode):
    plane = add_everything(blender)
    blender.context.view_layer.objects.active = plane
    plane.select_set(True)
    blender.context.scene.world = None  # its rendering is not what is tested
    blender.ops.object.mode_set(mode=mode)
    scene = export().scene
    assert blender.context.object == plane and plane.mode == mode
    assert hasattr(scene.materials[scene.material[0]].reflectance, "pixels")


WHERE = [("parts", "_read", 1, OSError), ("evaluated", "bake_pass", 3, KeyboardInterrupt),
         ("evaluated", "bake_pass", 6, OSError),
         ("panorama", "render", 2, KeyboardInterrupt)]  # fmt: skip


@pytest.mark.parametrize("module, function, call, error", WHERE)
def test_failure_and_interruption_leave_nothing_either(
    blender, monkeypatch, module, function, call, error
):
    """Raised after the work of a step was done, with its temporary data-blocks still there: the
    third bake is that of what passes a front, the sixth that of what passes a back."""
    room = importlib.import_module(f"radiosity_addon.export.{module}")
    work, calls = getattr(room, function), []

    def fail(*args, **options):
        result = work(*args, **options)
        calls.append(1)
        if len(calls) == call:
            raise error("in the middle")
        return result

    add_everything(blender)
    blender.context.view_layer.update()
    before = settled(blender)
    monkeypatch.setattr(room, function, fail)
    with pytest.raises(error, match="in the middle"):
        export_scene(blender.context, Settings())
    assert differences(before, snapshot(blender)) == {}


def test_canceling_first_midway_and_last_leaves_nothing(blender):
    add_everything(blender)
    blender.context.view_layer.update()
    before = settled(blender)
    fractions = []
    export_scene(blender.context, Settings(), fractions.append)
    assert len(fractions) >= 3
    for last in (0, len(fractions) // 2, len(fractions) - 1):
        reports = iter(fractions[:last])

        def progress(fraction):
            if next(reports, None) is None:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            export_scene(blender.context, Settings(), progress)
        assert differences(before, snapshot(blender)) == {}


def test_an_earlier_render_stays(blender, export, tmp_path):
    scene = blender.context.scene
    add_plane(blender)
    camera = add_object(blender, "Camera", blender.data.cameras.new("Camera"))
    scene.camera = camera
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x = scene.render.resolution_y = 16
    blender.ops.render.render()
    export()
    path = str(tmp_path / "render.png")
    blender.data.images["Render Result"].save_render(path)
    assert tuple(blender.data.images.load(path).size) == (16, 16)


def test_handlers_stay_silent(blender, export):
    add_plane(blender)
    calls = []
    handler = lambda *arguments: calls.append(1)  # noqa: E731
    blender.app.handlers.render_complete.append(handler)
    try:
        export()
        assert calls == [] and handler in blender.app.handlers.render_complete
    finally:
        blender.app.handlers.render_complete.remove(handler)
