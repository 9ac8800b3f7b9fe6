"""Islands and their margin."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.dilate import dilated


def image_of(*arguments):
    """The image that ``extended`` makes of these."""
    return dilated(*arguments)[0]


def two_islands():
    """Columns 2-3 hold 1, columns 9-10 hold 2, in a 6 × 14 image."""
    pixels, covered = np.zeros((6, 14, 3), np.float32), np.zeros((6, 14), bool)
    pixels[:, 2:4], pixels[:, 9:11] = 1, 2
    covered[:, 2:4] = covered[:, 9:11] = True
    return pixels, covered


def test_margin_takes_the_nearest_island():
    image = image_of(*two_islands(), 2)
    assert image[3, :, 0].tolist() == [1, 1, 1, 1, 1, 1, 0, 2, 2, 2, 2, 2, 2, 0]


def test_islands_do_not_bleed_into_each_other():
    pixels, covered = two_islands()
    image = image_of(pixels, covered, 100)
    assert np.array_equal(image[covered][:, :3], pixels[covered])
    assert image[3, :, 0].tolist() == [1] * 6 + [image[3, 6, 0]] + [2] * 7  # 6 is halfway


def test_alpha_says_which_texels_belong_to_a_face():
    pixels, covered = two_islands()
    assert np.array_equal(image_of(pixels, covered, 2)[..., 3], covered.astype(np.float32))


def test_margin_is_round():
    covered = np.zeros((9, 9), bool)
    covered[4, 4] = True
    image = image_of(np.ones((9, 9, 3), np.float32), covered, 3)
    y, x = np.mgrid[:9, :9] - 4
    assert np.array_equal(image[..., 0] == 1, x**2 + y**2 <= 9)


@pytest.mark.parametrize("fill", [False, True])
def test_nothing_or_everything_covered(fill):
    image = image_of(np.full((4, 4, 3), 0.5), np.full((4, 4), fill), 2)
    assert (image[..., :3] == 0.5 * fill).all() and (image[..., 3] == fill).all()


def test_what_is_not_covered_does_not_matter():
    pixels, covered = two_islands()
    pixels[~covered] = np.nan
    assert np.isfinite(image_of(pixels, covered, 1)).all()


def test_bad_input():
    pixels, covered = two_islands()
    with pytest.raises(ValueError, match="margin is -1"):
        image_of(pixels, covered, -1)
    with pytest.raises(ValueError, match="must be"):
        image_of(pixels, covered[1:], 1)


def test_bands_give_the_same_image():
    """Bands of 4 rows and of the margin's 3, in place of all 40 at once: the nearest covered texel of each
    texel is as near, and where only one is, the same."""
    from scipy.ndimage import distance_transform_edt

    random = np.random.default_rng(1)
    covered = random.random((40, 50)) < 0.02
    row, column = np.mgrid[:40, :50]
    pixels = np.stack([row, column, covered], -1).astype(np.float32)
    whole = image_of(pixels, covered, 3)
    for texels in (200, 1):
        image = image_of(pixels, covered, 3, texels)
        filled = image[..., 2] > 0
        assert np.array_equal(filled, whole[..., 2] > 0)
        apart = np.hypot(image[..., 0] - row, image[..., 1] - column)
        assert np.allclose(apart[filled], distance_transform_edt(~covered)[filled])
