"""The image in the .blend and the files of it, read back."""

from __future__ import annotations

import os

import numpy as np
import pytest

from radiosity_addon.bake.encodings import decode, encode
from radiosity_addon.bake.image import file_names, save_encoded, save_image, write_image


def pattern(height=4, width=6):
    """Values no 8 bits hold: up to 3.7, and a margin row with color but alpha 0."""
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., 0] = np.linspace(0, 3.7, width)
    pixels[..., 1] = np.linspace(0, 1, height)[:, None]
    pixels[..., 2] = 0.25
    pixels[-1, :, 3] = 0
    return pixels


def read(image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def save(image, path, kind) -> None:
    """As the bake does: PNG and HDR files are ours, OpenEXR Blender's."""
    if kind == "exr":
        save_image(image, path)
    else:
        save_encoded(read(image), path, kind, 1.0)


def load(blender, path):
    image = blender.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    return image


def test_image_survives_saving_although_nothing_uses_it(blender, tmp_path):
    image = write_image("Radiosity_Cube", pattern())
    assert image.is_float and np.array_equal(read(image), pattern())
    path = str(tmp_path / "scene.blend")
    blender.ops.wm.save_as_mainfile(filepath=path)
    blender.ops.wm.open_mainfile(filepath=path)
    image = blender.data.images["Radiosity_Cube"]
    assert image.packed_file and image.alpha_mode == "CHANNEL_PACKED"
    assert read(image) == pytest.approx(pattern(), rel=1e-6)


def test_baking_again_updates_the_same_image(blender):
    first = write_image("Radiosity_Cube", pattern())
    again = write_image("Radiosity_Cube", pattern() * 2)
    assert again == first and len(blender.data.images) == 1
    assert np.array_equal(read(again), pattern() * 2)


def test_freed_pixels_are_read_again_as_they_were(blender, tmp_path):
    """The same 32 bits, margin with alpha 0 included; baked again, saved and opened, too. Constant
    rows and columns compress to less than half of 16 bytes a texel."""
    pixels = pattern(64, 96)
    image = write_image("Radiosity_Cube", pixels, frees=True)
    assert not image.has_data
    assert image.packed_file.size < 8 * 64 * 96
    assert np.array_equal(read(image), pixels)
    assert write_image("Radiosity_Cube", 2 * pixels, frees=True) == image
    assert np.array_equal(read(image), 2 * pixels)
    assert image.is_float and image.alpha_mode == "CHANNEL_PACKED"
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert np.array_equal(read(blender.data.images["Radiosity_Cube"]), 2 * pixels)
    assert write_image("Radiosity_Cube", pixels).packed_file
    assert np.array_equal(read(blender.data.images["Radiosity_Cube"]), pixels)


def test_another_size_takes_the_place_of_the_old_one(blender):
    material = blender.data.materials.new("Shown")
    if blender.app.version < (5, 0, 0):
        material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = write_image("Radiosity_Cube", pattern())
    write_image("Radiosity_Cube", pattern(16, 16))
    assert [image.name for image in blender.data.images] == ["Radiosity_Cube"]
    assert tuple(node.image.size) == (16, 16)
    assert np.array_equal(read(node.image), pattern(16, 16))


def test_the_users_image_of_that_name_stays(blender):
    mine = blender.data.images.new("Radiosity_Cube", 2, 2)
    baked = write_image("Radiosity_Cube", pattern())
    assert mine.name == "Radiosity_Cube" and tuple(mine.size) == (2, 2)
    assert write_image("Radiosity_Cube", pattern()) == baked
    assert len(blender.data.images) == 2


@pytest.mark.parametrize("kind", ["exr", "png", "hdr"])
def test_files_hold_the_values(blender, tmp_path, kind):
    """EXR float32 exactly; HDR 256ths of the power of two above the brightest channel; PNG 8 bits sRGB:
    1.055 x^(1/2.4) − 0.055 above 0.0031308, cut at 1; dithered, so one of the two codes next to
    the value: less than one code off."""
    path = tmp_path / f"image.{kind}"
    scenes = len(blender.data.scenes)
    save(write_image("Radiosity_Cube", pattern()), path, kind)
    result, wanted = read(load(blender, path)), pattern()
    if kind == "png":
        linear = wanted[..., :3]
        encoded = np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)
        wanted[..., :3] = np.clip(encoded, 0, 1)
    tolerance = {"exr": 0, "png": 1.0 / 255, "hdr": 4 / 256}[kind]
    channels = 3 if kind == "hdr" else 4
    assert np.abs(result - wanted)[..., :channels].max() <= tolerance
    assert os.listdir(tmp_path) == [path.name] and len(blender.data.scenes) == scenes


