"""Receivers about whose light the replicates differ: what is known of them is read no longer."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.allocation import DISPUTED, ENOUGH_RAYS, disputed_receivers
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requests import build_replicate
from verification import meshes


def test_wrong_radiosities_of_receivers_that_are_left_out_do_no_harm():
    """A closed box of reflectance 0.5 whose faces emit, and whose patches are taken to be ten times as bright as they are: as if
    light that one ray found had been reflected in there. Rays that go on from each find what is there."""
    scene = meshes.box_scene(reflectance=0.5, exitance=1.0)
    receivers = meshes.triangle_receivers(scene, 24)
    everyone = np.arange(receivers.count)
    replicate = build_replicate(scene, receivers, Settings(error=0.03), 1)
    replicate.solve(make_plan(0.03, receivers.count, False))
    replicate.radiosity = replace(replicate.radiosity, reflected=10 * replicate.radiosity.reflected)

    def bounced(step):
        replicate.residuals = None
        light = replicate.add([], [(everyone, 8)], step, None, False).light
        return (light.bounced / light.rays).mean() * replicate.context.unit

    assert bounced(0) > 5
    replicate.leave_out(everyone)
    assert bounced(1) == pytest.approx(1.0, rel=0.02)
    assert (replicate.light.rays == 8).all()


def test_patches_that_have_a_part_of_a_receiver():
    """A texel over two faces of a fold is several patches, all of which are the receiver's."""
    scene = meshes.box_scene()
    receivers = meshes.triangle_receivers(scene, 1)
    own = build_replicate(scene, receivers, Settings(error=0.03), 1).placed.patches(10)
    own = replace(own, patch=own.patch.copy(), keys=np.array([2 * len(own.baked) + 2, 5 * len(own.baked) + 5]),
                  values=np.array([7, 9], np.int32))  # fmt: skip
    own.patch[2] = -3
    assert np.flatnonzero(own.with_parts_of(np.array([2, 4]))).tolist() == sorted({7, int(own.patch[4])})


def test_disputed_are_those_of_many_rays_that_differ_once():
    difference = np.array([[2.0], [2], [0.9], [2]]) * DISPUTED * [1, 1, 1]
    estimate, rays = SimpleNamespace(difference=difference), np.array([[1.0], [0.5], [1], [1]]) * ENOUGH_RAYS
    settled = np.array([False, False, False, True])
    assert disputed_receivers(estimate, SimpleNamespace(rays=rays), settled).tolist() == [0]
