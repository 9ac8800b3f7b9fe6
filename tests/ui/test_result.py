"""After a bake: the viewport shows it and goes back, and materials that show it are built."""

from __future__ import annotations

from contextlib import contextmanager

import pytest


@pytest.fixture
def baked(addon, room):
    """The open room with a colour attribute as a bake leaves it: red, with no bake run."""
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


def test_viewport_shows_the_attribute_and_goes_back(baked):
    write_attribute(baked, "Mine")
    colors = baked.data.objects["Box"].data.color_attributes
    colors.active_color_name = "Mine"
    with viewport(baked) as space:
        before = space.shading.type, space.shading.light, space.shading.color_type
        space.shading.show_xray = True
        assert baked.ops.radiosity.show() == {"FINISHED"}
        after = space.shading.type, space.shading.light, space.shading.color_type
        assert after == ("SOLID", "FLAT", "VERTEX") and not space.shading.show_xray
        assert colors.active_color_name == "Radiosity"
        assert baked.ops.radiosity.show() == {"FINISHED"}
        assert (space.shading.type, space.shading.light, space.shading.color_type) == before
        assert colors.active_color_name == "Mine" and space.shading.show_xray


def test_unregistering_gives_the_viewport_back(blender, room):
    import radiosity_addon

    radiosity_addon.register()
    blender.ops.wm.open_mainfile(filepath=str(room))
    write_attribute(blender)
    with viewport(blender) as space:
        before = space.shading.light
        blender.ops.radiosity.show()
        radiosity_addon.unregister()
        assert space.shading.light == before


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


def test_material_emits_the_image_through_its_map(baked):
    write_image(baked)
    baked.ops.radiosity.build_material()
    source = emission_source(baked.data.materials["Radiosity_Box Preview"])
    assert source.image.name == "Radiosity_Box"
    assert source.inputs["Vector"].links[0].from_node.uv_map == "Radiosity UV"


def test_material_renders_the_baked_radiance(baked, tmp_path):
    """Cycles looks at the back wall, whose attribute is (0.8, 0.1, 0.1): the pixel is that."""
    baked.ops.radiosity.build_material(assign=True)
    scene = baked.context.scene
    camera = baked.data.objects.new("Eye", baked.data.cameras.new("Eye"))
    camera.location, camera.rotation_euler = (0, 0, 1), (1.5707963, 0, 0)
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "seen.exr")
    baked.ops.render.render(write_still=True)
    pixels = baked.data.images.load(scene.render.filepath).pixels[:]
    assert pixels[:3] == pytest.approx((0.8, 0.1, 0.1), rel=2e-3)  # half floats
