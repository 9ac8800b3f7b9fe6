"""What the replicates' difference does not show is found by samples that nothing was chosen by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.error_estimator import ErrorEstimator
from radiosity_addon.solver.adaptive.estimate import Surface
from radiosity_addon.solver.adaptive.held_out import (
    MOST,
    SAMPLES,
    SHARE,
    common_square,
    held_out_receivers,
    lacking_held_out,
    with_common,
)  # fmt: skip
from radiosity_addon.solver.gather.lighting import Lighting, no_light
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.receivers import Projection
from radiosity_addon.solver.sampling.points import PointsOnFootprints
from verification import meshes

COUNT = 40_000


def lit(radiance: np.ndarray) -> Lighting:
    """One point each, of white receivers with this radiance (n, channels)."""
    light = no_light(*radiance.shape)
    light.direct[:] = np.pi * radiance
    light.points[:] = 1
    return light


def test_what_replicates_have_in_common_is_told():
    """Both are off by 0.03 in common, and by 0.04 of their own: the mean by √(0.03² + 0.04² / 2) = 0.0412, of which half
    of their difference shows 0.0283. Held-out light is worse than either, off by 0.1, and tells the rest within √(2 / 4096) of
    0.1²: 2 deviations are 0.021² of 0.0412²."""
    rng = np.random.default_rng(3)
    both = 0.03 * rng.standard_normal((COUNT, 1))
    replicates = [lit(1 + both + 0.04 * rng.standard_normal((COUNT, 1))) for _ in range(2)]
    share = np.full(COUNT, 1 / COUNT)
    chosen = held_out_receivers(share)
    held = [lit(1 + 0.1 * rng.standard_normal((len(chosen), 1))) for _ in range(2)]
    surface = Surface(np.ones((COUNT, 1)), np.zeros((COUNT, 1)), np.ones(COUNT))
    project = Projection(
        lambda x: x, lambda x: (-np.inf, np.inf), lambda x: x, lambda errors, own: np.ones(len(own)), np.ones(COUNT)
    )
    judge = ErrorEstimator(surface, [], ("direct", "color"), 1, None, project, held_out=chosen)
    assert judge.weigh(replicates).error == pytest.approx(0.0283, rel=0.02)
    found = judge.weigh(replicates, held_out=held)
    assert found.error == pytest.approx(0.0412, rel=0.15)
    assert found.squares()[0] == pytest.approx(found.error**2, rel=1e-5)


def test_equal_errors_of_two_replicates_are_their_covariance():
    """Off by 0.2 and -0.1, and by 0.3 in both: the mean m is (-0.02 + 3 · 0.09) / 4 where the second has three times the area, and
    its variance by the shares ¼ and ¾ (1 · (-0.02 - m)² + 9 · (0.09 - m)²) / 16."""
    replicates = [np.array([[1.2], [1.3]]), np.array([[0.9], [1.3]])]
    held = [np.ones((2, 1))] * 2
    found = common_square(replicates, held, np.array([1.0, 3.0]), np.ones((2, 1)))
    mean = (-0.02 + 3 * 0.09) / 4
    deviation = np.sqrt((-0.02 - mean) ** 2 + 9 * (0.09 - mean) ** 2) / 4
    assert found == pytest.approx(mean + deviation)
    opposite = [np.full((2, 1), 0.5), np.full((2, 1), 1.5)]
    assert common_square([np.ones((2, 1))] * 2, opposite, np.ones(2), np.ones((2, 1))) == 0


def test_receivers_are_held_out_by_their_area():
    """Of 4,096 held out, a quarter of the surface has a quarter, however few receivers it is made of; a receiver is
    held out once."""
    area = np.repeat([3.0, 1.0], [COUNT // 4, 3 * COUNT // 4])
    chosen = held_out_receivers(area / area.sum())
    assert len(chosen) == MOST and (np.diff(chosen) > 0).all()
    assert (chosen < COUNT // 4).mean() == pytest.approx(0.5, abs=0.01)
    large = np.append(np.full(COUNT - 1, 0.5 / (COUNT - 1)), 0.5)
    assert (held_out_receivers(large) == COUNT - 1).sum() == 1
    assert held_out_receivers(np.full(300, 1 / 300)) is None
    assert len(held_out_receivers(np.full(8000, 1 / 8000))) == 8000 * SHARE


def test_held_out_receivers_get_what_they_lack():
    """64 and 16 points, 128 and 32 rays: SAMPLES times as many, less what they have, in powers of two."""
    light = no_light(3, 1)
    light.points[:, 0], light.rays[:, 0] = (1, 64, 16), (1, 128, 32)
    held = no_light(2, 1)
    held.points[:, 0], held.rays[:, 0] = (SAMPLES * 64, 0), (0, SAMPLES * 32)
    lacking = lacking_held_out(np.array([1, 2]), light, held)
    assert [(list(owners), number) for owners, number in lacking.points] == [([1], 32)]
    assert [(list(owners), number) for owners, number in lacking.rays] == [([0], 256)]
    assert len(lacking_held_out(np.array([1, 2]), light, None).points) == 2


def test_receivers_with_few_samples_are_suspected_most():
    """The squared error doubles, and what is added is four times as much for a quarter of the samples, though these agree."""
    light = no_light(2, 1)
    light.points[:, 0] = light.rays[:, 0] = (4, 16)
    direct, gathered = with_common(
        (np.array([0.0, 0.01]), np.zeros(2)), np.full(2, 0.5), light, np.sqrt(2)
    )
    assert direct.mean() == pytest.approx(2 * 0.005)
    assert direct[0] == pytest.approx(4 * (direct[1] - 0.01))
    assert not gathered.any()


@pytest.mark.parametrize("cells", [1, 3])
def test_footprints_taken_out_of_others_are_where_they_were(cells):
    """Of a box's triangles, each divided into four: receivers of one cell, and of three."""
    scene = meshes.box_scene(divisions=2)
    receivers = meshes.triangle_receivers(scene, 2)
    number = np.arange(len(receivers.receiver)) // cells
    receivers = replace(receivers, count=int(number[-1]) + 1, receiver=number)
    every = build_footprints(build_geometry(scene.vertices, scene.triangles), receivers)
    some = every.take(np.array([7, 2]))
    shift = np.array([[0.3, 0.6, 0.1], [0.9, 0.2, 0.5]])
    one, two = (
        PointsOnFootprints(each, np.array(owners), shift, 4, (1,))(slice(0, 2), 0)
        for each, owners in ((every, [7, 2]), (some, [0, 1]))
    )
    assert np.allclose(one.position, two.position, atol=1e-6)
    assert np.array_equal(one.triangle, two.triangle)
    assert np.allclose(some.area, every.area[[7, 2]])
    assert every.take(np.zeros(0, int)).count == 0
