"""The panel's properties and the Settings they stand for: one source of defaults and limits."""

from __future__ import annotations

from pathlib import Path

import pytest

from radiosity_addon.settings import QUALITY_ERROR, Settings


@pytest.fixture
def properties(addon):
    return addon.context.scene.radiosity


def settings(properties, **more) -> Settings:
    from radiosity_addon.ui.properties import settings_of

    return settings_of(properties, **more)


def test_defaults_are_those_of_settings(properties):
    assert settings(properties) == Settings()


def test_custom_error_starts_at_the_default_quality(properties):
    properties.quality = "CUSTOM"
    assert settings(properties).target_error == Settings().target_error


@pytest.mark.parametrize("quality", QUALITY_ERROR)
def test_qualities(properties, quality):
    properties.quality = quality.upper()
    assert settings(properties).target_error == QUALITY_ERROR[quality]


def test_every_setting_has_its_property(properties, tmp_path):
    properties.target = "IMAGE"
    properties.domain = "POINT"
    properties.resolution = 256
    properties.uv_map = " Light "
    properties.margin = 3
    properties.write_files = True
    properties.image_dir = str(tmp_path)
    properties.format = "HDR"
    properties.bake_name = "Glow"
    properties.passes = {"INDIRECT", "DIRECT"}
    properties.quality = "CUSTOM"
    properties.error = 0.25
    properties.use_time_limit, properties.time_limit = True, 12
    properties.shading_normals = False
    properties.glossy_bounces = False
    properties.seed = 7
    properties.threads = 2
    assert settings(properties, objects=("A",)) == Settings(
        objects=("A",), target="image", domain="point", resolution=256, uv_map="Light", margin=3,
        image_dir=str(tmp_path), format="hdr", name="Glow", passes=("direct", "indirect"),
        error=0.25, time_limit=12, shading_normals=False, glossy_bounces=False, seed=7,
        threads=2,
    )  # fmt: skip


def test_files_are_for_images_only(properties, tmp_path):
    properties.write_files, properties.image_dir = True, str(tmp_path)
    assert settings(properties).image_dir is None


@pytest.mark.parametrize("error", [1e-4, 0.03, 0.1, 1.0])
def test_error_is_the_number_that_was_typed(properties, error):
    """As the command line takes it, though Blender's property holds 24 bits of it: the two give
    identical colors, and the least of the range is not below it."""
    properties.quality, properties.error = "CUSTOM", error
    assert settings(properties).target_error == error


def test_no_pass_is_an_error_that_says_what_to_do(properties):
    properties.passes = set()
    with pytest.raises(ValueError, match="choose from emit"):
        settings(properties)


def test_limits_are_those_of_settings(properties):
    from radiosity_addon.settings import ERROR_RANGE, RESOLUTION_RANGE

    found = properties.bl_rna.properties
    assert (found["resolution"].hard_min, found["resolution"].hard_max) == RESOLUTION_RANGE
    assert found["error"].hard_min == pytest.approx(ERROR_RANGE[0])
    assert found["error"].hard_max == pytest.approx(ERROR_RANGE[1])


def test_saved_with_the_file(addon, properties, tmp_path):
    properties.resolution, properties.quality = 64, "HIGH"
    path = str(tmp_path / "saved.blend")
    addon.ops.wm.save_as_mainfile(filepath=path)
    properties.resolution = 32
    addon.ops.wm.open_mainfile(filepath=path)
    assert addon.context.scene.radiosity.resolution == 64
    assert addon.context.scene.radiosity.quality == "HIGH"


def test_presets_hold_every_setting_but_the_files_own(addon):
    from radiosity_addon.ui.presets import RADIOSITY_OT_preset_add
    from radiosity_addon.ui.properties import RadiositySettings

    held = {value.removeprefix("radiosity.") for value in RADIOSITY_OT_preset_add.preset_values}
    own = {"report", "image_dir", "objects_from"}
    assert held | own == set(RadiositySettings.__annotations__)
    assert not held & own


def test_preset_brings_the_settings_back(addon, properties, tmp_path, monkeypatch):
    monkeypatch.setattr(addon.utils, "user_resource", lambda *a, **k: str(tmp_path))
    properties.resolution, properties.passes = 333, {"DIRECT"}
    addon.ops.radiosity.preset_add(name="Mine")
    properties.resolution, properties.passes = 12, {"EMIT"}
    addon.ops.script.execute_preset(
        filepath=str(tmp_path / "Mine.py"), menu_idname="RADIOSITY_PT_presets"
    )
    assert properties.resolution == 333
    assert properties.passes == {"DIRECT"}


def test_shipped_presets_run_and_are_found(addon, properties):
    names = {path.name for folder in addon.utils.preset_paths("radiosity")
             for path in Path(folder).glob("*.py")}  # fmt: skip
    assert names >= {"Vertex_Colors.py", "Lightmap_for_a_Game_Engine.py", "Indirect_Light_Only.py"}
    for name in names:
        path = addon.utils.preset_find(name.removesuffix(".py"), "radiosity")
        addon.ops.script.execute_preset(filepath=path, menu_idname="RADIOSITY_PT_presets")
        settings(properties)


def test_lightmap_preset_leaves_the_surface_color_out(addon, properties):
    path = addon.utils.preset_find("Lightmap_for_a_Game_Engine", "radiosity")
    addon.ops.script.execute_preset(filepath=path, menu_idname="RADIOSITY_PT_presets")
    assert settings(properties).passes == ("direct", "indirect")
