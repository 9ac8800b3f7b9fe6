"""Evaluated materials: what Cycles bakes for a node tree lands where it belongs."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.squares import first_texels, make_squares
from radiosity_addon.solver.materials.evaluate import evaluate_material
from tests.export.scene_building import add_material, add_plane, diffuse, surface, value_at


def ramp_material(bpy):
    """Object coordinates as color, mixed with Transparent by u: only Cycles can read it."""
    material, nodes, link = add_material(bpy, "Ramp")
    mix, matte = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeBsdfDiffuse")
    glow, add = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
    clear, place = nodes.new("ShaderNodeBsdfTransparent"), nodes.new("ShaderNodeTexCoord")
    split, shift = nodes.new("ShaderNodeSeparateXYZ"), nodes.new("ShaderNodeVectorMath")
    shift.operation, shift.inputs[1].default_value = "ADD", (1, 1, 0.5)
    link(place.outputs["Object"], shift.inputs[0])
    link(shift.outputs[0], glow.inputs["Color"])
    link(place.outputs["Generated"], matte.inputs["Color"])
    link(place.outputs["UV"], split.inputs[0])
    link(split.outputs["X"], mix.inputs[0])
    link(matte.outputs[0], add.inputs[0])
    link(glow.outputs[0], add.inputs[1])
    link(add.outputs[0], mix.inputs[1])
    link(clear.outputs[0], mix.inputs[2])
    surface(material, mix)
    return material


@pytest.mark.parametrize("scale", [(1, 1, 1), (1, -3, 1)])
def test_every_channel_lies_where_it_should(blender, export, scale):
    add_plane(blender, material=ramp_material(blender)).scale = scale
    scene = export().scene
    material = scene.materials[scene.material[0]]
    for triangle in (0, 1):
        for u, v in ((0.1, 0.1), (0.3, 0.3), (0.8, 0.1), (0.1, 0.8), (0.02, 0.02)):
            corners = scene.vertices[scene.triangles[triangle]]
            x, y, _ = ((1 - u - v) * corners[0] + u * corners[1] + v * corners[2]) / scale
            share = 1 - (x + 1) / 2  # what is not transparent; u = (x + 1) / 2
            # The plane spans [-1, 1]², so generated coordinates are ((x+1)/2, (y+1)/2, ...).
            expected = {
                "reflectance": share * np.array([(x + 1) / 2, (y + 1) / 2]),
                "emission": share * np.array([x + 1, y + 1, 0.5]),
                "transmittance": np.repeat(1 - share, 3),
            }
            for name, values in expected.items():
                got = value_at(getattr(material, name), triangle, u, v)[: len(values)]
                # Half a texel of 1/256 of the edge, values change by at most 2 over it.
                np.testing.assert_allclose(got, values, atol=4e-3, err_msg=name)


def test_constant_results_are_constants(blender, export):
    material, nodes, link = add_material(blender)
    gamma, matte = nodes.new("ShaderNodeGamma"), nodes.new("ShaderNodeBsdfDiffuse")
    gamma.inputs["Color"].default_value = (0.5, 0.25, 1.0, 1.0)
    gamma.inputs["Gamma"].default_value = 2.0
    link(gamma.outputs[0], matte.inputs["Color"])
    surface(material, matte)
    add_plane(blender, material=material)
    ours = export().scene.materials[0]
    np.testing.assert_allclose(ours.reflectance.value, (0.25, 0.0625, 1.0), rtol=1e-5)
    assert not np.any(ours.emission.value) and not np.any(ours.transmittance.value)


def test_other_slots_are_untouched(blender, export):
    blender.ops.mesh.primitive_cube_add()
    mesh = blender.context.object.data
    mesh.materials.append(ramp_material(blender))
    mesh.materials.append(diffuse(blender, (0.1, 0.2, 0.3)))
    mesh.polygons.foreach_set("material_index", [0, 1, 0, 1, 1, 1])
    scene = export().scene
    names = [scene.materials[i].name for i in scene.material]
    assert names == ["Ramp"] * 2 + ["Diffuse"] * 2 + ["Ramp"] * 2 + ["Diffuse"] * 6
    plain = scene.materials[scene.material[2]]
    np.testing.assert_allclose(plain.reflectance.value, (0.1, 0.2, 0.3), rtol=1e-6)


def test_cyclic_node_tree_does_not_hang(blender, export):
    material, nodes, link = add_material(blender)
    a, b = nodes.new("ShaderNodeMixShader"), nodes.new("ShaderNodeMixShader")
    link(a.outputs[0], b.inputs[1])
    link(b.outputs[0], a.inputs[1])
    surface(material, b)
    add_plane(blender, material=material)
    assert np.all(np.isfinite(value_at(export().scene.materials[0].reflectance, 0, 0.3, 0.3)))


@pytest.mark.parametrize("count", [1, 2, 1000, 100_000])
def test_squares_do_not_overlap(count):
    area = np.random.default_rng(count).lognormal(0.0, 2.0, count)
    squares = make_squares(area, first_texels(count))
    corner = np.floor(squares.bake[:, 0] * squares.size + 1e-6).astype(int)
    reach = (squares.bake[:, 1, 0] - squares.bake[:, 0, 0]) * squares.size
    edge = np.where(reach < 1.5, 2, np.rint(reach + 2.9)).astype(int)
    first = corner - np.where(edge > 2, 1, 0)[:, None]
    taken = np.zeros((squares.size, squares.size), np.int32)
    for size in np.unique(edge):
        origin = first[edge == size]
        for i in range(size) if size <= 8 else (0, size // 2, size - 1):
            for j in range(size) if size <= 8 else (0, size // 2, size - 1):
                np.add.at(taken, (origin[:, 1] + i, origin[:, 0] + j), 1)
    assert taken.max() == 1


def test_world_positions_are_the_objects_own(blender, export):
    """Emission = world position, of a plane that is moved, turned and stretched: Cycles must see
    the copy it bakes where the object is."""
    material, nodes, link = add_material(blender, "Where")
    glow, place = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry")
    link(place.outputs["Position"], glow.inputs["Color"])
    surface(material, glow)
    plane = add_plane(blender, material=material)
    plane.location, plane.rotation_euler, plane.scale = (5, 6, 7), (0.2, 0.3, 1.0), (1, 2, 1)
    scene = export().scene
    field = scene.materials[scene.material[0]].emission
    for triangle in (0, 1):
        corners = scene.vertices[scene.triangles[triangle]]
        for u, v in ((0.3, 0.3), (0.8, 0.1), (0.1, 0.8)):
            expected = (1 - u - v) * corners[0] + u * corners[1] + v * corners[2]
            # Half a texel of 1/256 of an edge of 4 m.
            np.testing.assert_allclose(value_at(field, triangle, u, v), expected, atol=8e-3)


def checkered(bpy, squares: float, contrast: float):
    """A plane of so many squares along an edge, half of each, of these colors."""
    material, nodes, link = add_material(bpy, "Checkered")
    checker, matte, place = (nodes.new(f"ShaderNode{name}") for name in ("TexChecker", "BsdfDiffuse", "TexCoord"))
    checker.inputs["Scale"].default_value = squares
    checker.inputs["Color1"].default_value = (0.4 + contrast / 2,) * 3 + (1,)
    checker.inputs["Color2"].default_value = (0.4 - contrast / 2,) * 3 + (1,)
    link(place.outputs["UV"], checker.inputs["Vector"])
    link(checker.outputs["Color"], matte.inputs["Color"])
    surface(material, matte)
    return add_plane(bpy, material=material)


def picture(exported):
    """The picture of the plane's reflectance."""
    scene = exported.scene
    return scene.materials[scene.material[0]].reflectance


