"""Paths along the residual bring what a table of radiosities lacks, and regions' means correct it."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.correction import find_correction, regions_of, usable_levels
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requests import build_replicate
from radiosity_addon.solver.gather.residual import Paths, Residuals, Visits, follow_residual
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.transport.places import no_places
from verification import meshes

PATHS = 4000


class Asked:
    seed, passes, target_error = 0, ("direct", "indirect"), 0.03


def furnace(reflectance: float, divisions: int = 2, asked: type = Asked):
    """A box whose radiosity is 1, of which ``reflectance`` is reflected; a replicate of it, solved."""
    corners, _ = meshes.box_polygons()
    scene = meshes.scene([meshes.grid(face, 4) for face in corners], reflectance, 1 - reflectance)
    replicate = build_replicate(scene, meshes.triangle_receivers(scene, divisions), asked(), 1)
    replicate.solve(make_plan(0.03, replicate.placed.footprints.count, False))
    return replicate


@pytest.mark.parametrize("known", [0.0, 0.4, 1.0, 1.5])
def test_the_mean_path_brings_exactly_what_the_table_lacks(known):
    """Rays look up ``known`` times the reflected radiosity 0.5, wherever they end: the irradiance
    lacks 0.5 (1 − known). Chance that ends paths is the only noise: four standard errors."""
    replicate = furnace(0.5)
    radiosity, unit = replicate.radiosity, replicate.context.unit
    table = np.where(radiosity.reflected > 0, np.float32(0.5 * known / unit), np.float32(0))
    residuals = follow_residual(
        replicate.context, replicate.placed.footprints, replace(radiosity, reflected=table), PATHS, 0, 5
    )
    lack = residuals.paths.lack.mean(axis=1) * unit
    error = lack.std() / np.sqrt(PATHS)
    assert lack.mean() == pytest.approx(0.5 * (1 - known), abs=4 * error + 1e-4)
    assert error < 0.01


def test_a_right_table_lacks_nothing():
    replicate = furnace(0.8)
    residuals = follow_residual(
        replicate.context, replicate.placed.footprints, replicate.radiosity, PATHS, 0, 5
    )
    assert np.abs(residuals.paths.lack.mean()) * replicate.context.unit < 2e-3


@pytest.mark.parametrize(("passes", "baked"), [(("direct", "indirect"), 1.0), (("indirect",), 0.5)])
def test_a_bias_is_told_relative_to_the_light_that_is_baked(passes, baked):
    """Where indirect light is baked alone, direct light beside it makes no bias smaller."""
    replicate = furnace(0.5, asked=type("Passes", (Asked,), {"passes": passes}))
    everyone = np.arange(replicate.placed.footprints.count)
    replicate.add([], [(everyone, 16)], 0, None, False)
    irradiance = replicate.residuals.paths.irradiance.mean() * replicate.context.unit
    assert irradiance == pytest.approx(baked, rel=0.02)


@pytest.mark.parametrize("passes", [("direct", "indirect"), ("indirect",)])
def test_rays_read_what_was_gathered_whether_or_not_direct_light_is_baked(passes):
    """Without, a town's indirect light alone took 427 million rays, with it 104."""
    replicate = furnace(0.5, 8, asked=type("Passes", (Asked,), {"passes": passes}))
    patches = replicate.radiosity.reflected[: len(replicate.row_radiosity)]
    for rows in (patches, replicate.row_radiosity):
        rows *= 0.5  # as rows of few rays may be
    samples = [(np.arange(replicate.placed.footprints.count), 64)]
    for step in range(5):
        replicate.add(samples, samples, step, None, False)
    read = replicate.radiosity.reflected[: len(patches)] * replicate.context.unit
    assert read[read > 0].mean() > 0.4  # of 0.5: the first rounds read 0.25


