"""Packing by Blender: one density, gaps in texels, oblong images, what fits."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from radiosity_addon.bake.pack import Chart, area_of, pack  # noqa: E402
from radiosity_addon.bake.uv_edit import Shape  # noqa: E402


def rectangle(width: float, height: float, factor: float = 1.0) -> Chart:
    """A rectangle [m], its UVs in the unit square."""
    unit = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    points = np.concatenate([unit * (width, height), np.zeros((4, 1))], 1)
    uv = unit * np.array([width, height]) / max(width, height)
    return Chart(Shape(points, np.arange(4), np.array([0])), uv, factor)


def boxes(packed, size):
    """(low, high) in texels of each chart."""
    return [(uv.min(0) * size, uv.max(0) * size) for uv in packed.uvs]


def apart(a, b) -> float:
    """How far two boxes lie apart along the axis on which they do."""
    return max(float(np.max(a[0] - b[1])), float(np.max(b[0] - a[1])))


def test_a_density_is_kept_whatever_the_image(blender):
    """10 texels per meter: 2 m × 1 m are 20 × 10 texels, 1 m × 1 m with a factor of 3 are 30 × 30."""
    for size in ((64, 64), (256, 64), (64, 128)):
        packed = pack([rectangle(2, 1), rectangle(1, 1, 3)], size, 4, 10)
        first, second = (sorted(high - low) for low, high in boxes(packed, size))
        assert first == pytest.approx([10, 20], rel=1e-3)
        assert second == pytest.approx([30, 30], rel=1e-3)
        assert packed.density == pytest.approx(10, rel=1e-3)


@pytest.mark.parametrize("density", [None, 8])
def test_charts_are_a_gap_apart_and_half_of_it_from_the_border(blender, density):
    charts, size = [rectangle(1, 1), rectangle(2, 1), rectangle(1, 0.5)], (128, 64)
    found = boxes(pack(charts, size, 6, density), size)
    assert min(apart(a, b) for i, a in enumerate(found) for b in found[:i]) >= 6 - 0.01
    low = np.min([low for low, _ in found], axis=0)
    high = np.max([high for _, high in found], axis=0)
    assert low.min() >= 3 - 0.01 and (np.array(size) - high).min() >= 3 - 0.01


def test_without_a_density_the_image_is_filled(blender):
    """One square in 128 × 64 with a gap of 8: its edge is 64 − 2 · 4 texels of 1 m."""
    packed = pack([rectangle(1, 1)], (128, 64), 8)
    assert packed.density == pytest.approx(56, rel=1e-3)
    assert packed.extent == pytest.approx((64, 64), rel=1e-3)


def test_what_does_not_fit_says_how_much_it_takes(blender):
    """1 m at 100 texels per meter and a gap of 4: 104 texels."""
    assert pack([rectangle(1, 1)], (64, 64), 4, 100).extent == pytest.approx((104, 104), rel=1e-3)


def test_area_counts_the_square_of_the_factor():
    assert area_of(rectangle(2, 3, 0.5)) == pytest.approx(6 * 0.25)
