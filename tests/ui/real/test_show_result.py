"""*Show Result* on a real screen: as the display shows light, with smooth edges, and live.

A square of one color over black lies under the middle of the 3D View, seen from above and turned
by 10 degrees. What the screen must show there is asked of Blender: an image of that color, saved as a render.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import pytest

box = sys.modules["box"]  # loaded by conftest.py
AREA, keep, press = box.AREA, box.keep, box.press
PATIENCE = 60  # seconds until the screen shows what it should
NEAR = 2.5 / 255  # the grid of the table, and two roundings to 8 bits
LIGHT = (0.5, 0.18, 0.04)

SCENE = AREA + """
import math
for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)
bpy.ops.mesh.primitive_plane_add(size=2, rotation=(0, 0, math.radians(10)))
item = bpy.context.object
item.name = "Square"
view = space.region_3d
view.view_perspective, view.view_distance = "ORTHO", 10
view.view_rotation, view.view_location = (1, 0, 0, 0), (0, 0, 0)
space.show_region_ui = False
space.overlay.show_overlays = space.show_gizmo = False
"""
WRITE = """
def write(name, color, domain="CORNER", kind="FLOAT_COLOR"):
    mesh = bpy.data.objects["Square"].data
    layer = mesh.color_attributes.get(name) or mesh.color_attributes.new(name, kind, domain)
    layer.data.foreach_set("color", [*color, 1.0] * len(layer.data))
    mesh.update()
def paint(name, color):
    image = bpy.data.images.get(name) or bpy.data.images.new(name, 4, 4, float_buffer=True)
    image["radiosity_bake"], image.use_fake_user = name, True
    image.pixels.foreach_set([*color, 1.0] * 16)
    image.update()
"""
PLACE = AREA + """
from bpy_extras.view3d_utils import location_3d_to_region_2d as flat
main = next(r for r in area.regions if r.type == "WINDOW")
x, y = flat(main, space.region_3d, ({x}, {y}, 0))
answer = [int(main.x + x), int(main.y + y)]
"""
DISPLAYED = """
image = bpy.data.images.new("one", 2, 2, float_buffer=True)
image.pixels.foreach_set([*{light}, 1.0] * 4)
scene = bpy.context.scene
settings = scene.render.image_settings
settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
image.save_render({path!r}, scene=scene)
bpy.data.images.remove(image)
saved = bpy.data.images.load({path!r})
saved.colorspace_settings.name = "Non-Color"
answer = list(saved.pixels[:3])
bpy.data.images.remove(saved)
"""


@pytest.fixture(scope="module")
def square(blender_window):
    blender_window.ask(SCENE + WRITE + f"write('Radiosity', {LIGHT})")
    time.sleep(1)
    blender_window.ask(press("bpy.ops.radiosity.show()"))
    time.sleep(1)
    return blender_window


def screen(window) -> np.ndarray:
    """(height, width, 3) of the screen, 0 to 1, the lowest row first."""
    return window.pixels().astype(np.float32) / 255


def seen(window, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    """The color of the screen at a place of the scene, once it has settled."""
    column, row = window.ask(PLACE.format(x=x, y=y))
    before = None
    for _ in range(20):
        time.sleep(0.5)
        now = screen(window)[row, column]
        if before is not None and np.array_equal(now, before):
            break
        before = now
    return now


def displayed(window, tmp_path, light) -> np.ndarray:
    """What Blender's own color management makes of ``light``."""
    return np.array(window.ask(DISPLAYED.format(light=tuple(light), path=str(tmp_path / "d.png"))))


def settled(look, good):
    """What ``look()`` finds once that is ``good``, or in the end: a slow machine draws late."""
    end = time.monotonic() + PATIENCE
    found = look()
    while not good(found) and time.monotonic() < end:
        time.sleep(0.5)
        found = look()
    return found


def check(window, tmp_path, light=LIGHT, place=(0.0, 0.0)) -> None:
    wanted = pytest.approx(displayed(window, tmp_path, light), abs=NEAR)
    found = settled(lambda: seen(window, *place), lambda color: color == wanted)
    assert found == wanted


def differs(window, tmp_path, light) -> bool:
    """Whether the screen shows something else than ``light`` there."""
    other = displayed(window, tmp_path, light)

    def far(color) -> bool:
        return np.abs(color - other).max() > 0.1

    return far(settled(lambda: seen(window), far))


@pytest.mark.parametrize(
    "view", ["transform='AgX', e=0", "transform='Standard', e=0", "transform='Filmic', e=2",
             "transform='AgX', look='AgX - High Contrast', e=-1.5, g=1.2"],
)  # fmt: skip
def test_view_transform_and_exposure_are_the_scenes(square, tmp_path, view):
    square.ask(f"""
def change(transform, e, look="None", g=1.0):
    view = bpy.context.scene.view_settings
    view.view_transform, view.look, view.exposure, view.gamma = transform, look, e, g
change({view})
""")
    check(square, tmp_path)


