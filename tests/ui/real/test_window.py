"""A real Blender with a window: the button clicked by a real mouse, in the order a user would.

The tests of this file build on one another. ``RADIOSITY_PICTURES`` names a folder that keeps the
screenshots.
"""

from __future__ import annotations

import sys
import time

import pytest

run_blender, box = sys.modules["window"].run_blender, sys.modules["box"]  # by conftest.py
AREA, IMPORTS, BAKE, CANCEL, VIEW = box.AREA, box.IMPORTS, box.BAKE, box.CANCEL, box.VIEW
baked, keep, press, progress, start = box.baked, box.keep, box.press, box.progress, box.start
slowest, soonest = box.slowest, box.soonest
MOST_PAUSE = 0.1  # seconds between two answers of the window


def test_tab_is_shown(room, tmp_path):
    assert room.ask(AREA + "answer = region.active_panel_category") == "Radiosity"
    keep(room, "tab", tmp_path)


def test_click_bakes_while_the_window_answers(room, tmp_path):
    start(room)
    room.ask("pauses.clear()")
    # Blender still draws the scene eight times after it was read: most pauses have to be later ones.
    room.until(lambda: progress(room)[1] > 0.1 and room.ask("answer = len(pauses)") > 200, "there is no progress")
    pauses = room.ask("answer = [pause for _, pause, _ in pauses]")
    assert slowest(pauses) < MOST_PAUSE, sorted(pauses)[-10:]
    time.sleep(0.5)  # the bar is drawn four times a second
    keep(room, "progress", tmp_path)


def test_other_work_goes_on_meanwhile(room):
    """A selects everything and undo takes that back: both keys reach the 3D View."""
    count = "answer = len(bpy.context.view_layer.objects.selected)"
    room.point(*VIEW)
    room.key("a")
    room.until(lambda: room.ask(count) == 17, "the key A does not reach the 3D View")
    room.key("ctrl+z")
    room.until(lambda: room.ask(count) == 0, "undo does not reach the 3D View")
    assert progress(room) is not None


def test_escape_cancels_within_a_second(room):
    def cancel() -> float:
        if progress(room) is None:
            start(room)
            room.point(*VIEW)
        room.key("Escape")
        return room.until(lambda: progress(room) is None, "Esc does not cancel")

    took = soonest(cancel, 1.0)
    print(f"CANCELLED by Esc in {took:.2f} s")
    assert took < 1.0
    assert baked(room) == 0


def test_cancel_button_cancels_within_a_second(room, tmp_path):
    def cancel() -> float:
        start(room)
        room.click(*CANCEL)
        return room.until(lambda: progress(room) is None, "the button does not cancel")

    took = soonest(cancel, 1.0)
    print(f"CANCELLED by the button in {took:.2f} s")
    assert took < 1.0
    assert baked(room) == 0
    keep(room, "canceled", tmp_path)


def test_bake_by_a_click(room, tmp_path):
    room.ask(IMPORTS + "session.forget()\nbpy.context.scene.radiosity.quality = 'DRAFT'")
    room.click(*BAKE)
    room.until(lambda: baked(room) == 17, "the bake does not end", patience=240)
    room.until(lambda: progress(room) is None, "the bake does not end")
    assert room.ask("answer = bool(bpy.context.scene.radiosity.report)")
    time.sleep(1)
    keep(room, "baked", tmp_path)


def test_one_undo_takes_the_whole_bake_back_and_redo_brings_it(room):
    room.point(*VIEW)
    room.key("ctrl+z")
    room.until(lambda: baked(room) == 0, "undo does not take the bake back")
    assert room.ask("answer = len(bpy.data.objects)") == 17
    assert not room.ask("answer = bpy.context.scene.radiosity.report")
    room.key("ctrl+shift+z")
    room.until(lambda: baked(room) == 17, "redo does not bring the bake")


COLORS = """
import hashlib, numpy
digest = hashlib.sha256()
meshes = [item for item in objects if item.type == "MESH"]
assert len(meshes) == 17
for item in sorted(meshes, key=lambda item: item.name):
    layer = item.data.color_attributes["Radiosity"].data
    values = numpy.empty(4 * len(layer), numpy.float32)
    layer.foreach_get("color", values)
    digest.update(values.tobytes())
answer = digest.hexdigest()
"""


