"""Encodings end to end: what is cut is told, scales are stored, and engines read the light back."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon.bake.encodings import decode  # noqa: E402
from radiosity_addon.figures import percent  # noqa: E402
from tests.one_core import FAST, main  # noqa: E402


def bake(room, tmp_path, *options):
    """(exit status, report); the room's lamp of 100 W makes values above 1."""
    report = tmp_path / "r.json"
    status = main([str(room), *FAST, "--resolution", "64", "--output",
                   str(tmp_path / "o.blend"), "--report", str(report), *options])  # fmt: skip
    return status, json.loads(report.read_text()) if status == 0 else None


def opened(blender, tmp_path):
    blender.ops.wm.open_mainfile(filepath=str(tmp_path / "o.blend"))


def floats(blender, image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


@pytest.mark.parametrize("kind", ["png", "png16", "rgbm", "rgbe"])
@pytest.mark.parametrize("scale", ["auto", None])
def test_files_hold_the_light(blender, room, tmp_path, kind, scale):
    """With a scale the file decodes to the image in the .blend within its bits; without one a
    PNG is cut at 1, the share of such texels is told, and the report's error is larger."""
    options = ["--scale", scale] if scale and kind != "rgbe" else []
    status, report = bake(room, tmp_path, "--target", "image", "--format", kind, "--image-dir",
                          str(tmp_path), *options)  # fmt: skip
    assert status == 0
    opened(blender, tmp_path)
    light = floats(blender, blender.data.images["Radiosity_Box"])
    on = light[..., 3] > 0
    file = blender.data.images.load(str(tmp_path / "Radiosity_Box.png"))
    file.colorspace_settings.name, file.alpha_mode = "Non-Color", "CHANNEL_PACKED"
    most = 65535 if kind == "png16" else 255
    codes = np.rint(floats(blender, file) * most)
    rgb = light[..., :3][on]
    stored = blender.data.images["Radiosity_Box"]["Radiosity_scale"]
    assert stored == report["scale"]
    back = decode(codes if kind in ("rgbm", "rgbe") else codes[..., :3], kind, stored)[on]
    told = [text for text in report["warnings"] if "are cut" in text]
    share = (rgb.max(1) > 1).mean()
    if kind.startswith("png") and scale is None:
        assert share > 0.01 and stored == 1 and back.max() <= 1
        assert len(told) == 1 and f"{percent(share)} of the texels lie above 1 " in told[0]
        assert report["encoded_error"] > report["estimated_error"]
    else:
        assert not told
        # An sRGB code near 1 is 1/most of 2.4 · light at most wide; RGBM's step is twice that of
        # 8 bits in the worst case, RGBE's 2/255 of the brightest channel.
        bright = np.maximum(rgb.max(1, keepdims=True), stored / 255)
        limit = 2.6 * stored / most if kind.startswith("png") else bright * 2.1 / 255
        assert (np.abs(back - rgb) <= limit).all()


def test_byte_colors_cut_without_a_scale_and_hold_the_light_with_one(blender, room, tmp_path):
    """BYTE_COLOR: sRGB codes of light / scale, next to the value: one code is at most
    2.4 · 1.055 / 255 of the scale wide near white."""
    light = ("--passes", "direct")
    assert bake(room, tmp_path, *light)[0] == 0
    opened(blender, tmp_path)
    truth = colors(blender)
    assert truth.max() > 1
    status, report = bake(room, tmp_path, *light, "--color-type", "byte")
    opened(blender, tmp_path)
    assert colors(blender).max() == pytest.approx(1) and report["scale"] == 1
    assert any("color attribute" in text and "% of the colors" in text
               for text in report["warnings"])  # fmt: skip
    status, report = bake(room, tmp_path, *light, "--color-type", "byte", "--scale", "auto")
    opened(blender, tmp_path)
    mesh = blender.data.objects["Box"].data
    assert mesh.color_attributes["Radiosity"].data_type == "BYTE_COLOR"
    scale = mesh["Radiosity_scale"]
    assert scale == report["scale"] == pytest.approx(float(truth.max()), rel=1e-6)
    assert np.abs(colors(blender) * scale - truth).max() <= 2.6 * scale / 255
    assert not any("are cut" in text for text in report["warnings"])


def test_floats_have_no_scale_and_no_error_of_encoding(blender, room, tmp_path):
    _, report = bake(room, tmp_path)
    assert report["encoded_error"] == report["estimated_error"] and report["scale"] == 1
    opened(blender, tmp_path)
    assert "Radiosity_scale" not in blender.data.objects["Box"].data


@pytest.mark.parametrize("words, hint", [
    (["--scale", "0"], "above 0, or auto"),
    (["--scale", "2"], "--scale is for"),
    (["--color-type", "byte", "--target", "image"], "--color-type is for vertex"),
])  # fmt: skip
def test_wrong_usage(words, hint, capfd):
    assert main(["scene.blend", *words]) == 2
    assert hint in capfd.readouterr().err


def colors(blender) -> np.ndarray:
    data = blender.data.objects["Box"].data.color_attributes["Radiosity"].data
    rows = np.empty(4 * len(data), np.float32)
    data.foreach_get("color", rows)
    return rows.reshape(-1, 4)[:, :3].astype(float)
