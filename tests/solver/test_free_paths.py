"""Free paths: against Cauchy's mean chord, and what is seen of surfaces in gaps."""

import numpy as np
import pytest

from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.transport.free_paths import LONGEST, find_free_paths
from verification import meshes


def opened(parts):
    """The context of a scene of ``parts``, and a receiver on each of its triangles."""
    scene = meshes.scene(parts, 0.5)
    return build_context(scene, 0, 1, silent), meshes.triangle_receivers(scene)


@pytest.mark.parametrize("size", [(1, 1, 1), (1, 2, 3), (1, 4, 0.5)])
def test_the_mean_free_path_in_a_box_is_its_mean_chord(size):
    """Cauchy: the mean chord of a convex body, from its surface by the cosine law, is 4 V / S. 8 · 8 · 6 · 2 receivers of
    32 rays: lengths scatter by about themselves, which is 0.6 % of the mean."""
    corners, _ = meshes.box_polygons(size)
    context, receivers = opened([meshes.grid(each, 8) for each in corners])
    area = build_footprints(context.geometry, receivers).area
    mean = (find_free_paths(context, receivers).mean * area).sum() / area.sum()
    a, b, c = size
    chord = 4 * a * b * c / (2 * (a * b + b * c + c * a))
    assert mean * context.geometry.scale == pytest.approx(chord, rel=0.02)


def test_what_lies_in_a_gap_is_seen_as_much_less_as_the_gap_is_narrow():
    """Two plates of 20 × 20 at a distance of 0.01: all but their edges see 2 h: ∫ cosθ · h / cosθ dω / π = 2 h. A ceiling
    of 20 × 20, 2 above them, meets its floor at twice 2, where it does."""
    square = np.array([(0.0, 0, 0), (20, 0, 0), (20, 20, 0), (0, 20, 0)])
    parts = [meshes.grid(square, 8), meshes.grid(square[::-1] + (0, 0, 0.01), 8),
             meshes.grid(square + (0, 0, 0.02), 8), meshes.grid(square[::-1] + (0, 0, 2.02), 8)]  # fmt: skip
    context, receivers = opened(parts)
    paths = find_free_paths(context, receivers)
    lengths = np.split(paths.mean, 4)
    gap, room = np.median(lengths[0]), np.median(lengths[2])
    assert gap == pytest.approx(np.median(lengths[1]), rel=0.1)
    assert gap * context.geometry.scale == pytest.approx(0.02, rel=0.2)
    assert gap < 0.03 * room
    assert [each.mean() for each in np.split(paths.hidden, 4)] == pytest.approx([1, 1, 0, 0], abs=0.05)


def test_a_face_under_something_is_hidden_where_that_is_closer_than_a_twentieth_of_its_length():
    """In a gap of the height h the mean free path is 2 h: squares of the edge 1, halved, with h from 0.01 to 0.06."""
    square = np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]) * 20
    hidden = []
    for height in (0.01, 0.03, 0.06):
        context, receivers = opened([meshes.grid(square, 20), meshes.grid(square[::-1] + (0, 0, height), 1)])
        hidden.append(find_free_paths(context, receivers).hidden[:-2].mean())
    assert hidden[:2] == pytest.approx([1, 1], abs=0.1) and hidden[2] == 0


def test_rays_that_meet_nothing_are_as_long_as_the_scene():
    plane = meshes.grid(np.array([(0.0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]), 3)
    assert (find_free_paths(*opened([plane])).mean == LONGEST).all()
