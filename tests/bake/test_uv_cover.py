"""What an image lacks is told: UVs outside the tile, and faces without UV area."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.bake.uv_cover import missed_shares, missed_warning

HALF = np.array([[0, 0], [1, 0], [1, 1]], float)
OTHER = np.array([[0, 0], [1, 1], [0, 1]], float)


def shares(uv, area, start=3):
    uv = np.asarray(uv, float)
    numbers = np.arange(start, start + len(uv))
    return missed_shares(texel_receivers(uv, numbers, 16), uv, start, np.asarray(area, float))


def test_all_inside():
    assert shares([HALF, OTHER], [2, 2]) == pytest.approx((0, 0), abs=1e-9)


def test_a_udim_tile_is_outside():
    """One of two triangles, with 3 of 4 m², on tile 1002."""
    assert shares([HALF, OTHER + [1, 0]], [1, 3]) == pytest.approx((0.75, 0), abs=1e-9)


def test_a_triangle_partly_outside():
    """u from −0.5 to 0.5: of the triangle under the diagonal, the part with u < 0 is half as wide
    and half as high: a quarter."""
    assert shares([HALF - [0.5, 0]], [1]) == pytest.approx((0.25, 0), abs=1e-6)


def test_faces_without_uv_area():
    """Points and lines: what a modifier makes without UVs."""
    assert shares([HALF, np.zeros((3, 2))], [1, 4]) == pytest.approx((0, 0.8), abs=1e-9)
    assert shares([HALF, np.full((3, 2), np.nan)], [1, 1]) == pytest.approx((0, 0.5), abs=1e-9)


def test_the_sentence_has_the_share_and_the_remedy():
    text = missed_warning("Crate", 0.394, 0.0, ())
    assert text.startswith("'Crate': 39 % of its surface has UVs outside") and "inside" in text
    text = missed_warning("Crate", 0.0, 0.19, ("Boolean",))
    assert "19 %" in text and "Boolean" in text and "vertex colors" in text
    assert missed_warning("Crate", 0.0, 0.0005, ()) == ""
