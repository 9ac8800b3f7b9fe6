"""A job like Blender's own: keywords, menus, the last message, the list beside the button."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

from radiosity_addon.solver.expected import Refused

pytestmark = pytest.mark.usefixtures("solver_here")


@pytest.fixture
def file(file):
    file.context.scene.radiosity.quality = "HIGH"
    return file


def report_of(bpy) -> dict:
    return json.loads(bpy.context.scene.radiosity.report)


def test_keywords_stand_in_for_the_scenes_settings(file):
    """For one bake: what is not given is the scene's, and the scene's stay."""
    properties = file.context.scene.radiosity
    properties.bake_name = "Lit"
    assert file.ops.radiosity.bake(target="IMAGE", error=0.2, resolution=16) == {"FINISHED"}
    assert file.data.images["Lit_Box"].size[:] == (16, 16)
    assert report_of(file)["target_error"] == pytest.approx(0.2, rel=1e-6)
    assert (properties.target, properties.quality) == ("VERTEX", "HIGH")
    assert file.ops.radiosity.bake(quality="DRAFT") == {"FINISHED"}
    assert report_of(file)["target_error"] == 0.1  # nothing of the first call stays
    assert len(file.data.images) == 1 and "Lit" in file.data.objects["Box"].data.color_attributes


def test_keywords_imply_what_they_need(file, tmp_path):
    from radiosity_addon.ui.keywords import with_keywords
    from radiosity_addon.ui.properties import settings_of

    def settings(**given):
        stand_in = SimpleNamespace(is_property_set=given.__contains__, **given)
        operator = SimpleNamespace(properties=stand_in)
        return settings_of(with_keywords(file.context.scene.radiosity, operator))

    assert settings().quality == "high" and settings(quality="DRAFT").quality == "draft"
    assert settings(error=0.02).target_error == 0.02
    assert settings(time_limit=5.0).time_limit == 5.0
    assert settings(target="IMAGE", image_dir=str(tmp_path)).image_dir == str(tmp_path)


def test_keywords_of_the_other_target_are_told(file):
    from radiosity_addon.ui.keywords import KEYWORDS, ONLY_FOR, without_use

    def unused(target, **given):
        stand_in = SimpleNamespace(is_property_set=given.__contains__, **given)
        return without_use(target, SimpleNamespace(properties=stand_in))

    assert unused("VERTEX", resolution=64, margin=2, quality="DRAFT") == ["resolution", "margin"]
    assert unused("IMAGE", resolution=64, domain="POINT", seed=1) == ["domain"]
    assert {name for names in ONLY_FOR.values() for name in names} <= set(KEYWORDS)
    assert file.ops.radiosity.bake(target="VERTEX", resolution=16, quality="DRAFT") == {"FINISHED"}


def test_messages_name_what_stands_in_the_panel(file):
    """Not the command line's options; what is none of them stays."""
    from radiosity_addon.options import build_parser
    from radiosity_addon.ui.words import by_labels

    assert by_labels("lower --density or raise --atlas-images, --uv-map: see --single-user; --bogus -- 2") == (
        "lower Density or raise Most Images, UV Map: see Make Meshes Single-User; --bogus -- 2")  # fmt: skip
    told = "objects resolution atlas-images density unwrap uv-map margin format color-type scale name".split()
    known = {word for action in build_parser()._actions for word in action.option_strings}
    assert all(f"--{name}" in known and "--" not in by_labels(f"--{name}") for name in told)
    # Squares of 2 m at 1000 texels per meter in 16 texels.
    with pytest.raises(RuntimeError, match=r"lower Density \(about [\d.]+ fit\) or Margin, raise Resolution"):
        file.ops.radiosity.bake(target="IMAGE", resolution=16, atlas="A", density=1000.0)


def test_wrong_keywords_are_errors(file):
    with pytest.raises(TypeError, match="PICTURE"):
        file.ops.radiosity.bake(target="PICTURE")
    with pytest.raises(TypeError, match="sharpness"):
        file.ops.radiosity.bake(sharpness=1)


