"""Darkness: each way in which a bake shows nothing has its warning, and others have none."""

from __future__ import annotations

import pytest

from radiosity_addon.solver.passes import Pass
from radiosity_addon.stages.darkness import DIM, warn_of_darkness

EMIT, DIRECT, INDIRECT, COLOR = Pass.EMIT, Pass.DIRECT, Pass.INDIRECT, Pass.COLOR


@pytest.mark.parametrize(
    ("passes", "most", "warning"),
    [
        ((EMIT, DIRECT, INDIRECT, COLOR), 0.0, "receives light"),
        ((DIRECT,), 0.0, "receives light"),
        ((EMIT,), 0.0, "glows"),
        ((EMIT, COLOR), 0.0, "glows"),
        ((EMIT, DIRECT, INDIRECT), DIM / 2, "dark"),
    ],
)
def test_nothing_to_be_seen_is_told(passes, most, warning):
    (sentence,) = warn_of_darkness(passes, most)
    assert warning in sentence


@pytest.mark.parametrize(("passes", "most"), [((COLOR,), 0.0), ((EMIT,), 1e-3), ((DIRECT,), DIM / 2), (tuple(Pass), DIM)])
def test_what_can_be_seen_or_was_asked_for_as_it_is_has_no_warning(passes, most):
    assert warn_of_darkness(passes, most) == []
