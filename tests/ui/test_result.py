"""After a bake: the viewport shows it and goes back, and materials that show it are built."""

from __future__ import annotations

from contextlib import contextmanager

import pytest

from tests.ui.bakes import rendered


@pytest.fixture
def baked(addon, room):
    """The open room with a color attribute as a bake leaves it: red, with no bake run."""
    addon.ops.wm.open_mainfile(filepath=str(room))
    write_attribute(addon)
    return addon


def write_attribute(bpy, name: str = "Radiosity") -> None:
    layers = bpy.data.objects["Box"].data.color_attributes
    layers.new(name=name, type="FLOAT_COLOR", domain="CORNER")
    layers[name].data.foreach_set("color", [0.8, 0.1, 0.1, 1.0] * len(layers[name].data))


def write_image(bpy) -> None:
    import numpy as np

    from radiosity_addon.bake.image import write_image

    bpy.context.scene.radiosity.target = "IMAGE"
    write_image("Radiosity_Box", np.ones((4, 4, 4), np.float32))
    bpy.data.objects["Box"].data.uv_layers.new(name="Radiosity UV")


@contextmanager
def viewport(bpy):
    """A 3D View to press buttons in; the module has one, if no window."""
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=area):
        yield area.spaces.active


def test_viewport_shows_the_bake_and_goes_back(baked):
    """Over Solid mode; the mesh's own choice of a color attribute is not touched."""
    from radiosity_addon.ui import overlay

    write_attribute(baked, "Mine")
    colors = baked.data.objects["Box"].data.color_attributes
    colors.active_color_name = "Mine"
    with viewport(baked) as space:
        space.shading.type, space.shading.show_xray = "WIREFRAME", True
        assert baked.ops.radiosity.show() == {"FINISHED"}
        assert space.shading.type == "SOLID" and not space.shading.show_xray
        assert list(overlay._spaces) == [space.as_pointer()]
        assert colors.active_color_name == "Mine"
        assert baked.ops.radiosity.show() == {"FINISHED"}
        assert space.shading.type == "WIREFRAME" and space.shading.show_xray
        assert not overlay._spaces and overlay._handle is None


def pieces(bpy, earlier=None, changed=None) -> dict:
    from radiosity_addon.ui.overlay_pieces import pieces_of

    context = bpy.context
    depsgraph = context.evaluated_depsgraph_get()
    found = pieces_of(
        context.view_layer, depsgraph, context.scene.radiosity, earlier or {}, changed
    )
    return {piece.name: piece for piece in found.values()}, found


def test_shown_are_the_triangles_with_their_light(baked):
    """The box has 5 quads: 10 triangles, 30 corners. Byte colors are times their scale."""
    import numpy as np

    light = np.tile([0.8, 0.1, 0.1], (30, 1))
    names, found = pieces(baked)
    assert names["Box"].points.shape == (30, 3)
    assert names["Box"].baked == pytest.approx(light)
    box = baked.data.objects["Box"]
    box.data["Radiosity_scale"] = 2.0
    assert pieces(baked)[0]["Box"].baked == pytest.approx(2 * light)
    assert pieces(baked, found, set())[0]["Box"] is names["Box"]  # nothing changed: not read again
    assert pieces(baked, found, {box.data.session_uid})[0]["Box"] is not names["Box"]


def test_shown_follow_target_and_name(baked):
    properties = baked.context.scene.radiosity
    _, found = pieces(baked)
    properties.bake_name = "Other"
    hole = pieces(baked, found, set())[0]["Box"]
    assert hole.source == ("", "") and hole.baked is None
    properties.bake_name = "Radiosity"
    write_image(baked)
    shown = pieces(baked, found, set())[0]["Box"]
    assert shown.source == ("Radiosity UV", "Radiosity_Box") and shown.baked.shape == (30, 3)


def test_what_is_edited_is_shown_by_blender(baked):
    baked.context.view_layer.objects.active = baked.data.objects["Box"]
    baked.ops.object.mode_set(mode="EDIT")
    assert pieces(baked)[0]["Box"].baked is None
    baked.ops.object.mode_set(mode="OBJECT")
    assert pieces(baked)[0]["Box"].baked is not None


