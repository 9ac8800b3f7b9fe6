"""Photometry: IES texts are read, and their beams measured."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.photometry import beams, narrow_share, read_photometry
from tests.export.test_export_lamp_shapes import photometry

TENT = [0, 9, 10, 11, 90]  # angles [degrees]: a beam at 10 with a width at half maximum of 1


def tent(polar, across):
    return 100.0 if polar == 10 else 0.0


def test_a_table_is_read():
    table = read_photometry(photometry([0, 90], TENT, lambda v, h: v + h))
    np.testing.assert_array_equal(table.angles, TENT)
    np.testing.assert_array_equal(table.candela, [TENT, np.add(TENT, 90)])


def test_a_tilt_that_is_included_is_passed_over():
    text = photometry([0], TENT, tent).replace("TILT=NONE", "TILT=INCLUDE\n1\n2\n0 90\n1.0 0.5")
    np.testing.assert_array_equal(read_photometry(text).angles, TENT)


@pytest.mark.parametrize("text", ["", "rubbish", "TILT=NONE\n1 2 3", "TILT=NONE\n" + "x " * 30])
def test_what_is_no_table_is_none(text):
    assert read_photometry(text) is None


def test_a_beam_is_as_wide_as_where_it_has_half_of_its_maximum():
    ((width, share),) = beams(read_photometry(photometry([0], TENT, tent)))
    assert (width, share) == pytest.approx((1.0, 1.0))


def test_a_beam_at_the_axis_has_its_other_half_beyond_it():
    table = read_photometry(photometry([0], [0, 2, 90], lambda v, h: float(v == 0)))
    assert beams(table)[0] == pytest.approx((2.0, 1.0))  # half of it at 1 degree, on both sides


def test_the_share_of_a_beam_on_a_wide_one():
    """A tent of 100 cd on 100 cd everywhere: what stands out has 100 (cos 9 - cos 11) / 2 of the
    100 (cos 0 - cos 90) of the rest and of itself."""
    table = read_photometry(photometry([0], TENT, lambda v, h: 100 + tent(v, h)))
    extra = (np.cos(np.radians(9)) - np.cos(np.radians(11))) / 2
    assert narrow_share(table, 1.1) == pytest.approx(extra / (1 + extra))
    assert narrow_share(table, 0.9) == 0.0
