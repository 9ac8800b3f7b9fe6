"""Materials: reflectance, emission and transmittance from node trees, against Cycles' own bakes."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.principled import diffuse_share
from radiosity_addon.solver.fields import srgb_to_linear
from radiosity_addon.solver.materials.evaluate import evaluate_material
from tests.export.stage import (
    add_image,
    add_material,
    add_plane,
    cycles_bake,
    diffuse,
    principled,
    surface,
    value_at,
)


def material_of(exported, triangle=0):
    return exported.scene.materials[exported.scene.material[triangle]]


PRINCIPLED = {
    "default": {},
    "coloured": {"Base_Color": (0.8, 0.4, 0.2, 1.0)},
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
    np.testing.assert_allclose(value_at(material.reflectance, 0, 0.3, 0.3), color, atol=2e-3)
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


def image_material(
    bpy, image, uv=None, alpha=False, shader="ShaderNodeEmission", extension="REPEAT"
):
    material, nodes, link = add_material(bpy)
    node = surface(material, nodes.new(shader))
    texture = nodes.new("ShaderNodeTexImage")
    texture.image, texture.extension = image, extension
    link(texture.outputs["Color"], node.inputs["Color"])
    if alpha:
        link(texture.outputs["Alpha"], node.inputs["Strength"])
    if uv:
        name = nodes.new("ShaderNodeUVMap")
        name.uv_map = uv
        link(name.outputs[0], texture.inputs["Vector"])
    return material


@pytest.mark.parametrize("floats", [False, True])
@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("alpha_mode", ["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"])
@pytest.mark.parametrize("alpha", [False, True])
def test_image_pixels_are_as_cycles_shows_them(blender, export, floats, space, alpha_mode, alpha):
    image = add_image(blender, np.full((4, 4, 4), (0.8, 0.5, 0.2, 0.5)), space, alpha_mode, floats)
    plane = add_plane(blender, material=image_material(blender, image, alpha=alpha))
    ours = material_of(export()).emission
    theirs = cycles_bake(blender, plane, "EMIT", (), samples=1)[0, 0]
    # Cycles keeps 8-bit images in 8 bits also after multiplying by alpha: half a step of 1/255,
    # which the sRGB curve (slope up to 2.3 and 4.3 where alpha is divided out) makes larger.
    np.testing.assert_allclose(value_at(ours, 0, 0.3, 0.3), theirs, atol=1e-5 if floats else 0.012)


def test_image_lies_where_cycles_has_it(blender, export):
    """Every texel of an image of random colours, on both triangles."""
    pixels = np.ones((4, 4, 4))
    pixels[..., :3] = np.random.default_rng(2).random((4, 4, 3))
    image = add_image(blender, pixels, floats=True)
    add_plane(blender, material=image_material(blender, image))
    exported = export()
    field = material_of(exported).emission
    for triangle in (0, 1):
        corners = exported.scene.vertices[exported.scene.triangles[triangle]]
        for u, v in ((0.1, 0.1), (0.5, 0.25), (0.2, 0.7)):
            x, y, _ = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2]
            # The plane spans [-1, 1]²; texel (i, j) has its centre at ((j + ½)/2 - 1, ...).
            column, row = (x + 1) * 2 - 0.5, (y + 1) * 2 - 0.5
            j, i = int(np.floor(column)), int(np.floor(row))
            if 0 <= j < 3 and 0 <= i < 3:
                fx, fy = column - j, row - i
                block = pixels[i : i + 2, j : j + 2, :3]
                expected = (1 - fy) * ((1 - fx) * block[0, 0] + fx * block[0, 1]) + fy * (
                    (1 - fx) * block[1, 0] + fx * block[1, 1]
                )
                np.testing.assert_allclose(value_at(field, triangle, u, v), expected, atol=1e-5)


def test_named_uv_map_and_default_one(blender, export):
    image = add_image(blender, np.random.default_rng(0).random((2, 2, 4)), floats=True)
    mesh = add_plane(blender, material=image_material(blender, image, uv="Second")).data
    mesh.uv_layers.new(name="Second").uv.foreach_set("vector", [0.5] * 8)
    mesh.materials.append(image_material(blender, image))
    named = material_of(export()).emission
    np.testing.assert_allclose(named.uv, 0.5)
    mesh.polygons[0].material_index = 1
    default = material_of(export()).emission
    assert np.ptp(default.uv) == 1.0


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_extension_is_handed_on(blender, export, extension):
    image = add_image(blender, np.random.default_rng(0).random((2, 2, 4)), floats=True)
    add_plane(blender, material=image_material(blender, image, extension=extension))
    assert material_of(export()).emission.extension == extension


def test_colour_attribute(blender, export):
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


def test_missing_image_is_pink_with_a_warning(blender, export):
    image = blender.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", "//nowhere/lost.png"
    add_plane(blender, material=image_material(blender, image, shader="ShaderNodeBsdfDiffuse"))
    exported = export()
    np.testing.assert_allclose(material_of(exported).reflectance.value, (1, 0, 1))
    assert any('"Lost"' in w and '"Material"' in w for w in exported.warnings)


def test_no_material_and_empty_slot_are_default_grey(blender, export):
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
    (-1.0, 0.0, "reflectance negative or not a number is taken as 0"),
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


def test_colour_attribute_is_clamped(blender, export):
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


def test_metal_is_named(blender, export):
    add_plane(blender, material=principled(blender, Metallic=1.0))
    assert any("mirroring" in w and "Principled" in w for w in export().warnings)


def test_unlinked_output_is_black(blender, export):
    add_plane(blender, material=add_material(blender)[0])
    assert not np.any(material_of(export()).reflectance.value)


def test_srgb_curve():
    # IEC 61966-2-1: linear below 0.04045, and 0.5 -> ((0.5 + 0.055) / 1.055)^2.4.
    np.testing.assert_allclose(
        srgb_to_linear([0, 0.04045, 0.5, 1]), [0, 0.04045 / 12.92, (0.555 / 1.055) ** 2.4, 1],
        rtol=1e-5,
    )  # fmt: skip


def one_way(bpy, through_math: bool):
    """Red seen from the front, clear from behind; with a Math node, for Cycles to evaluate."""
    material, nodes, link = add_material(bpy)
    mix, red = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    red.inputs["Color"].default_value = (0.8, 0.2, 0.1, 1)
    factor = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    if through_math:
        math = nodes.new("ShaderNodeMath")
        math.operation = "POWER"
        link(factor, math.inputs[0])
        factor = math.outputs[0]
    link(factor, mix.inputs[0])
    link(red.outputs[0], mix.inputs[1])
    link(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
    surface(material, mix)
    return material


@pytest.mark.parametrize("evaluated", [False, True])
def test_each_side_has_its_own_surface(blender, export, evaluated):
    add_plane(blender, material=one_way(blender, evaluated))
    front = material_of(export())
    np.testing.assert_allclose(front.reflectance.value, (0.8, 0.2, 0.1), rtol=1e-3)
    assert not np.any(front.transmittance.value)
    np.testing.assert_allclose(front.back.transmittance.value, 1, rtol=1e-3)
    np.testing.assert_allclose(front.back.reflectance.value, 0, atol=1e-6)


def test_sides_inside_a_group(blender, export):
    """The group, which the user's other materials share, is turned in a copy."""
    group = blender.data.node_groups.new("Sides", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketFloat")
    side = group.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    group.links.new(side, group.nodes.new("NodeGroupOutput").inputs[0])
    material, nodes, link = add_material(blender)
    node = surface(material, nodes.new("ShaderNodeBsdfDiffuse"))
    use = nodes.new("ShaderNodeGroup")
    use.node_tree = group
    link(use.outputs[0], node.inputs["Color"])
    add_plane(blender, material=material)
    found = material_of(export())
    np.testing.assert_allclose(found.reflectance.value, 0, atol=1e-6)
    np.testing.assert_allclose(found.back.reflectance.value, 1, rtol=1e-3)
    assert len(group.nodes) == 2 and len(blender.data.node_groups) == 1


@pytest.mark.parametrize("evaluated", [False, True])
def test_each_side_emits_for_itself(blender, export, evaluated):
    """Black in front and white behind, read or evaluated by Cycles."""
    material, nodes, link = add_material(blender, "Screen")
    node = surface(material, nodes.new("ShaderNodeEmission"))
    side = nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
    if evaluated:
        same = nodes.new("ShaderNodeMath")
        same.operation, same.inputs[1].default_value = "MULTIPLY", 1.0
        link(side, same.inputs[0])
        side = same.outputs[0]
    link(side, node.inputs["Color"])
    add_plane(blender, material=material)
    exported = export()
    found = material_of(exported)
    np.testing.assert_allclose(found.emission.value, 0, atol=1e-6)
    np.testing.assert_allclose(found.back.emission.value, 1, rtol=1e-3)
    assert exported.warnings == ()


def test_encoded_pixels_are_interpolated_before_they_are_decoded(blender, export):
    """As Cycles has 8-bit images: half way from 0.1 to 0.9 lies decoded 0.5 = 0.214, and not
    the mean of decoded 0.1 and 0.9, 0.399. Bytes round either by up to 0.002."""
    pixels = np.ones((2, 2, 4))
    pixels[:, 0, :3], pixels[:, 1, :3] = 0.1, 0.9
    image = add_image(blender, pixels, "sRGB")
    plane = add_plane(blender, material=image_material(blender, image, extension="EXTEND"))
    theirs = cycles_bake(blender, plane, "EMIT", (), size=9, samples=1)[4, 4, 0]
    scene = export().scene
    place = np.array([[0.5, 0.0]])  # in the middle of the lower edge, from corner to corner
    found = evaluate_material(scene, "emission", np.array([0]), place)[0, 0]
    assert found == pytest.approx(0.214, abs=0.003)
    assert found == pytest.approx(theirs, abs=0.003)


def test_images_that_are_multiplied_are_decoded_first(blender, export):
    """0.5 decoded is 0.214; half of the light of a picture mixed with itself is 0.214 again."""
    image = add_image(blender, np.full((2, 2, 4), (0.5, 0.5, 0.5, 1.0)), "sRGB")
    material, nodes, link = add_material(blender)
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    add = nodes.new("ShaderNodeAddShader")
    for socket in add.inputs:
        glow = nodes.new("ShaderNodeEmission")
        link(texture.outputs["Color"], glow.inputs["Color"])
        link(texture.outputs["Color"], glow.inputs["Strength"])
        link(glow.outputs[0], socket)
    surface(material, add)
    add_plane(blender, material=material)
    field = material_of(export()).emission
    expected = 2 * srgb_to_linear(128 / 255) ** 2
    np.testing.assert_allclose(value_at(field, 0, 0.3, 0.3), expected, rtol=1e-5)


def test_faces_without_material_are_named_once(blender, export):
    for number in range(5):
        add_plane(blender, f"Bare {number}")
    add_plane(blender, "Painted", material=diffuse(blender))
    said = [w for w in export().warnings if "without material" in w]
    assert said == ['faces without material are grey, as in Cycles; objects: "Bare 0", "Bare 1", '
                    '"Bare 2" and 2 more']  # fmt: skip


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


def test_missing_image_of_a_tree_that_cycles_evaluates(blender, export):
    """Pink, half of it by a Math node, and named."""
    image = blender.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", "//nowhere/lost.png"
    material = image_material(blender, image, shader="ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    texture = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexImage")
    half = tree.nodes.new("ShaderNodeVectorMath")
    half.operation, half.inputs[1].default_value = "MULTIPLY", (0.5, 0.5, 0.5)
    shader = texture.outputs["Color"].links[0].to_node
    tree.links.new(texture.outputs["Color"], half.inputs[0])
    tree.links.new(half.outputs[0], shader.inputs["Color"])
    add_plane(blender, material=material)
    exported = export()
    np.testing.assert_allclose(material_of(exported).reflectance.value, (0.5, 0, 0.5), atol=1e-4)
    assert any('"Lost"' in w and '"Material"' in w for w in exported.warnings)


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
    assert found.endswith('materials: "Brick", "Sand"')


def test_nothing_is_said_of_flat_materials(blender, export):
    add_plane(blender, material=diffuse(blender))
    assert not any("bump" in w for w in export().warnings)
