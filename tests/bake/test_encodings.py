"""Encodings: each value comes back within what its bits allow, its mean exactly."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from radiosity_addon.bake.encodings import (
    coding_error,
    decode,
    encode,
    encoding_scale,
    share_above,
    to_srgb,
)  # fmt: skip
from radiosity_addon.bake.png import png_bytes
from radiosity_addon.solver.fields import srgb_to_linear

RAMP = np.geomspace(1e-3, 50, 3000).reshape(-1, 3)


def test_the_srgb_curve_and_its_inverse():
    """IEC 61966-2-1: 0.5 in codes is 0.2140 in light; 0.0031308 · 12.92 = 0.04045."""
    assert srgb_to_linear(np.array(0.5)) == pytest.approx(0.21404, abs=1e-5)
    assert to_srgb(np.array(0.0031308)) == pytest.approx(0.04045, abs=1e-5)
    line = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(srgb_to_linear(to_srgb(line)), line, atol=1e-7)


@pytest.mark.parametrize("kind", ["png", "png16"])
def test_codes_are_next_to_the_value(kind):
    """Dithering takes one of the two codes around the value: less than one code away."""
    codes = encode(RAMP, kind, 50.0)
    most = {"png": 255, "png16": 65535}[kind]
    assert codes.dtype == {"png": np.uint8, "png16": np.uint16}[kind]
    assert np.abs(codes - to_srgb(RAMP / 50) * most).max() < 1


@pytest.mark.parametrize("kind", ["rgbm", "rgbe", "hdr", "linear"])
def test_values_come_back(kind):
    """RGBE, HDR: rgb in [½, 1] for the brightest channel, one step of 1/255: within 2/255 of it.
    Linear and RGBM: the step of light is at most scale/255; of RGBM with the multiplier m it is
    scale m/255, m at most one step of 1/255 above the brightest channel over the scale."""
    scale = encoding_scale([RAMP], kind, 0)
    back = decode(encode(RAMP, kind, scale), kind, scale)
    bright = RAMP.max(1, keepdims=True)
    limits = {"rgbe": bright * 2 / 255, "hdr": bright * 2 / 255, "linear": 50 / 255,
              "rgbm": (bright + 50 / 255) / 255}  # fmt: skip
    assert (np.abs(back - RAMP) <= limits[kind] * (1 + 1e-9)).all()


def test_dithering_keeps_the_mean():
    """10⁵ linear values between two codes: the mean is off by its standard error, at most
    half a code / √10⁵; five of them are allowed. Without dithering it were off by 0.3 codes."""
    codes = encode(np.full((100_000, 3), 100.3 / 255), "linear", 1.0)
    assert set(np.unique(codes)) == {100, 101}
    assert abs(codes.mean() - 100.3) < 5 * 0.5 / np.sqrt(100_000)


@pytest.mark.parametrize("kind", ["rgbe", "hdr"])
def test_a_shared_exponent_keeps_the_mean(kind):
    """A step is at most 2/255 of the brightest channel, so that the mean of 3000 has a standard error of 1/255 / √3000, 7e-5
    of it at most; five of them are allowed. Mantissas that are cut off, as Blender's, lack half a step, 0.6 %."""
    gray = np.geomspace(1e-3, 50, 3000)[:, None].repeat(3, 1)
    back = decode(encode(gray, kind, 1.0), kind, 1.0)
    assert abs((back / gray).mean() - 1) < 5 / 255 / np.sqrt(3000)


def test_exact_codes_stay_and_the_seed_decides():
    exact = np.arange(256)[:, None].repeat(3, 1) / 255
    np.testing.assert_array_equal(encode(exact, "linear", 1.0)[:, 0], np.arange(256))
    np.testing.assert_array_equal(encode(RAMP, "png", 50.0), encode(RAMP, "png", 50.0))


def test_scales():
    colors = [np.full((2, 3), 3.0), np.full((1, 3), 8.0)]
    assert encoding_scale(colors, "png", None) == 1
    assert encoding_scale(colors, "png", 0) == 8
    assert encoding_scale(colors, "rgbm", None) == 8
    assert encoding_scale(colors, "rgbe", 2.0) == encoding_scale(colors, "hdr", 2.0) == 1
    assert encoding_scale([], "png", 0) > 0


def test_the_share_that_is_cut():
    """One channel above is enough; one of four rows has one."""
    rows = np.array([[1, 1, 1], [0.2, 1.5, 0], [0, 0, 0], [0.5, 0.5, 0.5]])
    assert share_above(rows, 1.0) == 0.25


def test_the_error_of_what_is_cut():
    """Light 4 shown as 1 beside light 1 shown right: errors 3/4 and 0, mean square (9/16)/2."""
    rows, shown = np.array([[4.0] * 3, [1.0] * 3]), np.array([[1.0] * 3, [1.0] * 3])
    assert coding_error(rows, shown) == pytest.approx(np.sqrt(9 / 32))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [3, 4])
def test_png_holds_the_codes(kind, channels):
    """Read back by hand: signature, IHDR, and rows from the top, each after a filter byte of 0."""
    most = np.iinfo(kind).max
    codes = np.random.default_rng(1).integers(0, most, (5, 7, channels), kind, endpoint=True)
    data = png_bytes(codes, srgb=True)
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[24] == 8 * codes.itemsize
    start = data.index(b"IDAT")
    size = int.from_bytes(data[start - 4 : start], "big")
    raw = np.frombuffer(zlib.decompress(data[start + 4 : start + 4 + size]), np.uint8)
    rows = raw.reshape(5, -1)
    assert not rows[:, 0].any()
    big = np.dtype(kind).newbyteorder(">")
    found = np.ascontiguousarray(rows[:, 1:]).view(big).reshape(codes.shape)
    np.testing.assert_array_equal(found[::-1], codes)