def test_error_in_per_cent_is_the_error(file):
    properties = file.context.scene.radiosity
    properties.error_percent = 1.5
    assert properties.error == pytest.approx(0.015)
    properties.error = 0.07
    assert properties.error_percent == pytest.approx(7)


@pytest.mark.parametrize(
    ("baked", "left_out", "warnings", "text"),
    [(7, 0, 2, "Baked 7 objects, 2 warnings"), (1, 0, 1, "Baked 1 object, 1 warning"),
     (3, 0, 0, "Baked 3 objects"), (3, 2, 0, "Baked 3 objects, 2 left out"),
     (3, 1, 4, "Baked 3 objects, 1 left out, 4 warnings")],
)  # fmt: skip
def test_last_message(addon, baked, left_out, warnings, text):
    from radiosity_addon.ui.bake_operators import summary

    objects = [{"baked": True}] * baked + [{"baked": False}] * left_out
    assert summary({"objects": objects, "warnings": ["a"] * warnings}) == text


def test_warnings_make_the_last_message_one(file, capfd):
    file.data.objects.remove(file.data.objects["Bulb"])  # nothing lights the box
    capfd.readouterr()
    file.ops.radiosity.bake(quality="DRAFT")
    number = len(report_of(file)["warnings"])
    assert number
    last = capfd.readouterr().out.strip().splitlines()[-1]
    assert last.startswith(f"Warning: Baked 1 object, {number} warning")


class Layout:
    """A stand-in that notes which operators are drawn, and in which context."""

    def __init__(self, drawn: list) -> None:
        self.drawn, self.operator_context = drawn, ""

    def row(self):
        return Layout(self.drawn)

    def separator(self) -> None:
        pass

    def operator(self, name: str, **_):
        self.drawn.append((name, self.operator_context))
        return SimpleNamespace()


def test_menus_offer_the_bake_as_the_button_does(addon):
    """Menu search finds what stands in a menu."""
    from radiosity_addon.ui import menus

    for name, draw in menus.MENUS:
        assert draw in getattr(addon.types, name).draw._draw_funcs
        drawn: list = []
        draw(SimpleNamespace(layout=Layout(drawn)), None)
        assert ("radiosity.bake", "INVOKE_DEFAULT") in drawn
    import radiosity_addon

    radiosity_addon.unregister()
    try:
        for name, draw in menus.MENUS:
            assert draw not in getattr(getattr(addon.types, name).draw, "_draw_funcs", ())
    finally:
        radiosity_addon.register()


def test_repeating_does_not_block(file, monkeypatch):
    """A window's Repeat Last calls ``execute``; the bake is then started as the button does."""
    from radiosity_addon.ui import background, bake_operators

    begun, timers = [], []
    monkeypatch.setattr(background, "press", lambda *words: begun.append(words))
    monkeypatch.setattr(bake_operators, "bpy", SimpleNamespace(
        app=SimpleNamespace(
            background=False, timers=SimpleNamespace(register=lambda f, **_: timers.append(f))),
        context=SimpleNamespace(window=SimpleNamespace(as_pointer=lambda: 7)),
    ))  # fmt: skip
    operator = SimpleNamespace(
        options=SimpleNamespace(is_repeat=False, is_repeat_last=True),
        properties=SimpleNamespace(is_property_set=lambda name: name == "error", error=0.05),
    )  # fmt: skip
    operator._again = bake_operators.RADIOSITY_OT_bake._again.__get__(operator)
    assert bake_operators.RADIOSITY_OT_bake.execute(operator, file.context) == {"CANCELLED"}
    assert begun == []
    timers[0]()
    assert begun == [(7, {"error": 0.05})]


