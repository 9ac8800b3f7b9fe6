"""What is said of texels that cannot be fitted."""

from __future__ import annotations

from radiosity_addon.bake.unfit import unfit_warning

BULBS = [("Bulb", 9, 0.0, 1.0), ("Bulb.001", 12, 0.0, 0.5)]


def test_one_object_that_cannot_be_fitted_is_told_with_its_causes():
    assert unfit_warning([("Wall", 2, 1 / 3.5, 0.5 / 3.5)]) == (
        "'Wall': 2 texels could not be fitted to the light beside seams: its UV map has islands that overlap or lie less "
        "than a texel apart (29 % of the surface) and islands thinner than a texel (14 %); bake more texels, or lay the "
        "map out with fewer islands and wider gaps"
    )
    assert unfit_warning(BULBS[:1]) == (
        "'Bulb': 9 texels could not be fitted to the light beside seams: its UV map has islands thinner than a texel "
        "(100 %); bake more texels, or lay the map out with fewer islands and wider gaps"
    )
    assert unfit_warning([("Wall", 5, 0.004, 0.005)]) == ""


def test_one_sentence_tells_of_two_objects():
    """The one with more texels first; a third would not be told of by itself and does not count."""
    assert unfit_warning([*BULBS, ("Wall", 5, 0.004, 0.005)]) == (
        "'Bulb.001', 'Bulb': 21 texels could not be fitted to the light beside seams: their UV maps have islands thinner "
        "than a texel (up to 100 %); bake more texels, or lay the maps out with fewer islands and wider gaps"
    )


def test_one_sentence_tells_of_five_objects():
    """The three with most texels are named."""
    more = [("Floor", 200, 0.021, 0.0), ("Shelf", 9, 0.3, 0.0), ("Door", 10, 0.2, 0.02)]
    assert unfit_warning([*BULBS, *more]) == (
        "'Floor', 'Bulb.001', 'Door' and 2 more: 240 texels could not be fitted to the light beside seams: their UV maps "
        "have islands that overlap or lie less than a texel apart (up to 30 % of a surface) and islands thinner than a "
        "texel (up to 100 %); bake more texels, or lay the maps out with fewer islands and wider gaps"
    )
