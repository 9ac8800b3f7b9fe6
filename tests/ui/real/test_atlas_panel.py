"""A real Blender with a window: several objects are baked into one image by clicks."""

from __future__ import annotations

import sys
import time

import numpy as np

box = sys.modules["box"]  # by conftest.py
AREA, BAKE = box.AREA, box.BAKE
ATLAS = (793, 469)  # the triangle before the part of the panel that asks for an atlas
OWNER = "radiosity_object"  # custom property of an image: whom it was baked for, one a line

OPENED = """
panel = bpy.types.RADIOSITY_PT_atlas
original, opened = panel.draw, []
def draw(self, context):
    opened.append(1)
    original(self, context)
panel.draw = draw
bpy.app.driver_namespace["opened"] = opened
"""


def middle(window) -> np.ndarray:
    """Codes of the part of the screen that shows the box."""
    return window.pixels()[300:560, 310:590].astype(int)


def test_three_objects_share_an_image(room, tmp_path):
    """The part of the panel is opened, the button pressed, and what came of it shown."""
    room.ask(AREA + OPENED + """
properties = scene.radiosity
properties.quality, properties.target, properties.resolution = "DRAFT", "IMAGE", 256
properties.use_atlas, properties.atlas, properties.objects_from = True, "Room", "SELECTED"
for item in bpy.data.objects:
    item.select_set(item.name in ("Cornell", "Sphere", "Sphere.005"))
bpy.context.view_layer.objects.active = bpy.data.objects["Sphere"]
region.tag_redraw()
""")
    time.sleep(1)
    room.click(*ATLAS)
    room.until(lambda: room.ask("answer = len(bpy.app.driver_namespace['opened'])"), "no atlas panel")
    room.click(*BAKE)
    made = "answer = bool(bpy.context.scene.radiosity.report)"
    room.until(lambda: room.ask(made) and box.progress(room) is None, "the bake does not end")
    images = room.ask("answer = [i.name for i in bpy.data.images if 'Room' in i.name]")
    assert images == ["Radiosity_Room"]
    owners = room.ask(f"answer = bpy.data.images['Radiosity_Room'][{OWNER!r}]").splitlines()
    assert sorted(owners) == ["Cornell", "Sphere", "Sphere.005"]
    before = middle(room)
    room.ask(box.press("bpy.ops.radiosity.show()"))
    room.until(lambda: np.abs(middle(room) - before).mean() > 5, "the result is not shown")
    time.sleep(1)
    box.keep(room, "atlas", tmp_path)
