"""Encoding of many colors: looked at in bands, told as of all at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.encodings import coding_error, decode, encode
from radiosity_addon.bake_job import Job, Result
from radiosity_addon.settings import Settings
from radiosity_addon.solver.solution import Statistics
from radiosity_addon.stages.encode import encoding_of


def result_of(sizes) -> tuple[Result, np.ndarray]:
    """Images of these sizes with random colors, every third texel of no face, and the colors (n, 3)."""
    random = np.random.default_rng(2)
    images = [(2 * random.random((*size, 4))).astype(np.float32) for size in sizes]
    for image in images:
        image[..., 3] = (np.arange(image[..., 3].size).reshape(image.shape[:2]) % 3) > 0
    every = np.concatenate([image[image[..., 3] > 0][:, :3].astype(float) for image in images])
    return Result(tuple(images), Statistics(), ()), every


@pytest.mark.parametrize("band", [64, 1 << 23])
def test_bands_tell_what_all_colors_together_do(band):
    """The brightest, the share above 1, and the error of every third color, as 4,000 are judged."""
    result, every = result_of([(60, 70), (40, 100), (90, 90)])
    settings = Settings(target="image", image_dir="x", format="png", scale=0.0)
    job = Job(settings, None, (), (), (), ())
    found = encoding_of(job, result, np.eye(3), 4000, band)
    assert found.scale == every.max()
    judged = every[:: 1 + len(every) // 4000]
    again = decode(encode(judged, "png", found.scale), "png", found.scale)
    assert found.error == pytest.approx(coding_error(judged, again), rel=1e-12)
    one = encoding_of(
        replace(job, settings=replace(settings, scale=1.0)), result, np.eye(3), 4000, band
    )
    assert one.share_above == pytest.approx((every.max(axis=1) > 1).mean(), rel=1e-12)
    assert f"the brightest at {every.max():.4g}" in one.warnings[0]
