"""What an image lacks is told: UVs outside the tile, and faces without UV area."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.bake.uv_cover import Missed, missed_shares, missed_warning

HALF = np.array([[0, 0], [1, 0], [1, 1]], float)
OTHER = np.array([[0, 0], [1, 1], [0, 1]], float)


def shares(uv, area, start=3):
    uv = np.asarray(uv, float)
    numbers = np.arange(start, start + len(uv))
    found = missed_shares(texel_receivers(uv, numbers, 16), uv, start, np.asarray(area, float))
    return found.outside, found.unreal, found.flat


def test_all_inside():
    assert shares([HALF, OTHER], [2, 2]) == pytest.approx((0, 0, 0), abs=1e-9)


def test_a_udim_tile_is_outside():
    """One of two triangles, with 3 of 4 m², on tile 1002."""
    assert shares([HALF, OTHER + [1, 0]], [1, 3]) == pytest.approx((0.75, 0, 0), abs=1e-9)


def test_a_triangle_partly_outside():
    """u from −0.5 to 0.5: of the triangle under the diagonal, the part with u < 0 is half as wide
    and half as high: a quarter."""
    assert shares([HALF - [0.5, 0]], [1]) == pytest.approx((0.25, 0, 0), abs=1e-6)


def test_faces_without_uv_area():
    """Points and lines: what a modifier makes without UVs."""
    assert shares([HALF, np.zeros((3, 2))], [1, 4]) == pytest.approx((0, 0, 0.8), abs=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_uvs_that_are_no_numbers(bad):
    """One corner of one of two triangles."""
    broken = HALF.copy()
    broken[1, 0] = bad
    assert shares([HALF, broken], [1, 1]) == pytest.approx((0, 0.5, 0), abs=1e-9)


def test_the_sentence_has_the_share_and_the_remedy():
    text = missed_warning("Crate", Missed(outside=0.394), ())
    assert text.startswith("'Crate': 39 % of its surface has UVs outside") and "inside" in text
    text = missed_warning("Crate", Missed(flat=0.19), ("Boolean",))
    assert "19 %" in text and "Boolean" in text and "vertex colors" in text
    assert missed_warning("Crate", Missed(flat=0.0005), ()) == ""
    text = missed_warning("Crate", Missed(unreal=0.5), ())
    assert "50 %" in text and "not a number" in text and "without area" not in text
