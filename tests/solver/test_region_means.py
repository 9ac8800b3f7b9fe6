"""Exact means of pictures: over rectangles by hand, over parts that add up, over receivers."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import CornerColors, Texture, srgb_to_linear
from radiosity_addon.solver.materials.evaluate import evaluate_field
from radiosity_addon.solver.materials.region_means import FieldMeans, Regions, triangle_regions
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import Material, Scene
from radiosity_addon.solver.sequence import solve

# Barycentric (u, v) are the UV themselves: corners (0, 0), (1, 0) and (0, 1).
SAME = np.array([[[0, 0], [1, 0], [0, 1]]], np.float32)
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")
PIXELS = np.random.default_rng(3).random((5, 7, 3)).astype(np.float32) ** 2


def picture(pixels=PIXELS, **options) -> Texture:
    return Texture(np.asarray(pixels, np.float32), SAME, **options)


def unfolded(extension: str, pixels: np.ndarray) -> np.ndarray:
    """(3 h, 3 w, 3) the picture with one more on every side, as its extension has it."""
    h, w = pixels.shape[:2]
    mode = {"REPEAT": "wrap", "EXTEND": "edge", "CLIP": "constant", "MIRROR": "symmetric"}
    return np.pad(pixels.astype(float), ((h, h), (w, w), (0, 0)), mode[extension])


def shares(low: float, high: float, size: int, linear: bool) -> np.ndarray:
    """(3 size,) the integral from ``low`` to ``high``, in texels, of each texel's weight: 1 in its
    own, or the hat function around its middle, whose integral is a parabola on either side."""
    middle = np.arange(3 * size) - size + 0.5

    def until(x):
        away = x - middle
        if not linear:
            return np.clip(away + 0.5, 0, 1)
        t = np.clip(away, -1, 1)
        return np.where(t < 0, (1 + t) ** 2 / 2, 1 - (1 - t) ** 2 / 2)

    return until(high) - until(low)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_mean_over_a_rectangle(extension, interpolation):
    """The integral over a rectangle is Σ rows Σ columns of weight · weight · texel: exact to
    rounding, inside of the picture, across its edges and beside it."""
    field = picture(extension=extension, interpolation=interpolation, factor=2.0)
    boxes = np.array([[0.13, 0.21, 0.55, 0.83], [-0.4, -0.3, 0.2, 0.9], [0.7, 0.6, 1.6, 1.45],
                      [-0.8, 0.2, 1.7, 0.3], [1.2, 1.1, 1.3, 1.15]])  # fmt: skip
    origin, size = boxes[:, :2], boxes[:, 2:] - boxes[:, :2]
    zero = np.zeros(len(boxes))
    u, v = np.stack([size[:, 0], zero], 1), np.stack([zero, size[:, 1]], 1)
    found, _ = FieldMeans(field)(Regions(np.zeros(len(boxes), int), origin, u, v, True))
    all_texels = unfolded(extension, PIXELS)
    for box, mean in zip(boxes, found):
        x = shares(box[0] * 7, box[2] * 7, 7, interpolation == "Linear")
        y = shares(box[1] * 5, box[3] * 5, 5, interpolation == "Linear")
        truth = 2 * np.einsum("r,c,rcd->d", y, x, all_texels) / ((box[2] - box[0]) * 7)
        np.testing.assert_allclose(mean, truth / ((box[3] - box[1]) * 5), rtol=1e-9)


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_a_triangle_is_the_mean_of_its_quarters(extension, interpolation):
    """Integrals add up: the mean over any triangle is that of its quarters, over a parallelogram
    that of its two triangles. And 400² places in it agree, whose error is that of the border."""
    field = picture(extension=extension, interpolation=interpolation)
    means, rng = FieldMeans(field), np.random.default_rng(5)
    o, u, v = rng.uniform(-1, 1, (3, 20, 2))
    zero = np.zeros(20, int)
    whole, _ = means(Regions(zero, o, u, v, False))
    starts = (o, u / 2, v / 2), (o + u / 2, u / 2, v / 2), (o + v / 2, u / 2, v / 2)
    starts += ((o + (u + v) / 2, -u / 2, -v / 2),)
    quarters = np.mean([means(Regions(zero, *s, False))[0] for s in starts], axis=0)
    np.testing.assert_allclose(quarters, whole, rtol=1e-9, atol=1e-12)
    both, _ = means(Regions(zero, o, u, v, True))
    other, _ = means(Regions(zero, o + u + v, -u, -v, False))
    np.testing.assert_allclose((whole + other) / 2, both, rtol=1e-9, atol=1e-12)
    step = (np.arange(400) + 0.5) / 400
    s, t = (axis.ravel()[:, None] for axis in np.meshgrid(step, step))
    for k in range(3):
        seen = evaluate_field(field, np.zeros(len(s), int), o[k] + s * u[k] + t * v[k]).mean(axis=0)
        np.testing.assert_allclose(both[k], seen, atol=2e-3)


def test_picture_decoded_after_interpolation():
    """Half black, half white, 2 texels, sRGB, bilinear: on the half between the middles the mean is
    ∫ decode(t) dt over [0, 1]: t²/25.84 to 0.04045, then 1.055/3.4 ((t + 0.055)/1.055)^3.4, which
    is 0.298; pixels that are decoded before would give 0.5."""
    field = picture([[[0] * 3, [1] * 3]], extension="EXTEND", encoded=True)
    o, u, v = (np.array([place]) for place in ((0.25, 0), (0.5, 0), (0, 1)))
    found, _ = FieldMeans(field)(Regions(np.zeros(1, int), o, u, v, True))
    bend = 0.04045
    truth = bend**2 / 25.84 + 1.055 / 3.4 * (1 - ((bend + 0.055) / 1.055) ** 3.4)
    np.testing.assert_allclose(found, truth, rtol=1e-3)
    assert srgb_to_linear(np.array([0.5]))[0] < 0.25


@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_a_point_and_a_line_of_a_picture(interpolation):
    """A palette: all three corners at one UV show one color; on a line the mean along it. Along a
    row the barycentric triangle weighs linearly from its base (two corners) to its tip."""
    uv = np.array([[[0.3, 0.3]] * 3, [[0, 0.5], [0, 0.5], [1, 0.5]]], np.float32)
    field = Texture(np.array([[[0] * 3, [1] * 3]], np.float32), uv, "EXTEND", interpolation)
    whole = np.repeat([[[0.0, 0], [1, 0], [0, 1]]], 2, axis=0)
    found, spread = FieldMeans(field)(triangle_regions(np.arange(2), whole))
    point = 0.0 if interpolation == "Closest" else 0.1  # 0.3 · 2 − 0.5 of the way
    np.testing.assert_allclose(found[0], point, atol=1e-6)
    assert spread[0] == 0
    # Density 2 (1 − x). White from 1/2 on: 1/4. Rising as 2x − 1/2 from 1/4 to 3/4, then white:
    # [5x²/2 − x − 4x³/3] = 10/48 between, and (1/4)² = 3/48 behind.
    line = 0.25 if interpolation == "Closest" else 13 / 48
    np.testing.assert_allclose(found[1], line, rtol=5e-3)


def test_corner_colors():
    """Linear: the value at the middle, and the standard deviation of 0, 0, 1 linear between: the
    integral of u² less that of u, squared: 1/6 − 1/9."""
    field = CornerColors(np.array([[[0] * 3, [1] * 3, [0] * 3]], np.float32))
    whole = np.array([[[0.0, 0], [1, 0], [0, 1]]])
    found, spread = FieldMeans(field)(triangle_regions(np.zeros(1, int), whole))
    np.testing.assert_allclose(found, 1 / 3)
    np.testing.assert_allclose(spread, np.sqrt(1 / 18))


def test_receivers_reflect_the_mean_of_their_pictures():
    """A triangle that is one receiver shows 64² random texels below the diagonal, half of those on
    it: reflectance and emission are their means, to float32, whatever lies between."""
    pixels = np.random.default_rng(0).random((64, 64, 3)).astype(np.float32) ** 4
    field = Texture(pixels, np.array([[[0, 0], [1, 0], [1, 1]]], np.float32), "EXTEND", "Closest")
    scene = Scene(
        np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.array([[0, 1, 2]], np.int32),
        np.zeros(1, np.int32), np.zeros(1, np.int32), (Material("m", field, field),), ("o",),
    )  # fmt: skip
    corners = np.array([[[0.0, 0], [1, 0], [0, 1]]])
    one = np.zeros(1, np.int32)
    found = solve(scene, Receivers(1, one, one, corners, np.zeros(1, bool)), Settings(error=0.1))
    row, column = np.indices((64, 64))
    weight = (column > row) + 0.5 * (column == row)
    truth = np.einsum("rc,rcd->d", weight, pixels.astype(float)) / (64 * 64 / 2)
    np.testing.assert_allclose(found.diffuse[0], truth, rtol=1e-5)
    np.testing.assert_allclose(found.emission[0], truth, rtol=1e-5)
