"""The fraction of the whole: never back, never past 1, whatever order the phases come in."""

from __future__ import annotations

import pytest

from radiosity_addon.overall_progress import OTHER, SHARES, OverallProgress


def told(calls) -> list[float]:
    fractions = []
    overall = OverallProgress(lambda phase, fraction: fractions.append(fraction))
    for call in calls:
        overall(*call)
    return fractions


def test_each_run_takes_its_share_of_what_is_left():
    first = SHARES["elements"]
    second = first + OTHER * (1 - first)
    calls = [("elements", 0.5), ("elements", 1.0), ("gather", 1.0), ("gather", 0.5)]
    expected = [first / 2, first, second, second + OTHER * (1 - second) / 2]
    assert told(calls) == pytest.approx(expected, rel=1e-12)


def test_it_never_goes_back_nor_past_the_end():
    phases = ["elements", "transport", "transport", "gather", "gather", "direct", "gather"] * 20
    fractions = told([(phase, step / 4) for phase in phases for step in range(5)])
    assert all(a <= b for a, b in zip(fractions, fractions[1:]))
    assert fractions[-1] <= 1


def test_fractions_out_of_range_are_held_in_it():
    assert told([("gather", -1.0), ("gather", 7.0)]) == pytest.approx([0.0, OTHER])
