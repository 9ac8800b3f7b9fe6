"""Colors that modifiers repeat at places whose light is another are told of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.bake.exported_object import CornerMap
from radiosity_addon.bake.shared_colors import mixtures, shared_share
from radiosity_addon.bake_job import run
from tests.square import SQUARE, square_job

TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], float)
COPIES = np.stack([TRIANGLE, TRIANGLE + (0, 0, 1), TRIANGLE + (5, 0, 0)])
COLORS = np.array([(1, 2, 3), (1, 2, 3), (4, 5, 6)], float)  # the second triangle repeats the first


@pytest.mark.parametrize(
    ("light", "seen", "share"),
    [
        ((1, 2.5, 1), (1, 1, 1), 2 / 3),
        ((1, 1.5, 9), (1, 1, 1), 0),  # the third has colors of its own
        ((0, 0.3, 9), (1, 1, 1), 0),  # both are dark
        ((1, 0, 1), (1, 0, 1), 0),  # nobody sees the second
        ((0, 0, 0), (0, 0, 0), 0),
    ],
)
def test_share_of_the_surface(light, seen, share):
    found = shared_share(COLORS, COPIES, np.array(light, float), np.array(seen, float), np.ones(3))
    assert found == pytest.approx(share)


def test_one_place_has_the_mean_of_its_light():
    """As of a corner of a box with one color for all of its faces."""
    points = np.stack([TRIANGLE, TRIANGLE])
    assert shared_share(COLORS[:2], points, np.array([0.0, 9.0]), np.ones(2), np.ones(2)) == 0


def test_alike_mixtures_have_one_number():
    """Halves of two colors, twice; a third of one of them; and a corner without a color."""
    corners = CornerMap(np.array([0, 2, 4, 5]), np.array([0, 1, 0, 1, 0]), np.array([0.5, 0.5, 0.5, 0.5, 1.0]), 2)
    first, second, third = mixtures(corners, np.arange(2))[0]
    assert first == second != third
    assert mixtures(CornerMap(np.zeros(4, int), np.zeros(0, int), np.zeros(0), 2), np.arange(2)).tolist() == [[0, 0, 0]]


@pytest.mark.parametrize("domain", ["corner", "point"])
def test_bakes_warn_of_repeated_colors(domain):
    """The second half of the square is the first one's copy, laid upside down: dark. They touch in two corners."""
    job = square_job("vertex", domain=domain)
    turned = np.array([(0, 1, 2), (0, 3, 2)], np.int32)
    corners = CornerMap(np.arange(7), np.array([0, 1, 2, 0, 1, 2]), np.ones(6), 3)
    loops = np.arange(3)
    target = replace(
        job.targets[0], corner_map=corners, loop_vertex=loops, loop_smooth_group=loops, modifiers=("Solidify",)
    )
    job = replace(job, scene=replace(job.scene, triangles=turned, vertices=SQUARE), targets=(target,))
    (text,) = [text for text in run(job).warnings if "repeat" in text]
    assert text.startswith("'Square': 33 % of its surface") and "(Solidify)" in text
    plain = replace(job, targets=(replace(target, modifiers=()),))
    assert not any("repeat" in text for text in run(plain).warnings)