def test_it_follows_a_bake_edits_name_and_target(square, tmp_path):
    square.ask("view = bpy.context.scene.view_settings\nview.view_transform = 'AgX'")
    square.ask(WRITE + "write('Radiosity', (0.02, 0.4, 0.1))")
    check(square, tmp_path, (0.02, 0.4, 0.1))
    square.ask(WRITE + "write('Other', (0.9, 0.1, 0.4), 'POINT')\n"
               "bpy.context.scene.radiosity.bake_name = 'Other'")  # fmt: skip
    check(square, tmp_path, (0.9, 0.1, 0.4))
    outside = seen(square, 1.6, 0)
    square.ask("""
mesh = bpy.data.objects["Square"].data
mesh.transform(__import__("mathutils").Matrix.Scale(2, 4))
mesh.update()
""")
    check(square, tmp_path, (0.9, 0.1, 0.4), (1.6, 0))
    assert np.abs(seen(square, 1.6, 0) - outside).max() > 0.1
    square.ask("bpy.data.objects['Square'].location.x = 30")
    beside = pytest.approx(outside, abs=NEAR)
    assert settled(lambda: seen(square), lambda color: color == beside) == beside
    square.ask("bpy.data.objects['Square'].location.x = 0")
    square.ask(WRITE + """
paint("Other_Square", (0.1, 0.2, 0.7))
bpy.context.scene.radiosity.uv_map = bpy.data.objects["Square"].data.uv_layers[0].name
bpy.context.scene.radiosity.target = "IMAGE"
""")
    check(square, tmp_path, (0.1, 0.2, 0.7))
    square.ask(WRITE + "paint('Other_Square', (3.0, 0.2, 0.0))")
    check(square, tmp_path, (3.0, 0.2, 0.0))
    keep(square, "shown_image", tmp_path)


def test_it_follows_undo_and_a_renamed_object(square, tmp_path):
    square.ask(WRITE + """
bpy.context.scene.radiosity.target = "VERTEX"
write("Other", (0.3, 0.3, 0.1), "POINT")
bpy.ops.ed.undo_push(message="one")
write("Other", (0.1, 0.6, 0.6), "POINT")
bpy.ops.ed.undo_push(message="two")
""")
    check(square, tmp_path, (0.1, 0.6, 0.6))
    square.point(*box.VIEW)
    square.key("ctrl+z")
    check(square, tmp_path, (0.3, 0.3, 0.1))
    square.ask(AREA + "bpy.data.objects['Square'].name = 'Tile'\narea.tag_redraw()")
    check(square, tmp_path, (0.3, 0.3, 0.1))
    square.ask(AREA + "bpy.data.objects['Tile'].name = 'Square'\narea.tag_redraw()")


BRIGHT = (0.8, 0.7, 0.6)
# Brighter than the background by more than half of the scale, whatever the tests before have set.
EDGE = WRITE + f"""
scene = bpy.context.scene
view = scene.view_settings
view.view_transform, view.look, view.exposure, view.gamma = "Standard", "None", 0, 1
scene.radiosity.target, scene.radiosity.bake_name = "VERTEX", "Edge"
write("Edge", {BRIGHT})
"""
SMOOTH = AREA + """
bpy.data.objects["Square"].scale = (0.5, 0.5, 1)
bpy.context.preferences.system.viewport_aa = {!r}
area.tag_redraw()
"""


def steps(window) -> int:
    """Pixels of the 3D View whose brightness lies between the square's and the background's."""
    column, row = window.ask(PLACE.format(x=0, y=0))
    part = screen(window)[row - 150 : row + 150, column - 250 : column + 250]
    light = part.mean(-1)
    low, high = np.sort([light[150, 250], light[2, 2]])
    assert high - low > 0.2
    margin = 0.1 * (high - low)
    return int(((light > low + margin) & (light < high - margin)).sum())


def test_edges_are_smooth_where_the_viewports_are(square, tmp_path):
    """The square's edges cross some hundred rows: a pixel of each lies half on it. Without
    anti-aliasing there is none between the two colors."""
    square.ask(EDGE)
    square.ask(SMOOTH.format("OFF"))
    check(square, tmp_path, BRIGHT)
    assert settled(lambda: steps(square), lambda number: number == 0) == 0
    square.ask(SMOOTH.format("8"))
    assert settled(lambda: steps(square), lambda number: number > 100) > 100
    keep(square, "shown_smooth", tmp_path)


def test_an_object_in_edit_mode_is_shown_as_blender_draws_it(square, tmp_path):
    square.ask(EDGE)
    check(square, tmp_path, BRIGHT)
    square.ask(AREA + """
with bpy.context.temp_override(window=window, area=area):
    bpy.context.view_layer.objects.active = bpy.data.objects["Square"]
    bpy.ops.object.mode_set(mode="EDIT")
""")
    assert differs(square, tmp_path, BRIGHT)
    square.ask(AREA + """
with bpy.context.temp_override(window=window, area=area):
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.transform.resize(value=(3, 3, 1))
    bpy.ops.object.mode_set(mode="OBJECT")
""")
    check(square, tmp_path, BRIGHT)
    square.ask(press("bpy.ops.radiosity.show()"))
    assert differs(square, tmp_path, BRIGHT)
    assert "Traceback" not in square.log, square.log[-3000:]
