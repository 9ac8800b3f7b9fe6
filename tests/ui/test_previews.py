"""Bakes look through our own materials, and Remove Bake takes back what was made."""

from __future__ import annotations

import numpy as np
import pytest

from tests.export.scene_building import diffuse
from tests.ui.bakes import ALL_PASSES, rendered

pytestmark = pytest.mark.usefixtures("solver_here")
OWN = (0.6, 0.3, 0.15)


@pytest.fixture
def file(file):
    """The room with a colored material in its only slot."""
    file.context.scene.radiosity.resolution = 16
    file.data.objects["Box"].data.materials.append(diffuse(file, OWN, "Own"))
    return file


def bake(bpy) -> None:
    assert bpy.ops.radiosity.bake() == {"FINISHED"}


def baked(bpy, name: str = "Radiosity") -> np.ndarray:
    """(n, 3) of the target that is chosen."""
    if bpy.context.scene.radiosity.target == "VERTEX":
        data, field = bpy.data.objects["Box"].data.color_attributes[name].data, "color"
    else:
        data, field = bpy.data.images[f"{name}_Box"].pixels, ""
    values = np.empty(len(data) * (4 if field else 1), np.float32)
    data.foreach_get(*((field, values) if field else (values,)))
    return values.reshape(-1, 4)[:, :3]


@pytest.mark.parametrize("passes", [ALL_PASSES, {"DIRECT", "INDIRECT"}])
@pytest.mark.parametrize("target", ["VERTEX", "IMAGE"])
def test_light_changed_after_putting_on_is_baked(file, target, passes):
    """All light is the lamp's, so twice its power is twice the radiance everywhere, up to the
    error that is asked for, 10 %. Taken for light, the old bake would come back as it was."""
    properties = file.context.scene.radiosity
    properties.target, properties.passes = target, passes
    bake(file)
    before = baked(file).copy()
    assert before.max() > 0
    file.ops.radiosity.build_material(assign=True)
    assert file.data.objects["Box"].material_slots[0].material != file.data.materials["Own"]
    file.data.lights["Bulb"].energy *= 2
    bake(file)
    np.testing.assert_allclose(baked(file), 2 * before, rtol=0.1, atol=1e-6)
    from radiosity_addon.ui.report_store import load_report

    assert load_report(file.context.scene)["estimated_error"] > 0


def exported(bpy):
    from radiosity_addon.export import export_scene
    from radiosity_addon.settings import Settings

    return export_scene(bpy.context, Settings()).scene


def shows_own(bpy) -> None:
    """The export sees reflectance OWN and no emission."""
    (material,) = {m.name: m for m in exported(bpy).materials}.values()
    np.testing.assert_allclose(material.reflectance.value, OWN, rtol=1e-6)
    assert not np.any(material.emission.value)


def test_export_sees_what_was_there_before(file):
    """In whichever way the preview came to the slot."""
    item, own = file.data.objects["Box"], file.data.materials["Own"]
    bake(file)
    slot = item.material_slots[0]
    slot.link, slot.material = "OBJECT", own  # the user's own link, over another of the mesh
    item.data.materials[0] = diffuse(file, (0.1, 0.1, 0.1), "Below")
    file.ops.radiosity.build_material(assign=True)
    shows_own(file)
    own.name = "Renamed"
    shows_own(file)
    file.ops.radiosity.build_material(assign=True)  # over itself
    shows_own(file)
    preview = item.material_slots[0].material
    del item["radiosity_before"]
    item.data.materials[0] = preview  # chosen by hand, on the mesh
    shows_own(file)