def test_script_and_command_line_give_the_colors_of_the_button(room, profile, tmp_path):
    """What the click has baked is baked again, from scratch: by bpy.ops, and by ``--command`` in
    another Blender, from a copy of the file. What that saved is read here."""
    colors = "objects = bpy.data.objects" + COLORS
    button = room.ask(colors)
    path, baked_path = tmp_path / "scene.blend", tmp_path / "baked.blend"
    room.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(path)!r}, copy=True)")
    room.ask(IMPORTS + "session.forget()")
    assert room.ask(press("bpy.ops.radiosity.bake()")) == "{'FINISHED'}"
    assert room.ask(colors) == button
    words = ["--background", path, "--command", "radiosity", "--quality", "draft"]
    run_blender(profile, *words, "--output", baked_path)
    saved = room.ask(f"""
with bpy.data.libraries.load({str(baked_path)!r}, link=True) as (found, linked):
    linked.objects = list(found.objects)
objects = linked.objects
{COLORS}
bpy.data.libraries.remove(objects[0].library)
""")
    assert saved == button


def test_result_on_screen_and_back(room, tmp_path):
    shading = AREA + "answer = [space.shading.type, space.shading.light, space.shading.color_type]"
    before = room.ask(shading)
    room.ask(press("bpy.ops.radiosity.show()"))
    assert room.ask(shading)[0] == "SOLID"
    time.sleep(1)
    keep(room, "shown", tmp_path)
    room.ask(press("bpy.ops.radiosity.show()"))
    assert room.ask(shading) == before


def test_image_on_screen(room, tmp_path):
    """From a script, the bake runs to its end before the next line."""
    room.ask(AREA + """
properties = scene.radiosity
properties.target, properties.resolution, properties.objects_from = "IMAGE", 64, "SELECTED"
for item in bpy.data.objects:
    item.select_set(item.name == "Cornell")
""")
    assert room.ask(press("bpy.ops.radiosity.bake()")) == "{'FINISHED'}"
    assert room.ask("answer = list(bpy.data.images['Radiosity_Cornell'].size)") == [64, 64]
    for _ in range(3):  # shown, not shown, shown again
        room.ask(press("bpy.ops.radiosity.show()"))
    time.sleep(1)
    keep(room, "image", tmp_path)
    room.ask(press("bpy.ops.radiosity.show()"))
    assert "Traceback" not in room.log


def test_undo_of_a_second_bake_brings_the_first_image_back(room):
    mean = """
import numpy
pixels = numpy.array(bpy.data.images["Radiosity_Cornell"].pixels[:]).reshape(-1, 4)
answer = float(pixels[:, :3].mean())
"""
    room.ask("bpy.ops.ed.undo_push(message='Before')")
    first = room.ask(mean)
    room.ask("""
shader = next(n for n in bpy.data.materials["Lamp"].node_tree.nodes if n.type == "EMISSION")
shader.inputs["Strength"].default_value /= 10
bpy.ops.ed.undo_push(message="Dim")
""")
    room.click(*BAKE)
    room.until(lambda: (progress(room) is None) and room.ask(mean) < 0.5 * first, "no bake")
    room.point(*VIEW)
    room.key("ctrl+z")
    time.sleep(1)
    assert room.ask(mean) == pytest.approx(first, rel=1e-3)


def test_disabling_during_a_bake_ends_it(room):
    room.ask("bpy.context.scene.radiosity.quality = 'HIGH'")
    start(room)
    room.ask(
        "import addon_utils\nname = next(a.module for a in bpy.context.preferences.addons if "
        "a.module.endswith('.radiosity'))\naddon_utils.disable(name)\n"
        "answer = hasattr(bpy.types.Scene, 'radiosity')"
    )
    assert "Traceback" not in room.log, room.log[-3000:]
    assert not room.ask("answer = hasattr(bpy.types.Scene, 'radiosity')")