@pytest.mark.parametrize("view", ["Standard", "AgX", "Filmic"])
def test_table_of_the_view_is_blenders(baked, view, tmp_path):
    """The sRGB curve (IEC 61966-2-1) for the Standard view; for all, what Blender saves. Four grid
    points a stop: h²/8 · (ln 2 / 2.4)² = 0.0007 of the value between two of them for the former."""
    import numpy as np

    from radiosity_addon.ui import display

    scene = baked.context.scene
    scene.view_settings.view_transform, scene.view_settings.exposure = view, 3.0  # not in the table
    blocks = len(baked.data.scenes), len(baked.data.images)
    table = display.table_of(display.view_of(scene))
    assert blocks == (len(baked.data.scenes), len(baked.data.images))
    levels = display.levels()
    grid = table.reshape(display.SIZE, display.SIZE, display.SIZE, -1)  # green, blue, red
    gray = np.array([grid[i, i, i, 0] for i in range(display.SIZE)])
    assert (np.diff(gray) >= 0).all() and gray[0] < 0.002
    one = int(np.argmin(abs(levels - 1)))
    assert levels[one] == 1.0 and len(levels) == display.SIZE
    if view == "Standard":
        clipped = np.minimum(levels, 1)
        curve = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
        assert gray == pytest.approx(curve, abs=1e-3)
        assert grid[5, one, 9, :3] == pytest.approx([curve[9], curve[5], curve[one]], abs=1e-3)
    else:
        assert 0.4 < gray[int(np.argmin(abs(levels - 0.18)))] < 0.55  # middle gray stays in the middle
        assert gray[one] < 0.9  # and white is no longer where display white is


def test_unregistering_gives_the_viewport_back(blender, room):
    import radiosity_addon

    radiosity_addon.register()
    blender.ops.wm.open_mainfile(filepath=str(room))
    write_attribute(blender)
    with viewport(blender) as space:
        space.shading.type = "WIREFRAME"
        blender.ops.radiosity.show()
        radiosity_addon.unregister()
        assert space.shading.type == "WIREFRAME"


def test_nothing_to_show_is_said(baked):
    baked.context.scene.radiosity.bake_name = "Other"
    with viewport(baked):
        assert not baked.ops.radiosity.show.poll()
    assert not baked.ops.radiosity.build_material.poll()


def test_attribute_beside_a_uv_map_of_its_name_is_found(baked):
    from radiosity_addon.ui.results import attribute_of

    mesh = baked.data.objects["Box"].data
    mesh.color_attributes["Radiosity"].name = "Radiosity Color"
    assert attribute_of(baked.context.scene.radiosity, mesh) == "Radiosity Color"


def test_built_material_leaves_the_users_alone(baked):
    item = baked.data.objects["Box"]
    mine = baked.data.materials.new("Mine")
    item.data.materials.append(mine)
    assert baked.ops.radiosity.build_material() == {"FINISHED"}
    assert item.material_slots[0].material == mine
    assert baked.data.materials["Radiosity_Box Preview"].use_fake_user


def test_material_put_on_keeps_the_users_on_the_mesh(baked):
    item = baked.data.objects["Box"]
    mine = baked.data.materials.new("Mine")
    item.data.materials.append(mine)
    baked.ops.radiosity.build_material(assign=True)
    assert item.material_slots[0].material.name == "Radiosity_Box Preview"
    assert item.data.materials[0] == mine
    item.material_slots[0].link = "DATA"
    assert item.material_slots[0].material == mine


def emission_source(material):
    output = next(n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL")
    emission = output.inputs["Surface"].links[0].from_node
    assert emission.type == "EMISSION" and emission.inputs["Strength"].default_value == 1
    return emission.inputs["Color"].links[0].from_node


def test_material_emits_the_attribute(baked):
    baked.ops.radiosity.build_material()
    source = emission_source(baked.data.materials["Radiosity_Box Preview"])
    assert source.type == "ATTRIBUTE" and source.attribute_name == "Radiosity"


def test_material_emits_byte_colors_times_their_scale(baked):
    baked.data.objects["Box"].data["Radiosity_scale"] = 2.5
    baked.ops.radiosity.build_material()
    material = baked.data.materials["Radiosity_Box Preview"]
    emission = next(n for n in material.node_tree.nodes if n.type == "EMISSION")
    assert emission.inputs["Strength"].default_value == 2.5


def test_material_emits_the_image_through_its_map(baked):
    write_image(baked)
    baked.ops.radiosity.build_material()
    source = emission_source(baked.data.materials["Radiosity_Box Preview"])
    assert source.image.name == "Radiosity_Box"
    assert source.inputs["Vector"].links[0].from_node.uv_map == "Radiosity UV"


def test_material_renders_the_baked_radiance(baked, tmp_path):
    """Cycles looks at the back wall, whose attribute is (0.8, 0.1, 0.1): the pixel is that."""
    baked.ops.radiosity.build_material(assign=True)
    assert rendered(baked, tmp_path / "seen.exr") == pytest.approx([0.8, 0.1, 0.1], rel=2e-3)  # half floats
