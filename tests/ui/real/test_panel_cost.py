"""What the panel costs at each redraw with a thousand baked objects, in a real Blender."""

from __future__ import annotations

import re
import statistics
import sys
import time

import pytest

box = sys.modules["box"]  # loaded by conftest.py
AREA, keep = box.AREA, box.keep
pytestmark = pytest.mark.timed
MOST = 0.002  # seconds of Blender's thread a redraw: what else the machine does is not in it
REDRAWS = 10
# A thousand squares, with a color attribute and an image each.
OBJECTS = """
for item in list(bpy.data.objects):
    bpy.data.objects.remove(item)
bpy.ops.mesh.primitive_plane_add(size=1)
first = bpy.context.object
for index in range(1000):
    item = bpy.data.objects.new(f"Square {index}", first.data.copy())
    bpy.context.scene.collection.objects.link(item)
    item.data.color_attributes.new("Radiosity", "FLOAT_COLOR", "CORNER")
    item.data.uv_layers[0].name = "Radiosity"
    image = bpy.data.images.new(f"Radiosity_{item.name}", 1, 1, float_buffer=True)
    image["radiosity_bake"] = image.name
bpy.data.objects.remove(first)
"""
# From now on the time is noted of every function of ours that Blender calls to draw.
WATCH = """
import sys, time
name = next(name for name in sys.modules if name.endswith(".ui.panels"))
package, spent = sys.modules[name.rpartition(".")[0]], []
def timed(function, name):
    def call(self, context):
        start = time.thread_time()
        try:
            return function(self, context)
        finally:
            spent.append((name, time.thread_time() - start))
    return call
classes = package._classes()
for cls in reversed(classes):
    bpy.utils.unregister_class(cls) if cls.__name__.startswith("RADIOSITY_") else None
for cls in classes:
    for name in ("draw", "draw_header", "draw_header_preset"):
        if name in vars(cls):
            setattr(cls, name, timed(vars(cls)[name], f'{cls.__name__}.{name}'))
    if hasattr(cls, "poll") and cls.__name__.startswith("RADIOSITY_"):
        cls.poll = classmethod(timed(cls.poll.__func__, f'{cls.__name__}.poll'))
    bpy.utils.register_class(cls) if cls.__name__.startswith("RADIOSITY_") else None
bpy.app.driver_namespace["spent"] = spent
"""
REDRAW = AREA + "region.tag_redraw()"


@pytest.fixture(scope="module")
def many(blender_window):
    blender_window.ask(OBJECTS + WATCH + AREA + "space.show_region_ui = True")
    time.sleep(1)
    blender_window.ask(AREA + "region.active_panel_category = 'Radiosity'")
    time.sleep(3)
    return blender_window


@pytest.mark.parametrize(
    ("target", "uv_map", "name"), [("VERTEX", "", "Radiosity"), ("IMAGE", "", "Radiosity"),
                                   ("IMAGE", "Radiosity", "Radiosity"), ("VERTEX", "", "Other")],
)  # fmt: skip
def test_a_redraw_with_a_thousand_baked_objects(many, target, uv_map, name, tmp_path):
    many.ask(f"""
properties = bpy.context.scene.radiosity
properties.target, properties.uv_map, properties.bake_name = {target!r}, {uv_map!r}, {name!r}
""")
    time.sleep(3)  # the list before the bake is made anew once, by a timer
    many.ask("bpy.app.driver_namespace['spent'].clear()")
    for _ in range(REDRAWS):
        many.ask(AREA + "region.tag_redraw()")
        time.sleep(0.3)
    spent = many.ask("answer = bpy.app.driver_namespace['spent']")
    *costs, most = sorted(by_redraw(spent))  # one may be slow from what the machine does beside
    cost = statistics.mean(costs)
    print(f"PANEL {target} {uv_map} {name}: {1000 * cost:.2f} ms, the mean of {len(costs)} redraws "
          f"without the slowest, of {1000 * most:.2f} ms")  # fmt: skip
    keep(many, f"thousand_{target}", tmp_path)
    assert len(costs) > REDRAWS / 2 and cost < MOST, spent
    assert "Traceback" not in many.log, many.log[-3000:]


def by_redraw(spent: list) -> list[float]:
    """Seconds of each redraw: what Blender calls from one drawing of the panel to the next."""
    costs: list[float] = []
    for name, seconds in spent:
        if name == "RADIOSITY_PT_bake.draw":
            costs.append(0.0)
        if costs:
            costs[-1] += seconds
    return costs


def test_what_will_not_fit_is_open_and_red(many, tmp_path):
    """16,384² texels of a thousand objects: the list below the button opens by itself."""
    drawn = """
import sys
panel = sys.modules[next(n for n in sys.modules if n.endswith(".ui.preflight_panel"))]
original, told = panel._draw_list, []
panel._draw_list = lambda column, plan: (told.append(plan.problems), original(column, plan))
bpy.app.driver_namespace["told"] = told
"""
    many.ask(drawn + """
properties = bpy.context.scene.radiosity
properties.target, properties.uv_map, properties.resolution = "IMAGE", "", 1024
""")
    many.ask("properties = bpy.context.scene.radiosity\nproperties.resolution = 16384")
    told = "answer = [list(each) for each in bpy.app.driver_namespace['told']]"
    many.ask(REDRAW)
    many.until(lambda: any(many.ask(told)), "the list does not open")
    edge = re.fullmatch(r"Needs about .* of memory, .* are free: (\d+) texels would fit, or fewer "
                        "objects", many.ask(told)[-1][0])  # fmt: skip
    assert 0 < int(edge[1]) < 16384
    time.sleep(1)
    keep(many, "fits_not", tmp_path)
