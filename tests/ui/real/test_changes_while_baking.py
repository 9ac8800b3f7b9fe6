"""What goes wrong or changes while a bake runs, and what undo takes back, in a real Blender."""

from __future__ import annotations

import sys
import time

box = sys.modules["box"]  # loaded by conftest.py
IMPORTS, AREA, VIEW = box.IMPORTS, box.AREA, box.VIEW
baked, keep, press, progress, start = box.baked, box.keep, box.press, box.progress, box.start

KILL = """
import os, signal
os.kill(session.current()._process._process.pid, signal.SIGKILL)
"""
# What a bake to images may leave: images, UV maps of our name, color attributes, the report.
TRACES = """
meshes = [item.data for item in bpy.data.objects if item.type == "MESH"]
answer = [len([i for i in bpy.data.images if i.name.startswith("Radiosity")]),
          sum("Radiosity" in mesh.uv_layers for mesh in meshes),
          sum(len(mesh.color_attributes) for mesh in meshes),
          bool(bpy.context.scene.radiosity.report)]
"""


# All that Blender has reported to the user, as its Info editor shows it.
REPORTS = """
window = bpy.context.window_manager.windows[0]
area = next(area for area in window.screen.areas if area.type == "DOPESHEET_EDITOR")
area.type = "INFO"
region = next(region for region in area.regions if region.type == "WINDOW")
with bpy.context.temp_override(window=window, area=area, region=region):
    bpy.ops.info.select_all(action="SELECT")
    bpy.ops.info.report_copy()
area.type = "DOPESHEET_EDITOR"
answer = bpy.context.window_manager.clipboard
"""


def wait_for_end(window) -> None:
    window.until(lambda: progress(window) is None, "the bake does not end", patience=600)


def test_killed_solver_is_a_message(room, tmp_path):
    start(room)
    room.ask(IMPORTS + KILL)
    took = room.until(lambda: progress(room) is None, "the end of the solver is not seen")
    print(f"KILLED seen after {took:.2f} s")
    time.sleep(0.5)
    keep(room, "killed", tmp_path)
    room.point(700, 120)  # over the message, which lies over the button
    room.key("Escape")
    room.point(*VIEW)
    assert "the solver's process stopped (signal 9)" in room.ask(REPORTS)
    assert room.ask(TRACES) == [0, 0, 0, False] and "Traceback" not in room.log


def test_objects_that_change_meanwhile(room):
    """Renamed: followed. Deleted or edited: left out, and the report says so."""
    room.point(*VIEW)
    room.ask("bpy.context.scene.radiosity.quality = 'MEDIUM'")
    start(room)  # the solver has seconds of work, and gives way to the window
    room.ask("""
bpy.data.objects["Sphere"].name = "Ball"
bpy.data.objects.remove(bpy.data.objects["Sphere.001"])
mesh = bpy.data.objects["Sphere.002"].data
mesh.clear_geometry()
mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
""")
    wait_for_end(room)
    assert baked(room) == 15
    told = " ".join(room.ask("""
import json
answer = json.loads(bpy.context.scene.radiosity.report)["warnings"]
"""))
    assert "Sphere.001 was deleted" in told
    assert "Sphere.002 was edited" in told
    assert room.ask("answer = 'Radiosity' in bpy.data.objects['Ball'].data.color_attributes")
    assert "Traceback" not in room.log


def test_edit_mode_is_waited_for(room):
    """The user edits a target when the solver ends: the result waits for Object Mode."""
    room.ask("bpy.context.scene.radiosity.bake_name = 'Second'")
    start(room)
    room.ask(AREA + """
with bpy.context.temp_override(window=window, area=area):
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    bpy.ops.object.mode_set(mode="EDIT")
""")
    room.until(lambda: progress(room)[0] == "WAIT", "the bake does not wait", patience=600)
    room.ask(press("bpy.ops.object.mode_set(mode='OBJECT')"))
    wait_for_end(room)
    assert room.ask("answer = 'Second' in bpy.data.objects['Ball'].data.color_attributes")
    assert "Traceback" not in room.log


def test_undo_takes_images_and_their_uv_maps_back(room):
    room.ask(AREA + """
for item in bpy.data.objects:
    item.select_set(item.name in ("Cornell", "Ball"))
    if item.type == "MESH":
        for name in ("Radiosity", "Second"):
            if name in item.data.color_attributes:
                item.data.color_attributes.remove(item.data.color_attributes[name])
properties = scene.radiosity
properties.report, properties.bake_name = "", "Radiosity"
properties.target, properties.resolution, properties.objects_from = "IMAGE", 64, "SELECTED"
with bpy.context.temp_override(window=window, area=area):
    bpy.ops.ed.undo_push(message="Clean")
""")
    time.sleep(1)
    before = room.ask(TRACES)
    assert before == [0, 0, 0, False]
    start(room)
    wait_for_end(room)
    assert room.ask(TRACES) == [2, 2, 0, True]
    room.point(*VIEW)
    room.key("ctrl+z")
    room.until(lambda: room.ask(TRACES) == before, "undo leaves something of the bake")
    room.key("ctrl+shift+z")
    room.until(lambda: room.ask(TRACES) == [2, 2, 0, True], "redo does not bring the bake")
    means = room.ask("""
answer = [sum(i.pixels[:]) / len(i.pixels) for i in bpy.data.images if "Radiosity" in i.name]
""")
    assert min(means) > 0.05  # the images come back with what is in them
