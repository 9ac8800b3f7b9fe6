"""A bake behaves like a job of Blender's own: auto-save, menu search, Repeat Last, redo."""

from __future__ import annotations

import sys
import time

import pytest

box = sys.modules["box"]  # loaded by conftest.py
IMPORTS, AREA, VIEW = box.IMPORTS, box.AREA, box.VIEW
baked, keep, press, progress = box.baked, box.keep, box.press, box.progress
MOST_OWN = 0.5  # seconds of Blender's thread between two answers: an undo step and a redraw
AUTOSAVE = """
paths = bpy.context.preferences.filepaths
paths.use_auto_save_temporary_files, paths.auto_save_time = True, 1
paths.temporary_directory = {folder!r}
"""
# A bake as the button starts it, with keywords; the mouse's window is ours.
INVOKE = AREA + """
with bpy.context.temp_override(window=window, area=area):
    answer = str(bpy.ops.radiosity.bake("INVOKE_DEFAULT", {keywords}))
"""


def end(window) -> None:
    window.until(lambda: progress(window) is None, "the bake does not end", patience=600)


@pytest.fixture(scope="module")
def saves(room, tmp_path_factory):
    """Where Blender saves by itself: a minute from now, with all that the other tests here do in it."""
    folder = tmp_path_factory.mktemp("saves")
    room.ask(AUTOSAVE.format(folder=str(folder)))
    return folder


def test_escape_over_any_editor_cancels(room, saves):
    for place in (VIEW, (1150, 300), (400, 780), (640, 10)):  # view, outliner, timeline, top bar
        if progress(room) is None:
            room.ask(INVOKE.format(keywords="error=1e-4"))
        room.until(lambda: (progress(room) or ("",))[0] == "SOLVE", "the bake does not start")
        room.point(*place)
        room.key("Escape")
        room.until(lambda: progress(room) is None, f"Esc at {place} does not cancel", patience=5)


def test_menu_search_finds_the_bake(room, tmp_path):
    """Its key, F3, is one that a virtual screen may lack."""
    room.point(*VIEW)
    room.ask(press("bpy.ops.wm.search_menu('INVOKE_DEFAULT')"))
    time.sleep(3)  # all menus are looked through
    room.type("bake radio")
    time.sleep(2)
    keep(room, "search", tmp_path)
    room.key("Return")
    room.until(lambda: progress(room) is not None, "menu search does not start the bake")
    room.key("Escape")
    room.until(lambda: progress(room) is None, "Esc does not cancel")


def answers_meanwhile(window, act) -> None:
    """The window answers from ``act`` to the end of the bake that it starts: a call that blocks
    would be one pause as long as all of it."""
    window.ask("pauses.clear()")
    act()
    window.until(lambda: progress(window) is not None, "the bake does not start")
    end(window)
    walls, owns = window.ask("answer = [p[1] for p in pauses], [p[2] for p in pauses]")
    print(f"ANSWERED {len(walls)} times in {sum(walls):.1f} s, after {max(walls):.2f} s at most; "
          f"of Blender's thread {max(owns):.2f} s")  # fmt: skip
    assert max(walls) < sum(walls) / 3
    assert max(owns) < MOST_OWN


COUNT = "answer = sum('Lit' in i.data.color_attributes for i in bpy.data.objects if i.type == 'MESH')"
# Of the lamp's own light alone, so that next to nothing is to be solved.
WORDS = "bake_name='Lit', quality='DRAFT', passes={'EMIT'}"
CLEAN = """
for item in bpy.data.objects:
    if item.type == "MESH" and "Lit" in item.data.color_attributes:
        item.data.color_attributes.remove(item.data.color_attributes["Lit"])
with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
    bpy.ops.ed.undo_push(message="Clean")
"""


def test_repeat_last_does_not_freeze_the_window(room):
    """It repeats the bake with the keywords of the first call."""
    answers_meanwhile(room, lambda: room.ask(INVOKE.format(keywords=WORDS)))
    assert room.ask(COUNT) == 17
    room.ask(CLEAN)
    room.point(*VIEW)
    answers_meanwhile(room, lambda: room.key("shift+r"))
    assert room.ask(COUNT) == 17
    assert room.ask("answer = bpy.context.scene.radiosity.bake_name") == "Radiosity"
    assert "Traceback" not in room.log


def test_undo_takes_a_bake_back_and_redo_brings_it(room):
    """Blender forgets what Repeat Last would repeat with an undo, whatever operator it was."""
    assert room.ask(COUNT) == 17  # of the repeated bake
    room.point(*VIEW)
    room.key("ctrl+z")
    room.until(lambda: room.ask(COUNT) == 0, "undo does not take the bake back")
    room.key("ctrl+shift+z")
    room.until(lambda: room.ask(COUNT) == 17, "redo does not bring the bake")
    assert "Traceback" not in room.log


def test_blender_saves_by_itself_during_a_bake(room, saves):
    """Every minute, at the shortest; a modal operator would put it off to the end of the bake."""
    began = time.time()
    room.ask(INVOKE.format(keywords="error=1e-4"))
    room.until(
        lambda: [f for f in saves.rglob("*autosave.blend") if f.stat().st_mtime > began],
        "nothing is saved", patience=90,
    )  # fmt: skip
    assert progress(room)[0] == "SOLVE"
    print(f"SAVED after {time.time() - began:.0f} s")
    room.ask("bpy.context.preferences.filepaths.use_auto_save_temporary_files = False")
    room.ask("bpy.ops.radiosity.cancel()")
