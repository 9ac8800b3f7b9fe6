"""Materials: reflectance, emission and transmittance from node trees, against Cycles' own bakes."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.principled import diffuse_share
from tests.export.scene_building import (
    add_image,
    add_material,
    add_plane,
    cycles_bake,
    diffuse,
    image_material,
    material_of,
    principled,
    surface,
    value_at,
)

PRINCIPLED = {
    "default": {},
    "colored": {"Base_Color": (0.8, 0.4, 0.2, 1.0)},
    "half metal": {"Metallic": 0.5},
    "half glass": {"Transmission_Weight": 0.5},
    "half clear": {"Alpha": 0.5},
    "smooth": {"Roughness": 0.0, "IOR": 1.7},
    "rough": {"Roughness": 1.0, "IOR": 1.33},
    "diamond": {"Roughness": 0.3, "IOR": 2.4},
    "no coating": {"Specular_IOR_Level": 0.0},
    "strong coating": {"Specular_IOR_Level": 1.0},
    "coat": {"Coat_Weight": 1.0},
    "sheen": {"Sheen_Weight": 0.5},
    "subsurface": {"Subsurface_Weight": 0.5},
    "emitting": {"Emission_Color": (1.0, 0.5, 0.25, 1.0), "Emission_Strength": 7.0},
}


@pytest.mark.parametrize("name", PRINCIPLED)
def test_principled_is_as_cycles_bakes_it(blender, export, name):
    plane = add_plane(blender, material=principled(blender, **PRINCIPLED[name]))
    material = material_of(export())
    color = cycles_bake(blender, plane, "DIFFUSE", ("COLOR",), samples=4)[0, 0]
    emission = cycles_bake(blender, plane, "EMIT", (), samples=4)[0, 0]
    # The table of the coating's albedo is interpolated: 0.2 % of reflectance.
    np.testing.assert_allclose(value_at(material.diffuse_reflectance, 0, 0.3, 0.3), color, atol=2e-3)
    np.testing.assert_allclose(value_at(material.emission, 0, 0.3, 0.3), emission, atol=1e-4)


def test_diffuse_share_of_known_coatings():
    # At roughness 0 the coating mirrors F0 = ((1.5-1)/(1.5+1))² = 0.04; without contrast nothing.
    assert diffuse_share(1.5, 0.0) == pytest.approx(0.96, abs=2e-4)
    assert diffuse_share(1.0, 0.5) == 1.0
    assert diffuse_share(1.5, 0.0, level=1.0) == pytest.approx(0.92, abs=4e-4)


def test_shaders_and_their_mixtures(blender, export):
    material, nodes, link = add_material(blender)
    mix, add = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeAddShader")
    matte, glow = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeEmission")
    clear = nodes.new("ShaderNodeBsdfTransparent")
    matte.inputs["Color"].default_value = (0.8, 0.4, 0.2, 1)
    glow.inputs["Color"].default_value = (1, 0.5, 0, 1)
    glow.inputs["Strength"].default_value = 4
    clear.inputs["Color"].default_value = (0.5, 1, 1, 1)
    mix.inputs[0].default_value = 0.25
    link(matte.outputs[0], add.inputs[0])
    link(glow.outputs[0], add.inputs[1])
    link(add.outputs[0], mix.inputs[1])
    link(clear.outputs[0], mix.inputs[2])
    surface(material, mix)
    add_plane(blender, material=material)
    ours = material_of(export())
    # 3/4 of (matte + glow), 1/4 of clear.
    np.testing.assert_allclose(ours.reflectance.value, (0.6, 0.3, 0.15), rtol=1e-6)
    np.testing.assert_allclose(ours.emission.value, (3, 1.5, 0), rtol=1e-6)
    np.testing.assert_allclose(ours.transmittance.value, (0.125, 0.25, 0.25), rtol=1e-6)


def test_color_attribute(blender, export):
    material, nodes, link = add_material(blender)
    node, color = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeVertexColor")
    color.layer_name = "Paint"
    link(color.outputs["Color"], node.inputs["Color"])
    surface(material, node)
    mesh = add_plane(blender, material=material).data
    paint = np.random.default_rng(3).random((4, 4)).astype(np.float32)
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER").data.foreach_set(
        "color", paint.ravel()
    )
    field = material_of(export()).reflectance
    mesh.calc_loop_triangles()
    loops = [tuple(triangle.loops) for triangle in mesh.loop_triangles]
    np.testing.assert_allclose(field.values, paint[np.array(loops), :3], rtol=1e-6)


def test_no_material_and_empty_slot_are_default_gray(blender, export):
    add_plane(blender, "Bare")
    add_plane(blender, "Empty").data.materials.append(None)
    for material in export().scene.materials:
        np.testing.assert_allclose(material.reflectance.value, 0.8)


def test_slot_of_the_object_wins(blender, export):
    plane = add_plane(blender, material=diffuse(blender, (1, 0, 0)))
    plane.material_slots[0].link = "OBJECT"
    plane.material_slots[0].material = diffuse(blender, (0, 1, 0))
    np.testing.assert_allclose(material_of(export()).reflectance.value, (0, 1, 0))


def test_slot_index_past_the_end_is_the_last_slot(blender, export):
    mesh = add_plane(blender, material=diffuse(blender, (1, 0, 0))).data
    mesh.materials.append(diffuse(blender, (0, 0, 1)))
    mesh.polygons[0].material_index = 7
    np.testing.assert_allclose(material_of(export()).reflectance.value, (0, 0, 1))


@pytest.mark.parametrize("value, kept, words", [
    (1.5, 1.0, "reflectance 1.5 is above 1; it is clamped to 1"),
    (-1.0, 0.0, "reflectance that is negative, not a number or above 1e+37 is taken as 0"),
])  # fmt: skip
def test_impossible_reflectance(blender, export, value, kept, words):
    material, nodes, link = add_material(blender)
    node, number = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeValue")
    number.outputs[0].default_value = value
    link(number.outputs[0], node.inputs["Color"])
    surface(material, node)
    add_plane(blender, material=material)
    exported = export()
    np.testing.assert_allclose(material_of(exported).reflectance.value, kept)
    assert exported.warnings == (f'material "Material": {words}',)


def test_impossible_reflectance_that_cycles_evaluated(blender, export):
    material, nodes, link = add_material(blender)
    node, rgb = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeCombineXYZ")
    rgb.inputs[0].default_value = 1.5
    link(rgb.outputs[0], node.inputs["Color"])
    surface(material, node)
    add_plane(blender, material=material)
    exported = export()
    np.testing.assert_allclose(material_of(exported).reflectance.value, (1, 0, 0))
    assert "clamped to 1" in exported.warnings[0]


def test_color_attribute_is_clamped(blender, export):
    material, nodes, link = add_material(blender)
    node, color = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeVertexColor")
    link(color.outputs["Color"], node.inputs["Color"])
    surface(material, node)
    mesh = add_plane(blender, material=material).data
    paint = mesh.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    paint.data.foreach_set("color", [-1.0, 0.5, 3.0, 1.0] * 4)
    mesh.color_attributes.render_color_index = 0
    values = material_of(export()).reflectance.values
    np.testing.assert_allclose(values, np.broadcast_to((0, 0.5, 1), values.shape))


def test_emission_of_strength_zero_is_black(blender, export):
    image = add_image(blender, np.ones((2, 2, 4)))
    material = image_material(blender, image)
    next(n for n in material.node_tree.nodes if n.type == "EMISSION").inputs[1].default_value = 0
    add_plane(blender, material=material)
    assert not np.any(material_of(export()).emission.value)


def test_unlinked_output_is_black(blender, export):
    add_plane(blender, material=add_material(blender)[0])
    assert not np.any(material_of(export()).reflectance.value)


def test_faces_without_material_are_named_once(blender, export):
    for number in range(5):
        add_plane(blender, f"Bare {number}")
    add_plane(blender, "Painted", material=diffuse(blender))
    said = [w for w in export().warnings if "without material" in w]
    assert said == ["faces without material are gray, as in Cycles; objects: 'Bare 0', 'Bare 1', "
                    "'Bare 2' and 2 more"]  # fmt: skip


def test_cyclic_tree_is_named_and_read(blender, export):
    """Two Mix Shaders feed each other; Blender marks one link invalid and Cycles ignores it."""
    material, nodes, link = add_material(blender, "Round")
    first, second = (nodes.new("ShaderNodeMixShader") for _ in range(2))
    red = nodes.new("ShaderNodeBsdfDiffuse")
    for mix in (first, second):
        link(red.outputs[0], mix.inputs[1])
        link(red.outputs[0], mix.inputs[2])
        mix.inputs[0].default_value = 0.0
    link(first.outputs[0], second.inputs[1])
    link(second.outputs[0], first.inputs[2])
    surface(material, second)
    add_plane(blender, material=material)
    exported = export()
    assert any('"Round": links that form a cycle' in w for w in exported.warnings)
    np.testing.assert_allclose(material_of(exported).reflectance.value, 0.8)


@pytest.mark.parametrize("output", [True, False])
def test_unlinked_output_is_named(blender, export, output):
    material, nodes, _ = add_material(blender, "Loose")
    if not output:
        nodes.clear()
    add_plane(blender, material=material)
    exported = export()
    assert not np.any(material_of(exported).reflectance.value)
    assert any('"Loose" has no shader linked' in w for w in exported.warnings)


def test_translucency_is_named(blender, export):
    material, nodes, _ = add_material(blender, "Paper")
    surface(material, nodes.new("ShaderNodeBsdfTranslucent"))
    add_plane(blender, material=material)
    assert any('"Paper" is translucent' in w for w in export().warnings)


def test_maps_that_bend_the_surface_are_named(blender, export):
    """A normal map and a displacement are named in one sentence, a map that nothing takes is not."""
    matte = diffuse(blender, name="Brick")
    nodes, links = matte.node_tree.nodes, matte.node_tree.links
    bump = nodes.new("ShaderNodeNormalMap")
    links.new(bump.outputs["Normal"], nodes["Diffuse BSDF"].inputs["Normal"])
    moved = diffuse(blender, name="Sand")
    nodes, links = moved.node_tree.nodes, moved.node_tree.links
    output = next(n for n in nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    links.new(nodes.new("ShaderNodeDisplacement").outputs[0], output.inputs["Displacement"])
    idle = diffuse(blender, name="Plaster")
    idle.node_tree.nodes.new("ShaderNodeBump")
    for material in (matte, moved, idle):
        add_plane(blender, material=material)
    (found,) = [w for w in export().warnings if "bump" in w]
    assert found.endswith("materials: 'Brick', 'Sand'")


def test_nothing_is_said_of_flat_materials(blender, export):
    add_plane(blender, material=diffuse(blender))
    assert not any("bump" in w for w in export().warnings)