@pytest.mark.parametrize("width", [5, 8, 300])
def test_hdr_files_hold_the_codes(blender, tmp_path, width):
    """Told flat, in one run and in three: Blender reads what the codes stand for."""
    values = np.random.default_rng(1).lognormal(0, 4, (3, width, 4)).astype(np.float32)
    save_encoded(values, tmp_path / "image.hdr", "hdr", 1.0)
    codes = encode(values[..., :3], "hdr", 1.0)
    result = read(load(blender, tmp_path / "image.hdr"))[..., :3]
    np.testing.assert_array_equal(result, decode(codes, "hdr", 1.0).astype(np.float32))


def test_png_has_eight_bits(blender, tmp_path):
    path = tmp_path / "image.png"
    save_encoded(pattern(), path, "png", 1.0)
    assert path.read_bytes()[24] == 8  # bit depth in the IHDR chunk


def test_a_file_is_replaced_whole(blender, tmp_path):
    path = tmp_path / "image.exr"
    path.write_text("old")
    save_image(write_image("Radiosity_Cube", pattern()), path)
    assert read(load(blender, path)) == pytest.approx(pattern())


def test_missing_folder_is_named(blender, tmp_path):
    image = write_image("Radiosity_Cube", pattern())
    with pytest.raises(OSError, match=r"missing does not exist; create it"):
        save_image(image, tmp_path / "missing" / "image.exr")
    assert not (tmp_path / "missing").exists()


@pytest.mark.parametrize("kind", ["exr", "png", "hdr"])
def test_a_folder_that_takes_no_file(blender, kind):
    """/proc refuses new files to everyone, the superuser included, as a full disk would."""
    if not os.path.isdir("/proc/self"):
        pytest.skip("needs a /proc")
    image = write_image("Radiosity_Cube", pattern())
    scenes = len(blender.data.scenes)
    with pytest.raises(OSError, match="/proc takes no image"):
        save(image, f"/proc/image.{kind}", kind)
    assert len(blender.data.scenes) == scenes


def test_file_names_are_safe_and_unique():
    names = ["R_a/b", "R_a\\b", "r_A_B", "nul", "R_lamp.", "Ö" * 300, ""]
    files = file_names(names, "png")
    assert files[:5] == ["R_a_b.png", "R_a_b_1.png", "r_A_B_2.png", "_nul.png", "R_lamp.png"]
    assert len(files[5].encode()) <= 255 and files[6] == "_.png"
    assert len({name.casefold() for name in files}) == len(names)


def test_an_emission_shader_shows_the_value_margin_included(blender):
    """Cycles reads the image back through Image Texture → Emission of strength 1."""
    pixels = pattern(4, 4)
    blender.ops.mesh.primitive_plane_add()
    obj = blender.context.object
    material = blender.data.materials.new("Shown")
    if blender.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    kinds = ("ShaderNodeTexImage", "ShaderNodeEmission", "ShaderNodeOutputMaterial")
    texture, emission, output = (tree.nodes.new(kind) for kind in kinds)
    texture.image, texture.interpolation = write_image("Radiosity_Plane", pixels), "Closest"
    tree.links.new(texture.outputs[0], emission.inputs[0])
    tree.links.new(emission.outputs[0], output.inputs[0])
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = blender.data.images.new("seen", 4, 4, float_buffer=True)
    tree.nodes.active = target
    obj.data.materials.append(material)
    scene = blender.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    blender.ops.object.bake(type="EMIT", margin=0)
    assert read(target.image)[..., :3] == pytest.approx(pixels[..., :3], abs=1e-5)