def paths(lack: np.ndarray, owner: np.ndarray) -> Residuals:
    nothing = np.zeros(0, np.int64)
    paths = Paths(owner, np.ones((len(owner), 1), np.float32), lack[:, None].astype(np.float32))
    return Residuals(paths, Visits(nothing, no_places(), np.zeros((0, 1), np.float32)))


def even(footprints):
    """Light that is gathered, alike on all of receivers' areas."""
    return np.ones((footprints.count, 1)), footprints.area


def floor_of_receivers():
    scene = meshes.scene([meshes.grid(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), 16)])
    context = build_context(scene, 0, 1, silent)
    return build_footprints(context.geometry, meshes.triangle_receivers(scene, 1))


def test_a_bias_of_one_side_is_corrected_there():
    """Half of a floor lacks 0.2 of its light, paths deviate by 0.3: after 20,000 of them what is
    left is less than a tenth of that, and half of the surface is off by 0.2: found 0.2 / √2."""
    footprints = floor_of_receivers()
    random = np.random.default_rng(0)
    owner = random.integers(0, footprints.count, 20_000)
    true = np.where(footprints.middle()[0][:, 0] > 0, 0.2, 0.0)
    lack = true[owner] + 0.3 * random.normal(size=len(owner))
    correction = find_correction(paths(lack, owner), usable_levels(regions_of(footprints), len(owner)), *even(footprints))
    found = correction.lack[correction.region, 0]
    assert np.sqrt(((found - true) ** 2).mean()) < 0.02
    assert correction.found == pytest.approx(0.2 / np.sqrt(2), rel=0.15)
    assert np.sqrt(correction.uncorrected.max()) < 0.04


def test_noise_alone_is_not_corrected_and_what_it_hides_is_told():
    """2000 paths of deviation 2 without a bias: their mean is off by 2 / √2000 = 0.045."""
    footprints = floor_of_receivers()
    random = np.random.default_rng(1)
    owner = random.integers(0, footprints.count, 2000)
    correction = find_correction(
        paths(2 * random.normal(size=2000), owner), usable_levels(regions_of(footprints), 2000), *even(footprints)
    )
    assert np.abs(correction.lack).max() < 0.05
    assert np.sqrt(correction.uncorrected.mean()) == pytest.approx(2 / np.sqrt(2000), rel=0.5)


def test_a_bias_that_all_places_share_is_corrected():
    """All lack 0.02, 40,000 paths deviate by 0.5: their mean is off by 0.0025, an eighth of that. There
    is one region of all receivers: what it lacks is told from noise by what the paths' spread makes
    of two halves, not by other regions. What is corrected is drawn toward nothing by 1/64 of it."""
    footprints = floor_of_receivers()
    random = np.random.default_rng(2)
    owner = random.integers(0, footprints.count, 40_000)
    lack = 0.02 + 0.5 * random.normal(size=len(owner))
    correction = find_correction(
        paths(lack, owner), [np.zeros(footprints.count, np.int64)], *even(footprints)
    )
    assert correction.lack[0, 0] == pytest.approx(0.02, abs=3 * 0.0025)
    assert correction.found == pytest.approx(0.02, abs=4 * 0.0025)


def test_a_bias_is_in_proportion_to_the_light():
    """Half of a floor is ten times as bright as the other, and all of it lacks a tenth of its light: of the
    dark half no more is taken than it has, and what is bright gets ten times as much."""
    footprints = floor_of_receivers()
    random = np.random.default_rng(3)
    owner = random.integers(0, footprints.count, 20_000)
    light = np.where(footprints.middle()[0][:, 0] > 0, 1.0, 0.1)
    everyone = [np.zeros(footprints.count, np.int64), (light > 0.5).astype(np.int64)]
    lack = -0.1 * light[owner] + 0.3 * light.mean() * random.normal(size=len(owner))
    found = find_correction(paths(lack, owner), everyone, light[:, None], footprints.area)
    np.testing.assert_allclose(found.lack[:, 0], [-0.01, -0.1], rtol=0.1)
