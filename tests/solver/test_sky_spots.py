"""Bright spots of panoramas keep their shape: against sums over parts of pixels."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.lights.sky import solid_angles, split_sky
from radiosity_addon.solver.lights.sky_spots import WIDEST, sky_spots
from radiosity_addon.solver.sampling.sobol import sobol
from radiosity_addon.solver.scene import Material, Sky
from radiosity_addon.solver.sequence import solve
from tests.solver.test_textured_lights import places_of, quads

PARTS = 12  # of a pixel along either side, in the sums
WALL, TOP = 0.5, 0.3  # x of a wall across the floor, and its height


def spotted(rows, columns, shape=(64, 128), level=300.0) -> np.ndarray:
    """(height, width, 3) radiance 0.2, and much more in a spot."""
    pixels = np.full((*shape, 3), 0.2, np.float32)
    pixels[rows[0] : rows[1], columns[0] : columns[1]] = level
    return pixels


def parts_of(pixels: np.ndarray, parts: int = PARTS):
    """Directions (n, 3) of the middles of parts of pixels, and their radiance · dω (n, 3)."""
    height, width = (size * parts for size in pixels.shape[:2])
    v, u = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
    latitude, turn = np.pi * (v - 0.5)[:, None], 2 * np.pi * (0.5 - u)
    flat = np.cos(latitude)
    toward = np.stack([flat * np.cos(turn), flat * np.sin(turn),
                       np.broadcast_to(np.sin(latitude), (height, width))], 2)  # fmt: skip
    radiance = pixels.repeat(parts, 0).repeat(parts, 1).astype(float)
    flux = radiance * (flat * np.pi / height * 2 * np.pi / width)[..., None]
    return toward.reshape(-1, 3), flux.reshape(-1, 3)


def on_floor(pixels: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(n,) irradiance on the floor: the sum over all parts of pixels above it, less what the wall
    hides."""
    toward, flux = parts_of(pixels)
    above = toward[:, 2] > 0
    toward, light = toward[above], (flux[above, 0] * toward[above, 2])
    found = []
    for x, y, _ in places:
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (WALL - x) / toward[:, 0]
        across = y + step * toward[:, 1]
        hidden = (step > 0) & (step * toward[:, 2] < TOP) & (across > 0) & (across < 1)
        found.append(light[~hidden].sum())
    return np.array(found)


@pytest.mark.parametrize("rows, columns", [
    pytest.param((44, 52), (64, 65), id="upright strip"),
    pytest.param((48, 49), (60, 68), id="level strip"),
    pytest.param((47, 50), (63, 66), id="square"),
    pytest.param((31, 34), (62, 65), id="across the horizon"),
    pytest.param((63, 64), (0, 128), id="around the pole"),
])  # fmt: skip
def test_a_spot_throws_the_shadow_of_its_shape(rows, columns):
    """A floor, a wall across it, a bright spot behind: half a percent more than what was asked, for
    the sums' own parts at shadow edges. A round sun in the spot's place is off by 2 to 12 %."""
    pixels = spotted(rows, columns)
    floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    wall = [[WALL, 0, 0], [WALL, 1, 0], [WALL, 1, TOP], [WALL, 0, TOP]]
    gray, black = (Material(str(r), Constant(np.full(3, r))) for r in (0.5, 0.0))
    plain = quads([floor, wall], (gray, black))
    scene = replace(plain, sky=Sky(pixels))
    where, x = places_of(scene, [0, 1], 40)
    found = solve(scene, where, Settings(error=0.01, passes=("direct",)))
    light, truth = found.direct.mean(axis=1), on_floor(pixels, x)
    off = np.sqrt(np.mean(((light - truth) / np.maximum(truth, truth.mean() / 4)) ** 2))
    assert off < 0.015
    assert light.mean() == pytest.approx(truth.mean(), rel=0.005)


def test_nothing_of_the_sky_is_lost():
    """What is left and what was taken out add up to the panorama, pixel by pixel; the lights have
    the spots' flux, and none reaches further than WIDEST from its middle."""
    rng = np.random.default_rng(0)
    pixels = rng.random((128, 256, 3)).astype(np.float32)
    pixels[80, 20:50] *= 1000
    pixels[100:102, 100:103] *= 5000
    rest, spots = split_sky(Sky(pixels))
    total = rest.copy()
    for spot in spots:
        total[spot[:, 0].astype(int), spot[:, 1].astype(int)] += spot[:, 2:]
    np.testing.assert_allclose(total, pixels, rtol=1e-12)
    lights = sky_spots((128, 256), spots)
    taken = ((pixels - rest) * solid_angles(128, 256)[..., None]).sum(axis=(0, 1))
    np.testing.assert_allclose(lights.color.sum(axis=0), taken, rtol=1e-9)
    assert len(lights.color) > 2 and lights.radius.max() <= np.tan(WIDEST) + 1e-9


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.6, 0, 0.8), (-0.8, 0.6, 0), (0, 0.6, -0.8)])
def test_samples_have_the_mean_of_the_pixels(normal):
    """The mean of color · tint · cosine over 2^14 samples is Σ radiance · cosine · dω over the
    parts of pixels, channel by channel, for spots of many colors at the pole, at the horizon and
    between, seen whole or cut by the receiver's own horizon."""
    rng = np.random.default_rng(2)
    pixels = np.zeros((32, 64, 3))
    pixels[31, 5:40] = rng.random((35, 3))
    pixels[15:17, 30:32] = rng.random((2, 2, 3))
    pixels[20:23, 0:2] = rng.random((3, 2, 3))
    row, column = np.nonzero(pixels.any(axis=2))
    lights = sky_spots((32, 64), [np.column_stack([row, column, pixels[row, column]])])
    toward, flux = parts_of(pixels, 24)
    truth = (np.maximum(toward @ normal, 0)[:, None] * flux).sum(axis=0)
    n, found = 1 << 14, 0.0
    for light, color in enumerate(lights.color):
        sample = lights.sample(light, np.zeros((n, 3)), np.tile(normal, (n, 1)), sobol(n, 2, 4))
        found = found + color * (sample.irradiance[:, None] * sample.tint).mean(axis=0)
    np.testing.assert_allclose(found, truth, rtol=5e-3, atol=1e-6 * flux.sum())
