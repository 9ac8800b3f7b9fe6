"""Narrow beams get finer pictures, and what these leave out is told."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.lamp_detail import beam_warning, bends, doubled, refined

HEIGHT = 360


def beam(width, toward):
    """A function of rows and columns of pictures: light that falls off from 1 in a direction as a
    Gaussian of this full width at half maximum [degrees]; a channel is twice as bright."""
    toward = np.array(toward, float) / np.linalg.norm(toward)
    calls = []

    def render(columns, box):
        calls.append((columns, box))
        rows, across = (np.arange(b.start, b.stop) + 0.5 for b in box)
        latitude = (rows / (columns / 2) - 0.5)[:, None] * np.pi
        longitude = (0.5 - across / columns) * 2 * np.pi
        way = np.stack(np.broadcast_arrays(
            np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude),
            np.sin(latitude)))  # fmt: skip
        chord = np.linalg.norm(way - toward[:, None, None], axis=0)
        angle = np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1)))
        return np.exp(-4 * np.log(2) * (angle / width) ** 2)[..., None] * [1.0, 2.0, 1.0]

    return render, calls


def whole(height):
    return slice(0, height), slice(0, 2 * height)


def power(picture):
    """[sr] of the first channel."""
    height = len(picture)
    solid = np.cos((np.arange(height) + 0.5 - height / 2) * np.pi / height) * (np.pi / height) ** 2
    return float((solid[:, None] * picture[..., 0]).sum())


def true_power(width):
    """The plane's integral of the Gaussian: π w² / (4 ln 2), w [rad]; the sphere's is alike."""
    return np.pi * np.radians(width) ** 2 / (4 * np.log(2))


@pytest.mark.parametrize(
    ("width", "toward"), [(2.0, (0, 0, -1)), (2.0, (-1, 1e-3, 0.2)), (0.7, (0.03, 0.02, -1))]
)
def test_a_narrow_beam_is_refined_until_it_is_told_right(width, toward):
    render, calls = beam(width, toward)
    coarse = render(2 * HEIGHT, whole(HEIGHT)).astype(np.float32)
    picture, error = refined(coarse, render)
    assert len(picture) > HEIGHT and error < 0.02 < np.sqrt(bends(coarse).sum())
    assert power(picture) == pytest.approx(true_power(width), rel=0.01)
    assert power(doubled(picture[..., :1])) == pytest.approx(true_power(width), rel=0.01)
    drawn = sum((b[0].stop - b[0].start) * (b[1].stop - b[1].start) for _, b in calls[1:])
    assert drawn < picture[..., 0].size / 4  # a part of it alone


def test_what_is_smooth_stays_as_it_is():
    render, calls = beam(40.0, (0.3, 0.5, -1))
    coarse = render(2 * HEIGHT, whole(HEIGHT)).astype(np.float32)
    picture, error = refined(coarse, render)
    assert picture is coarse and len(calls) == 1 and error < 0.01


def test_interpolated_pictures_keep_what_is_linear():
    """Rows that rise linearly rise by half as much a row; columns are alike."""
    ramp = np.repeat(np.arange(8.0)[:, None], 16, axis=1)[..., None]
    fine = doubled(ramp)
    assert fine.shape == (16, 32, 1)
    assert np.diff(fine[1:-1, :, 0], axis=0) == pytest.approx(0.5)
    assert (fine == fine[:, :1]).all()


def test_what_is_left_out_is_told():
    assert beam_warning("lamp", 0.005) == []
    (told,) = beam_warning('lamp "Torch"', 0.12)
    assert "12 %" in told and "Torch" in told
    render, _ = beam(0.08, (0.6, 0.5, 0.1))
    coarse = render(2 * HEIGHT, whole(HEIGHT)).astype(np.float32)
    assert refined(coarse, render)[1] > 0.02
