"""Pictures in node trees: pixels, places and encodings, against Cycles' own bakes."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.solver.fields import srgb_to_linear
from radiosity_addon.solver.materials.evaluate import evaluate_material
from tests.export.scene_building import (
    add_image,
    add_material,
    add_plane,
    cycles_bake,
    image_material,
    material_of,
    surface,
    value_at,
)


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
    """Every texel of an image of random colors, on both triangles."""
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
            # The plane spans [-1, 1]²; texel (i, j) has its center at ((j + ½)/2 - 1, ...).
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


@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_cut_out_of_a_clipped_image(blender, export, interpolation):
    """A leaf: its image's alpha mixes matte and transparent; beyond the image all is transparent. It is read as it
    is, with a border of a texel, and lets through what Cycles' bake of that alpha, as emission, lacks to 1."""
    pixels = np.ones((8, 4, 4))
    pixels[..., 3] = np.random.default_rng(1).random((8, 4))
    image = add_image(blender, pixels, alpha_mode="CHANNEL_PACKED", floats=True)
    glowing = image_material(blender, image, uv="Leaf", alpha=True, extension="CLIP")
    picture = next(node for node in glowing.node_tree.nodes if node.bl_idname == "ShaderNodeTexImage")
    picture.interpolation = interpolation
    glowing.node_tree.links.remove(picture.outputs["Color"].links[0])
    plane = add_plane(blender, material=glowing)
    leaf = plane.data.uv_layers.new(name="Leaf")
    leaf.uv.foreach_set("vector", [-0.5, -0.5, 1.5, -0.5, 1.5, 1.5, -0.5, 1.5])
    size = 32
    alpha = cycles_bake(blender, plane, "EMIT", (), size=size, samples=1)[..., 0]
    tree = glowing.node_tree
    mix, clear, matte = (
        tree.nodes.new(f"ShaderNode{name}") for name in ("MixShader", "BsdfTransparent", "BsdfDiffuse")
    )
    for start, end in ((picture.outputs["Alpha"], mix.inputs[0]), (clear.outputs[0], mix.inputs[1]),
                       (matte.outputs[0], mix.inputs[2])):  # fmt: skip
        tree.links.new(start, end)
    surface(glowing, mix)
    scene = export().scene
    assert material_of(export()).transmittance.pixels.shape == (10, 6, 3)
    middles = (np.arange(size) + 0.5) / size
    for triangle, corners in enumerate(scene.triangles[:2]):
        corner = scene.vertices[corners][:, :2] / 2 + 0.5
        edges = np.stack([corner[1] - corner[0], corner[2] - corner[0]], 1)
        x, y = np.meshgrid(middles, middles)
        places = np.linalg.solve(edges, np.stack([x.ravel(), y.ravel()]) - corner[0][:, None]).T
        inside = np.flatnonzero((places > 0.01).all(axis=1) & (places.sum(axis=1) < 0.99))
        found = evaluate_material(scene, "transmittance", np.full(len(inside), triangle), places[inside])
        expected = 1 - alpha.ravel()[inside]
        np.testing.assert_allclose(found[:, 0], expected, atol=1e-3)
        assert len(inside) > 300 and (expected == 1).any() and (expected < 0.5).any()


def test_missing_image_is_pink_with_a_warning(blender, export):
    image = blender.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", "//nowhere/lost.png"
    add_plane(blender, material=image_material(blender, image, shader="ShaderNodeBsdfDiffuse"))
    exported = export()
    np.testing.assert_allclose(material_of(exported).reflectance.value, (1, 0, 1))
    assert any('"Lost"' in w and '"Material"' in w for w in exported.warnings)


def test_srgb_curve():
    # IEC 61966-2-1: linear below 0.04045, and 0.5 -> ((0.5 + 0.055) / 1.055)^2.4.
    np.testing.assert_allclose(
        srgb_to_linear([0, 0.04045, 0.5, 1]), [0, 0.04045 / 12.92, (0.555 / 1.055) ** 2.4, 1],
        rtol=1e-5,
    )  # fmt: skip


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


def test_each_part_of_a_tiled_image_is_where_its_uvs_are(blender, export, tmp_path):
    """A UDIM image: red on the tile of one plane, green on that of the other."""
    for number, color in ((1001, (1, 0, 0, 1)), (1002, (0, 1, 0, 1))):
        part = add_image(blender, np.full((4, 4, 4), color), "Non-Color")
        part.filepath_raw, part.file_format = str(tmp_path / f"part.{number}.png"), "PNG"
        part.save()
    image = blender.data.images.load(str(tmp_path / "part.1001.png"))
    image.source, image.filepath = "TILED", str(tmp_path / "part.<UDIM>.png")
    image.colorspace_settings.name = "Non-Color"
    image.tiles.new(1002)
    material = image_material(blender, image)
    add_plane(blender, "A", material=material)
    moved = add_plane(blender, "B", material=material)
    for each in moved.data.uv_layers[0].data:
        each.uv.x += 1
    exported = export()
    for triangle, color in ((0, (1, 0, 0)), (2, (0, 1, 0))):
        field = exported.scene.materials[exported.scene.material[triangle]].emission
        np.testing.assert_allclose(value_at(field, triangle, 0.3, 0.3), color, atol=1e-3)
