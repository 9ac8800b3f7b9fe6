"""The scene in which a user's clicks are tried, and what the tests ask of the window.

Every function takes a ``window.Window``.
"""

from __future__ import annotations

import os
from pathlib import Path

BAKE, CANCEL = (900, 133), (1007, 133)  # the buttons in a sidebar at the right of the 3D View
VIEW = (400, 500)  # somewhere over the scene
IMPORTS = "import sys\nsession = next(m for n, m in sys.modules.items() if n.endswith('.ui.session'))\n"
AREA = """
window = bpy.context.window_manager.windows[0]
area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
region = next(region for region in area.regions if region.type == "UI")
scene, space = bpy.context.scene, area.spaces.active
"""
# The Cornell box with sixteen spheres of 512 faces in it: a draft takes a second or two, 0.1 % minutes.
ROOM = """
import importlib
for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)
name = next(name for name in sys.modules if name.endswith(".ui.session"))
importlib.import_module(name.replace(".ui.session", ".export.demo")).build_demo("cornell")
for index in range(16):
    x, y = index % 4 - 1.5, index // 4 - 1.5
    bpy.ops.mesh.primitive_uv_sphere_add(
        segments=32, ring_count=16, radius=0.1, location=(0.4 * x, 0.4 * y - 0.2, 1.5 + 0.08 * x))
    bpy.ops.object.shade_smooth()
bpy.data.objects.remove(bpy.data.objects["Camera"])
view = space.region_3d
view.view_perspective, view.view_distance = "PERSP", 5.6
view.view_rotation, view.view_location = (0.7071, 0.7071, 0, 0), (0.5, 0, 1)
space.shading.show_backface_culling = True
space.show_region_ui = True
scene.radiosity.quality, scene.radiosity.error = "CUSTOM", 0.001
bpy.ops.object.select_all(action="DESELECT")
bpy.ops.ed.undo_push(message="Box")
"""


def keep(window, name: str, tmp_path: Path) -> None:
    """A screenshot, also in the folder that keeps them, as large as the user guide shows them."""
    picture = window.picture(tmp_path / f"{name}.png")
    assert picture.stat().st_size > 20_000  # an empty screen takes less
    if "RADIOSITY_PICTURES" in os.environ:
        window.shrink(picture, Path(os.environ["RADIOSITY_PICTURES"]) / picture.name)


def progress(window):
    """(state, fraction) of the bake under way, or None."""
    return window.ask(
        IMPORTS + "bake = session.current()\nanswer = bake and (bake.state.name, bake.fraction)"
    )


def baked(window) -> int:
    """How many meshes carry the color attribute."""
    return window.ask(
        "answer = sum('Radiosity' in i.data.color_attributes for i in bpy.data.objects if i.type "
        "== 'MESH')"
    )


def start(window) -> None:
    """Click Bake and wait until the solver works."""
    window.click(*BAKE)
    window.until(lambda: (progress(window) or ("",))[0] == "SOLVE", "the bake does not start")


def slowest(pauses: list[float]) -> float:
    """The pause [s] than which 19 of 20 are shorter, in the best of four parts of the time: what else
    the machine does comes and goes, what we do is in all of them."""
    size = max(len(pauses) // 4, 1)
    parts = [sorted(pauses[first : first + size]) for first in range(0, len(pauses), size)]
    return min(part[int(0.95 * size)] for part in parts if len(part) == size)


def soonest(act, seconds: float, attempts: int = 3) -> float:
    """The least time [s] that ``act()`` tells; the machine's other work may delay one or two."""
    told = []
    while len(told) < attempts and min(told, default=seconds) >= seconds:
        told.append(act())
    return min(told)


def press(operator: str) -> str:
    return AREA + f"""
with bpy.context.temp_override(window=window, area=area):
    answer = str({operator})
"""
