"""Lamps that shine unevenly: closed forms under a lamp, power, and bounds."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.check import check_scene
from radiosity_addon.solver.energy import energy_balance
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.distributions import coarse_maxima, interpolated, nearest
from radiosity_addon.solver.lights.sky import pixel_directions
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import PointLamp
from verification import meshes
from verification import stability_scenes as scenes

DOWN = np.array([0, 0, -1.0])
HEIGHT = 0.8


def picture(formula, height: int = 360) -> np.ndarray:
    """(height, 2 height) values of ``formula(x, y, z)`` in the middles of pixels."""
    way = pixel_directions(height, 2 * height)
    return formula(*np.moveaxis(way, 2, 0)).astype(np.float32)


def lopsided(x, y, z):
    """Bright below, on the side of +x more than on that of −x, nothing above."""
    return np.where(z < 0, z * z * (2 + x) / 3, 0)


def lamp(shape, radius=0.0, **more) -> PointLamp:
    return PointLamp("Lamp", np.array([0.5, 0.5, HEIGHT]), np.ones(3), radius, distribution=shape,
                     **more)  # fmt: skip


def sampled(light: PointLamp, places, normals):
    """(n,) unoccluded irradiance of one sample at each place, in the scene's own lengths."""
    context = build_context(replace(scenes.lamp_room(), lamps=(light,)), 0, 1, silent)
    kind, geometry = context.sources.batches[0], context.geometry
    xi = np.random.default_rng(2).random((len(places), 2))
    here = np.array([geometry.normalized(place) for place in places])
    found = kind.sample(0, here, normals, xi)
    assert found.exact is None or light.distribution is None
    return found.irradiance * kind.color[0, 0] * context.unit


def test_below_a_sharp_lamp():
    """E = I(direction) cosθ / d²; at a distance a from the foot d² = a² + h², cosθ = h / d, and with
    I = z² (2 + x) / 3, z = −cosθ: cos³θ / h² · cos²θ (2 + x) / 3."""
    way = np.random.default_rng(0).uniform(-0.45, 0.45, (50, 2))
    places = np.column_stack([0.5 + way, np.zeros(50)])
    cosine = HEIGHT / np.sqrt((way**2).sum(axis=1) + HEIGHT**2)
    across = way[:, 0] / HEIGHT * cosine
    expected = cosine**3 / HEIGHT**2 * cosine**2 * (2 + across) / 3
    found = sampled(lamp(picture(lopsided)), places, np.tile(-DOWN, (50, 1)))
    np.testing.assert_allclose(found, expected, rtol=2e-4)  # half a degree: h²/8 · f'' = 1e-5 · 10


@pytest.mark.parametrize("ball", [False, True])
def test_below_a_soft_lamp(ball):
    """Straight below with I(z) = −z: light comes under angles α off the axis, up to σ, and sin²α is
    uniform up to S = sin²σ. cosα = √(1 − s) has the mean ⅔ (1 − (1 − S)^{3/2}) / S. A disk that faces
    the place brings 1 / (h² + r²) and has S = r² / (h² + r²), a sphere 1 / h² and S = r² / h²."""
    radius = 0.3
    light = lamp(picture(lambda x, y, z: np.maximum(-z, 0)), radius, sphere=ball)
    n = 40_000
    found = sampled(light, np.tile([0.5, 0.5, 0], (n, 1)), np.tile(-DOWN, (n, 1)))
    square = HEIGHT**2 + (0 if ball else radius**2)
    share = radius**2 / square
    expected = 2 / 3 * (1 - (1 - share) ** 1.5) / share / square
    assert found.mean() == pytest.approx(expected, abs=4 * found.std() / np.sqrt(n) + 1e-4)


@pytest.mark.parametrize("spot, steradians", [(False, 2 * np.pi), (True, 0.875 * np.pi)])
def test_power_is_the_integral_over_directions(spot, steradians):
    """∫ (1 − z)/2 dω = 2π; of the hard cone of 120° around −z, z from −1 to −½:
    2π [(z − z²/2)/2] = 2π (−0.3125 + 0.75) = 0.875 π."""
    beam = {"axis": DOWN, "cone": np.radians(120), "blend": 0.0} if spot else {}
    light = lamp(picture(lambda x, y, z: (1 - z) / 2), **beam)
    context = build_context(replace(meshes.box_scene(), lamps=(light,)), 0, 1, silent)
    assert energy_balance(context)["emitted"] == pytest.approx(steradians, rel=1e-3)


def test_layout_is_that_of_a_sky():
    """Column 0 begins at −x, a quarter of the width on lies +y, row 0 at the nadir; and across the
    seam and beyond the poles' rows values go on."""
    shape = picture(lambda x, y, z: 1 + x + 2 * y + 4 * z)
    way = np.random.default_rng(1).normal(size=(3, 1000))
    way /= np.linalg.norm(way, axis=0)
    way[:, :3] = np.array([[-1, 1e-4, 0], [-1, -1e-4, 0], [1e-3, 0, 1]]).T
    x, y, z = way / np.linalg.norm(way, axis=0)
    np.testing.assert_allclose(interpolated(shape, way), 1 + x + 2 * y + 4 * z, atol=0.02)
    single = np.full((1, 1), 0.7, np.float32)
    np.testing.assert_allclose(interpolated(single, way), 0.7, rtol=1e-6)


@pytest.mark.parametrize("height", [7, 180])
def test_maxima_bound_what_lies_near(height):
    """Sparks, single bright pixels at random, are within every coarse pixel that a direction up to
    10° off falls into: what is interpolated there is never above."""
    random = np.random.default_rng(height)
    shape = np.where(random.random((height, 2 * height)) < 9 / height**2, 1, 0).astype(np.float32)
    maxima = coarse_maxima(shape)
    way = random.normal(size=(3, 100_000))
    way /= np.linalg.norm(way, axis=0)
    off = np.cross(way.T, random.normal(size=(100_000, 3))).T
    off /= np.linalg.norm(off, axis=0)
    angle = np.radians(10) * random.random(100_000) * 0.999
    beside = way * np.cos(angle) + off * np.sin(angle)
    there = interpolated(shape, beside)
    assert (there > 0.02).any() and (there <= nearest(maxima, way) + 1e-6).all()
    assert maxima.min() == 0  # they do tell dark directions


def test_shapes_must_be_finite():
    shape = np.full((2, 4), np.nan, np.float32)
    room = replace(scenes.lamp_room(), lamps=(lamp(shape),))
    receivers = meshes.triangle_receivers(room)
    with pytest.raises(ValueError, match="distribution of lamp 'Lamp'"):
        check_scene(room, receivers)