def color_error(exported, squares: float, contrast: float) -> float:
    """RMS error of the picture at places of the plane, local, with the floor at a quarter of the mean."""
    places = np.random.default_rng(0).random((4000, 2)) / 2
    found = evaluate_material(exported.scene, "reflectance", np.zeros(len(places), int), places)[:, 0]
    corners = exported.scene.vertices[exported.scene.triangles[0]][:, :2] / 2 + 0.5
    points = corners[0] + places[:, :1] * (corners[1] - corners[0]) + places[:, 1:] * (corners[2] - corners[0])
    even = np.floor(points * squares).astype(int).sum(axis=1) % 2 == 0
    expected = 0.4 + np.where(even, -contrast / 2, contrast / 2)
    return float(np.sqrt(np.mean(((found - expected) / np.maximum(expected, 0.1)) ** 2)))


def test_pictures_are_as_fine_as_what_they_show(blender, export):
    """Squares of half a percent of contrast need few texels. Sharp ones get what the image can show, also in an image
    of 400²; what stays is estimated within a factor of 1.7, and a warning has it where it is more than the error
    asked for."""
    plain = checkered(blender, 37.0, 0.002)
    assert picture(export(target="image", uv_map="UV", resolution=400)).pixels.shape == (512, 512, 3)
    blender.data.objects.remove(plain)
    checkered(blender, 37.0, 0.6)
    few, many = (export(target="image", uv_map="UV", resolution=size) for size in (128, 400))
    assert picture(many).pixels.shape[0] > picture(few).pixels.shape[0] >= 512
    (said,) = (text for text in many.warnings if "Checkered" in text)
    percent = float(said.split("about ")[1].split(" %")[0])
    off = color_error(many, 37.0, 0.6)
    assert off < 0.75 * color_error(few, 37.0, 0.6)
    assert off / 1.7 < percent / 100 < 1.7 * off
    light = export(target="image", uv_map="UV", resolution=128, passes=("direct", "indirect"))
    assert not any("Checkered" in text for text in (*light.warnings, *export(target="vertex").warnings))
