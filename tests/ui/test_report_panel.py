"""The lists before and after a bake: what is said, and in which words."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from tests.export.scene_building import add_object

REPORT = {
    "version": "0.1.0", "triangles": 10, "elements": 20, "receivers": 1000, "rays": 40,
    "iterations": 5, "residual": 1e-5, "target_error": 0.03, "estimated_error": 0.02,
    "error_95": 0.041,
    "energy": {"emitted": 1.0, "absorbed": 0.9, "escaped": 0.1},
    "seconds": {"export": 0.1, "elements": 0.1, "transport": 0.1, "solve": 0.1, "gather": 0.5,
                "write": 0.1, "total": 1.0},
    "peak_memory": 100, "objects": [], "warnings": ["a warning"],
}  # fmt: skip


@pytest.fixture
def file(file):
    file.context.scene.radiosity.quality = "MEDIUM"
    return file


def plan(bpy):
    from radiosity_addon.ui.preflight import preflight

    return preflight(bpy.context)


def add(bpy, name: str, data):
    item = add_object(bpy, name, data)
    bpy.context.view_layer.update()
    return item


def test_preflight_lists_what_is_baked_and_why_the_rest_is_not(file):
    add(file, "Hidden", file.data.objects["Box"].data).hide_render = True
    add(file, "Empty mesh", file.data.meshes.new("Nothing"))
    found = plan(file)
    assert found.baked == ("Box",)
    reasons = dict(found.left_out)
    assert "renders" in reasons["Hidden"] and "no faces" in reasons["Empty mesh"]


def linked(bpy, tmp_path):
    """An object whose mesh lives in another file."""
    path = str(tmp_path / "library.blend")
    mesh = bpy.data.objects["Box"].data.copy()
    mesh.name = "Far"
    bpy.data.libraries.write(path, {mesh}, fake_user=True)
    bpy.data.meshes.remove(mesh)
    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.meshes = ["Far"]
    return add(bpy, "Linked", wanted.meshes[0])


def varied(bpy, tmp_path) -> None:
    """One object of each kind there is."""
    mesh = bpy.data.objects["Box"].data
    add(bpy, "Copy", mesh)  # comes before its twin, whose mesh it shares
    add(bpy, "Twin", mesh)
    add(bpy, "Hidden", mesh.copy()).hide_viewport = True  # renders all the same
    for name, change in (("Shut", "hide_render"), ("Out", "exclude")):
        collection = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(bpy.data.objects.new(f"In {name}", mesh.copy()))
        owner = bpy.context.view_layer.layer_collection.children[name]
        setattr(collection if change == "hide_render" else owner, change, True)
    linked(bpy, tmp_path)
    carrier = add(bpy, "Carrier", mesh.copy())
    carrier.instance_type, carrier.show_instancer_for_render = "VERTS", False
    add(bpy, "Passenger", mesh.copy()).parent = carrier
    bpy.context.view_layer.update()


@pytest.mark.parametrize("target", ["VERTEX", "IMAGE"])
def test_preflight_agrees_with_the_export(file, tmp_path, target):
    """What it lists as baked is what the export takes, and the rest is what that leaves out."""
    from radiosity_addon.stages.prepare import discard, prepare
    from radiosity_addon.ui.properties import settings_of

    varied(file, tmp_path)
    properties = file.context.scene.radiosity
    properties.target, properties.resolution = target, 16
    job = prepare(file.context, settings_of(properties))
    found = plan(file)
    assert set(found.baked) == {each.name for each in job.targets}
    reasons = dict(found.left_out)
    assert "renders" in reasons["In Shut"] and "In Out" not in reasons
    assert "Make Local" in reasons["Linked"] and "instances" in reasons["Carrier"]
    assert ("shares its mesh with Box" in reasons.get("Twin", "")) == (target == "VERTEX")
    discard(file.context, job)


def test_missing_uv_map_is_named_by_the_button(file):
    from radiosity_addon.ui.choice import why_not

    properties = file.context.scene.radiosity
    properties.target, properties.uv_map = "IMAGE", "Atlas"
    assert "Box has no UV map Atlas" in why_not(file.context)


@pytest.mark.parametrize("target", ["VERTEX", "IMAGE"])
def test_the_button_says_why_the_one_selected_object_cannot_be_baked(file, tmp_path, target):
    from radiosity_addon.ui.choice import why_not

    file.ops.object.select_all(action="DESELECT")
    linked(file, tmp_path).select_set(True)
    properties = file.context.scene.radiosity
    properties.objects_from, properties.target = "SELECTED", target
    assert why_not(file.context).startswith("Linked cannot be baked: its mesh is linked")
    assert "Make Local" in why_not(file.context)


def test_the_button_asks_about_objects_that_lack_the_uv_map_alone(file, monkeypatch):
    """Of 20 that have it none is asked whether it can be baked, but the first one found for a bake;
    of two that lack it the one that is not rendered is asked and passed over."""
    from radiosity_addon.ui import choice

    mesh, asked = file.data.objects["Box"].data, []
    mesh.uv_layers.new(name="Atlas")
    for index in range(20):
        add(file, f"Fine {index}", mesh.copy())
    original = choice._left_out
    monkeypatch.setattr(
        choice, "_left_out", lambda item, *rest: (asked.append(item.name), original(item, *rest))[1]
    )
    properties = file.context.scene.radiosity
    properties.target, properties.uv_map = "IMAGE", "Atlas"
    assert choice.why_not(file.context) == "" and len(asked) == 1
    bare = mesh.copy()
    bare.uv_layers.remove(bare.uv_layers["Atlas"])
    add(file, "Not rendered", bare).hide_render = True
    assert choice.why_not(file.context) == "" and asked[1:-1] == ["Not rendered"]
    add(file, "Bare", bare.copy())
    assert "Bare has no UV map Atlas" in choice.why_not(file.context)


def test_preflight_of_the_selection_names_what_is_no_mesh(file):
    file.context.scene.radiosity.objects_from = "SELECTED"
    for item in file.data.objects:
        item.select_set(True)
    found = plan(file)
    assert found.baked == ("Box",) and "no mesh" in dict(found.left_out)["Bulb"]


def test_estimate_scales_the_last_bake(file):
    """1000 receivers took 1 s at an error of 0.03; the box's 20 corners count as a tenth of
    that at least, and 0.01 instead of 0.03 takes 3^1.2 times as long."""
    from radiosity_addon.ui.preflight import FIRST_SECONDS, POWER
    from radiosity_addon.ui.report_store import store_report

    properties = file.context.scene.radiosity
    store_report(file.context.scene.name, {**REPORT, "seconds": {**REPORT["seconds"], "total": 50}})
    properties.quality = "MEDIUM"
    assert plan(file).seconds == pytest.approx(5.0)
    properties.quality = "HIGH"
    assert plan(file).seconds == pytest.approx(5.0 * 3**POWER)
    properties.use_time_limit, properties.time_limit = True, 2.0
    assert plan(file).seconds == pytest.approx(2.0 + FIRST_SECONDS)


def test_estimate_of_an_image_grows_with_its_area(file):
    """Time does; memory up to that of the texels that are baked in one piece."""
    from radiosity_addon.memory import PER_RECEIVER, UNDIVIDED

    properties = file.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 1024
    small = plan(file)
    properties.resolution = 2048
    large = plan(file)
    assert large.bytes - small.bytes == pytest.approx((UNDIVIDED - 1024**2) * PER_RECEIVER)
    assert large.seconds > 3 * small.seconds


def test_report_is_kept_with_the_scene(file, tmp_path):
    from radiosity_addon.ui.report_store import load_report, store_report

    store_report(file.context.scene.name, REPORT)
    path = str(tmp_path / "kept.blend")
    file.ops.wm.save_as_mainfile(filepath=path)
    file.ops.wm.open_mainfile(filepath=path)
    assert load_report(file.context.scene) == REPORT


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", '{"version": "9"}'])
def test_report_that_cannot_be_read_is_none(file, text):
    from radiosity_addon.ui.report_store import load_report

    file.context.scene.radiosity.report = text
    assert load_report(file.context.scene) is None


def test_report_of_a_deleted_scene_goes_nowhere(file):
    from radiosity_addon.ui.report_store import store_report

    store_report("No such scene", REPORT)
    assert not file.context.scene.radiosity.report


class Drawn:
    """Takes the place of a layout and keeps the texts of its labels."""

    def __init__(self):
        self.texts = []

    def column(self, **_):
        return self

    row = split = column

    def label(self, text="", **_):
        self.texts.append(text)


def test_a_gray_button_says_why_below_it(file):
    from radiosity_addon.ui.panels import draw_button

    class Button(Drawn):
        def operator(self, *_, text, **__):
            self.texts.append(text)

    ready, editing = Button(), Button()
    draw_button(ready, file.context)
    assert ready.texts == ["Bake"]
    file.context.view_layer.objects.active = file.data.objects["Box"]
    file.ops.object.mode_set(mode="EDIT")
    draw_button(editing, file.context)
    file.ops.object.mode_set(mode="OBJECT")
    assert " ".join(editing.texts) == "Bake Leave the current mode for Object Mode first"


def test_the_error_of_most_of_the_surface_is_shown(blender):
    """Where it is known: a report that an earlier version left in the file has none."""
    from radiosity_addon.ui.report_panel import draw_error

    new, old = Drawn(), Drawn()
    draw_error(new, REPORT)
    draw_error(old, {key: value for key, value in REPORT.items() if key != "error_95"})
    place = new.texts.index("95 % of the Surface")
    assert new.texts[place - 2 : place + 2] == [
        "Estimated Error", "2 %", "95 % of the Surface", "within 4.1 %",
    ]  # fmt: skip
    assert old.texts == new.texts[:place] + new.texts[place + 2 :]


@pytest.mark.parametrize(
    ("left_out", "warnings", "told"),
    [(0, 0, []), (0, 1, ["1 warning"]), (2, 3, ["2 left out, 3 warnings"])],
)
def test_the_closed_report_says_that_there_are_warnings(file, left_out, warnings, told):
    from radiosity_addon.ui.report_panel import RADIOSITY_PT_report

    objects = [{"name": str(n), "baked": n >= left_out, "reason": "why"} for n in range(4)]
    report = {**REPORT, "objects": objects, "warnings": ["a warning"] * warnings}
    file.context.scene.radiosity.report = json.dumps(report)
    panel = SimpleNamespace(layout=Drawn())
    RADIOSITY_PT_report.draw_header_preset(panel, file.context)
    assert panel.layout.texts == told
    file.context.scene.radiosity.report = ""
    RADIOSITY_PT_report.draw_header_preset(panel, file.context)
    assert panel.layout.texts == told


def test_copied_text_is_the_whole_report():
    from radiosity_addon.ui.report_store import report_text

    assert json.loads(report_text(REPORT)) == REPORT


def test_copy_needs_a_report(file):
    assert not file.ops.radiosity.copy_report.poll()
    file.context.scene.radiosity.report = "{"
    with pytest.raises(RuntimeError, match="bake again"):
        file.ops.radiosity.copy_report()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.25, "0.25 s"), (42, "42 s"), (125, "2 min 5 s"), (4800, "1 h 20 min")],
)
def test_durations(blender, seconds, text):
    from radiosity_addon.ui.words import duration

    assert duration(seconds) == text


def test_other_words(blender):
    from radiosity_addon.ui import words

    assert words.size(350e6) == "350 MB" and words.size(1.24e9) == "1.2 GB"
    assert words.count(1234567) == "1,234,567"
