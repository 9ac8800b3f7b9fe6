"""Faces that modifiers make of none of the user's get no color, and are told of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import CornerMap
from radiosity_addon.bake.sourceless import sourceless_share, sourceless_warning
from radiosity_addon.bake_job import run
from tests.square import square_job

HALF = CornerMap(np.array([0, 1, 2, 3, 3, 3, 3]), np.arange(3), np.ones(3), 6)  # the first triangle's


def test_share_of_the_surface():
    """Of triangles of 1 and 3 m² the second has no corner with a source: 3/4. With one such corner
    of its three it is a third of that."""
    assert sourceless_share(HALF, np.array([1.0, 3.0])) == 0.75
    one = CornerMap(np.array([0, 1, 2, 3, 4, 5, 5]), np.arange(5), np.ones(5), 6)
    assert sourceless_share(one, np.array([1.0, 3.0])) == pytest.approx(0.25)
    assert sourceless_share(one, np.zeros(2)) == 0


def test_the_sentence_has_the_share_and_the_remedy():
    text = sourceless_warning("Cube", 0.0153, ("Bevel",))
    assert text.startswith("'Cube': 1.5 % of its surface") and "(Bevel)" in text
    assert "apply the modifiers" in text
    assert sourceless_warning("Cube", 0.0009, ("Bevel",)) == ""


@pytest.mark.parametrize(("domain", "told"), [("corner", True), ("point", False)])
def test_bakes_warn_of_faces_without_a_source(domain, told):
    """Half of the square. Points have colors whatever face they are of."""
    job = square_job("vertex", domain=domain)
    target = replace(job.targets[0], corner_map=HALF, modifiers=("Boolean",))
    warnings = run(replace(job, targets=(target,))).warnings
    assert any("50 % of its surface consists of faces" in text for text in warnings) == told
    assert not any("are faces" in text for text in run(job).warnings)