def test_materials_of_the_first_version_are_seen_through(file):
    """They were unmarked: an Emission of the attribute NAME, called NAME Preview."""
    bake(file)
    material = file.data.materials.new("Radiosity Preview.001")
    if not material.node_tree:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    emission, attribute = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAttribute")
    attribute.attribute_name = "Radiosity"
    link = material.node_tree.links.new
    link(attribute.outputs["Color"], emission.inputs["Color"])
    link(emission.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    slot = file.data.objects["Box"].material_slots[0]
    slot.link, slot.material = "OBJECT", material
    shows_own(file)
    attribute.attribute_name = "Mine"  # no bake of that name: the user's own glow
    assert exported(file).materials[0].name == "Radiosity Preview.001"


def test_one_material_for_each_object_used_again(file):
    twin = file.data.objects.new("Twin", file.data.objects["Box"].data.copy())
    file.context.scene.collection.objects.link(twin)
    bake(file)
    for _ in range(2):
        file.ops.radiosity.build_material(assign=True)
        names = {m.name for m in file.data.materials} - {"Own"}
        assert names == {"Radiosity_Box Preview", "Radiosity_Twin Preview"}
    file.context.scene.radiosity.passes = {"DIRECT"}
    bake(file)
    file.ops.radiosity.build_material(assign=True)
    assert {m.name for m in file.data.materials} - {"Own"} == names
    assert twin.material_slots[0].material.name == "Radiosity_Twin Preview"


def test_light_alone_is_shown_times_the_base_color(file, tmp_path):
    """The attribute is set to (0.5, 1, 2): the wall shows (0.6·0.5, 0.3·1, 0.15·2) = 0.3 each."""
    file.context.scene.radiosity.passes = {"DIRECT"}
    bake(file)
    data = file.data.objects["Box"].data.color_attributes["Radiosity"].data
    data.foreach_set("color", [0.5, 1.0, 2.0, 1.0] * len(data))
    file.ops.radiosity.build_material(assign=True)
    assert rendered(file, tmp_path / "seen.exr") == pytest.approx([0.3] * 3, rel=2e-3)


def test_light_alone_on_two_materials_and_a_mixture(file):
    """Half of white, half of black mixed is 0.5: nodes are built for it, slots stay apart."""
    from radiosity_addon.ui.base_color import base_color

    item = file.data.objects["Box"]
    mixed = diffuse(file, (1, 1, 1), "Mixed")
    nodes, link = mixed.node_tree.nodes, mixed.node_tree.links.new
    mix, output = nodes.new("ShaderNodeMixShader"), mixed.node_tree.get_output_node("CYCLES")
    mix.inputs[0].default_value = 0.5
    link(output.inputs["Surface"].links[0].from_node.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    link(mix.outputs[0], output.inputs["Surface"])
    item.data.materials.append(mixed)
    file.context.scene.radiosity.passes = {"DIRECT"}
    bake(file)
    file.ops.radiosity.build_material(assign=True)
    first, second = (slot.material for slot in item.material_slots)
    assert first != second
    value = base_color(mixed.copy().node_tree).node
    assert value.operation == "MULTIPLY_ADD" and value.inputs[1].default_value[0] == 0.5


def counts(bpy) -> tuple:
    data = bpy.data
    mesh = data.objects["Box"].data
    return (len(data.materials), len(data.images), len(mesh.color_attributes),
            len(mesh.uv_layers), len(mesh.materials))  # fmt: skip


@pytest.mark.parametrize("linked", [False, True])
def test_remove_takes_back_all_that_was_made(file, linked):
    item, own = file.data.objects["Box"], file.data.materials["Own"]
    colors = item.data.color_attributes.new("Mine", "BYTE_COLOR", "POINT")
    item.data.uv_layers.new(name="UV")
    if linked:
        item.material_slots[0].link = "OBJECT"
        item.material_slots[0].material = own
    before = counts(file)
    for target in ("VERTEX", "IMAGE"):
        file.context.scene.radiosity.target = target
        bake(file)
        file.ops.radiosity.build_material(assign=True)
    assert counts(file) == (before[0] + 1, before[1] + 1, before[2] + 1, before[3] + 1, before[4])
    assert file.ops.radiosity.remove_bake() == {"FINISHED"}
    assert counts(file) == before
    slot = item.material_slots[0]
    assert (slot.material, slot.link) == (own, "OBJECT" if linked else "DATA")
    assert colors.name == "Mine" and not item.data.keys() and not item.keys()
    assert file.ops.radiosity.remove_bake() == {"CANCELLED"}


def test_what_a_bake_tells_goes_with_it(file):
    """The scale of byte colors, and the report with the last of all that it tells of."""
    scene, mesh = file.context.scene, file.data.objects["Box"].data
    scene.radiosity.byte_colors = scene.radiosity.auto_scale = True
    bake(file)
    assert "Radiosity_scale" in mesh
    scene.radiosity.target = "IMAGE"
    bake(file)
    file.ops.radiosity.remove_bake(kinds={"COLORS"})
    assert "Radiosity_scale" not in mesh and scene.radiosity.report
    file.ops.radiosity.remove_bake(kinds={"IMAGES"})
    assert not scene.radiosity.report


def test_remove_one_kind_and_of_the_selected_only(file):
    twin = file.data.objects.new("Twin", file.data.objects["Box"].data.copy())
    file.context.scene.collection.objects.link(twin)
    file.context.scene.radiosity.target = "IMAGE"
    bake(file)
    file.ops.radiosity.build_material(assign=True)
    file.ops.radiosity.remove_bake(kinds={"MATERIALS"})
    assert [m.name for m in file.data.materials] == ["Own"] and len(file.data.images) == 2
    twin.select_set(True)
    file.data.objects["Box"].select_set(False)
    file.ops.radiosity.remove_bake(selected=True)
    assert [image.name for image in file.data.images] == ["Radiosity_Box"]
    assert not twin.data.uv_layers and len(file.data.objects["Box"].data.uv_layers) == 1


def test_slot_made_to_put_on_goes_too(file):
    mesh = file.data.objects["Box"].data
    mesh.materials.clear()
    twin = file.data.objects.new("Twin", mesh)
    file.context.scene.collection.objects.link(twin)
    bake(file)
    file.ops.radiosity.build_material(assign=True)
    assert len(mesh.materials) == 1
    twin.select_set(True)
    file.ops.radiosity.remove_bake(selected=True, kinds={"MATERIALS"})
    file.ops.radiosity.remove_bake(kinds={"MATERIALS"})
    assert len(mesh.materials) == 0


def test_what_the_user_had_under_our_name_stays(file):
    """An attribute that was there is written over, and not removed: it is not ours."""
    file.data.objects["Box"].data.color_attributes.new("Radiosity", "FLOAT_COLOR", "CORNER")
    bake(file)
    assert file.ops.radiosity.remove_bake() == {"CANCELLED"}
    assert len(file.data.objects["Box"].data.color_attributes) == 1


def test_failed_bake_leaves_no_note(file, monkeypatch):
    from radiosity_addon.stages import apply

    monkeypatch.setattr(apply, "note", lambda *_, **__: 1 / 0)
    with pytest.raises((RuntimeError, ZeroDivisionError)):
        file.ops.radiosity.bake()
    mesh = file.data.objects["Box"].data
    assert not mesh.keys() and not mesh.color_attributes


def test_a_bake_in_a_material_of_the_users_is_told(file):
    """Taken for the surface's own color, light would count twice. What Build Material made is looked through."""
    from radiosity_addon.bake.image import write_image
    from radiosity_addon.export import export_scene
    from radiosity_addon.settings import Settings

    def told() -> list[str]:
        warnings = export_scene(file.context, Settings()).warnings
        return [text for text in warnings if "which a bake made" in text]

    bake(file)
    tree = file.data.materials["Own"].node_tree
    shader = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    color, picture = tree.nodes.new("ShaderNodeVertexColor"), tree.nodes.new("ShaderNodeTexImage")
    color.layer_name, picture.image = "Radiosity", write_image("Radiosity_Box", np.ones((2, 2, 4), np.float32))
    assert not told()  # neither is linked
    tree.links.new(color.outputs["Color"], shader.inputs["Color"])
    assert 'material "Own" shows color attribute "Radiosity"' in told()[0]
    tree.links.new(picture.outputs["Color"], shader.inputs["Color"])
    assert 'material "Own" shows image "Radiosity_Box"' in told()[0]
    picture.image = None
    file.ops.radiosity.build_material(assign=True)
    assert not told()


def test_a_mesh_of_another_file_stays_as_it_is_there(file, tmp_path):
    bake(file)
    file.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    with file.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, linked):
        linked.meshes = ["Box"]
    (mesh,) = linked.meshes
    item = file.data.objects.new("Linked", mesh)
    file.context.scene.collection.objects.link(item)
    file.data.objects.remove(file.data.objects["Box"])
    assert file.ops.radiosity.remove_bake() == {"CANCELLED"}
    assert "Radiosity" in mesh.color_attributes