@pytest.mark.parametrize("kind", [Refused, ValueError])
def test_failure_of_the_timers_step_is_the_operators_to_tell(file, monkeypatch, kind):
    """A timer has no report: the bake waits for the operator, which says it or shows its traceback."""
    from radiosity_addon.ui import background, bake_operators, properties, session

    def fail(self, context):
        self.cancel()
        raise kind("no such thing")

    settings = properties.settings_of(file.context.scene.radiosity)
    session.begin(session.BakeSession(file.context.scene.name, settings))
    monkeypatch.setattr(session.BakeSession, "step", fail)
    ticker = background.Ticker(session.current(), None, {})
    ticker._step()
    assert session.current().wants_operator and bake_operators.RADIOSITY_OT_bake.poll(file.context)
    told: list = []
    operator = SimpleNamespace(report=lambda *words: told.append(words), finished=[])
    operator._finish = lambda *words: (operator.finished.append(words), session.end())
    if kind is Refused:
        assert bake_operators.RADIOSITY_OT_bake._step(operator, file.context, session.current()) is False
        assert told == [({"ERROR"}, "no such thing")]
    else:
        with pytest.raises(ValueError) as raised:
            bake_operators.RADIOSITY_OT_bake._step(operator, file.context, session.current())
        assert raised.value.__notes__ == [bake_operators.FAULT]
        assert operator.finished  # its timer is gone and the panel drawn anew, as Blender calls nothing after this
    assert session.current() is None


def test_what_will_not_fit_is_said_by_the_button(file, monkeypatch):
    """16,384² texels: 8 and 60 bytes each of what is kept and drawn, 770,000 of 2,900 bytes that are
    worked on and 400,000 of 600 of the survey, beside 450 MB: 18.25 + 2.23 + 0.24 + 0.45 = 21.2 GB. Into
    16 GB go (13.08 GB / 68)^½ = 13,868, in steps of 16: 13,856."""
    from radiosity_addon.ui import preflight

    properties = file.context.scene.radiosity
    monkeypatch.setattr(preflight, "available_memory", lambda: 16e9)
    assert preflight.preflight(file.context).problems == ()
    properties.target, properties.resolution = "IMAGE", 16384
    (text,) = preflight.preflight(file.context).problems
    assert "21.2 GB" in text and "16.0 GB" in text and "13856" in text
    monkeypatch.setattr(preflight, "available_memory", lambda: None)
    assert preflight.preflight(file.context).problems == ()


def test_list_is_made_anew_when_something_changed_only(file, monkeypatch):
    from radiosity_addon.ui import preflight

    made = []
    original = preflight.preflight
    monkeypatch.setattr(preflight, "preflight", lambda c: made.append(1) or original(c))
    preflight.preflight_to_draw(file.context, 1e9)
    preflight.preflight_to_draw(file.context, 1e9)
    assert len(made) == 1
    file.context.scene.radiosity.resolution = 99
    preflight.preflight_to_draw(file.context, 1e9)
    assert len(made) == 2
    item = file.data.objects.new("Other", file.data.objects["Box"].data)
    file.context.scene.collection.objects.link(item)
    file.context.view_layer.update()
    assert preflight.preflight_to_draw(file.context, 1e9).sharing == ("Other",)
    assert len(made) == 3


def test_shared_meshes_are_made_single_user(file):
    mesh = file.data.objects["Box"].data
    twin = file.data.objects.new("Twin", mesh)
    file.context.scene.collection.objects.link(twin)
    file.context.view_layer.update()
    assert file.ops.radiosity.single_user() == {"FINISHED"}
    assert file.data.objects["Box"].data == mesh and twin.data != mesh
    assert file.ops.radiosity.single_user() == {"CANCELLED"}
    twin.data = mesh  # chosen alone, it leaves the mesh to the other
    file.context.scene.radiosity.objects_from = "SELECTED"
    for item in file.data.objects:
        item.select_set(item == twin)
    assert file.ops.radiosity.single_user() == {"FINISHED"}
    assert file.data.objects["Box"].data == mesh and twin.data != mesh
