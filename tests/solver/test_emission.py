"""Emission that varies over a surface, sampled as lights: against Lambert's formula."""

import zlib
from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.elements.elements import build_elements
from radiosity_addon.solver.fields import Constant, CornerColors, Texture
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.emissive_faces import as_polygons
from radiosity_addon.solver.materials import emissive_parts as cells
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.sampling.sobol import sobol
from radiosity_addon.solver.scene import Material, Scene
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.transport.emission import emission_to_find
from radiosity_addon.solver.transport.patches import Patches
from verification import exact, meshes
from verification.random_scenes import FAMILIES

UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)  # of meshes.grid
PANEL = np.array([[-0.5, -0.5, 1], [-0.5, 0.5, 1], [0.5, 0.5, 1], [0.5, -0.5, 1]])
FLOOR = np.array([[-2.0, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]])
HALF = np.zeros((4, 4, 3), np.float32)
HALF[:, 2:] = 3.0


def panel_over_floor(emission, panel=PANEL, divisions: int = 8) -> Scene:
    """A floor under a glowing black panel, object 0 and 1: nothing is reflected twice."""
    floor, lamp = meshes.grid(FLOOR, divisions), meshes.grid(panel, 1)
    count = len(floor[1])
    return Scene(
        np.concatenate([floor[0], lamp[0]]),
        np.concatenate([floor[1], lamp[1] + len(floor[0])]).astype(np.int32),
        np.array([0] * count + [1] * 2, np.int32), np.array([0] * count + [1] * 2, np.int32),
        (Material("Floor", Constant(np.full(3, 0.5))),
         Material("Panel", Constant(np.zeros(3)), emission)),
        ("Floor", "Panel"),
    )  # fmt: skip


def textured(pixels, scene_triangles: int = 130, **options) -> Texture:
    """A picture on the panel, whose two triangles are the last."""
    uv = np.zeros((scene_triangles, 3, 2), np.float32)
    uv[-2:] = UV
    return Texture(np.asarray(pixels, np.float32), uv, "EXTEND", "Closest", **options)


def floor_light(scene: Scene, error: float = 0.01, **settings):
    """Irradiance (n, 3) at one receiver on each of the floor's triangles, and its solution."""
    receivers = meshes.triangle_receivers(scene)
    solution = solve(scene, receivers, Settings(error=error, **settings))
    floor = scene.object[receivers.triangle] == 0
    return solution.direct[floor], solution


def parts(n: int) -> np.ndarray:
    """(n², 2) barycentric middles of the n² like parts of a triangle: an O(n⁻²) quadrature."""
    i, j = np.mgrid[0:n, 0:n]
    up = np.stack([i + 1 / 3, j + 1 / 3], 2)[i + j < n]
    down = np.stack([i + 2 / 3, j + 2 / 3], 2)[i + j < n - 1]
    return np.concatenate([up, down]) / n


def means_of_lambert(scene: Scene, polygon, radiance: float, n: int = 20) -> np.ndarray:
    """(n,) irradiance of the floor's triangles under a polygon, by n² points in each."""
    corners = scene.vertices[scene.triangles[scene.object == 0]]
    u, v = parts(n).T
    points = np.einsum("kc,ncd->nkd", np.stack([1 - u - v, u, v], 1), corners)
    factor = exact.point_to_polygon(points, np.broadcast_to([0, 0, 1.0], points.shape), polygon)
    return np.pi * radiance * factor.mean(axis=1)


def relative(found: np.ndarray, truth: np.ndarray) -> float:
    """Root mean square of the local relative error."""
    return float(np.sqrt((((found - truth) / np.maximum(truth, truth.mean() / 4)) ** 2).mean()))


def test_constant_picture_is_the_constant():
    """Every texel the same: no cell varies, and the two triangles are one rectangle again."""
    plain, _ = floor_light(panel_over_floor(Constant(np.full(3, 3.0))))
    pictured, _ = floor_light(panel_over_floor(textured(np.full((32, 32, 3), 3.0))))
    np.testing.assert_array_equal(pictured, plain)


def test_constant_corner_colors_are_the_constant():
    plain, _ = floor_light(panel_over_floor(Constant(np.full(3, 3.0))))
    values = np.full((130, 3, 3), 3.0, np.float32)
    found, _ = floor_light(panel_over_floor(CornerColors(values)))
    np.testing.assert_allclose(found, plain, rtol=1e-6)


def test_many_cells_of_a_picture():
    """A sea of 8² texels of random brightness: cells to choose from, against the sum of Lambert's
    formula over the texels. u runs along the panel's first edge, v along its last."""
    pixels = np.random.default_rng(1).uniform(0, 3, (8, 8, 1)) * np.ones(3)
    scene = panel_over_floor(textured(pixels), divisions=4)
    scene = panel_over_floor(textured(pixels, len(scene.triangles)), divisions=4)
    assert build_context(scene, 0, 1, silent).sources.samplers
    found, _ = floor_light(scene, 0.005)
    along, up = (PANEL[1] - PANEL[0]) / 8, (PANEL[3] - PANEL[0]) / 8
    truth = 0.0
    for row, column in np.ndindex(8, 8):
        corner = PANEL[0] + column * along + row * up
        texel = np.array([corner, corner + along, corner + along + up, corner + up])
        truth = truth + means_of_lambert(scene, texel, pixels[row, column, 0], 8)
    assert relative(found[:, 0], truth) < 0.01


def test_half_black_picture_is_half_the_panel():
    """Texels 2 and 3 of 4 along u shine: the panel's half from u = 1/2 on, by Lambert's formula.
    u runs along the panel's first edge, from corner 0 to corner 1."""
    scene = panel_over_floor(textured(HALF))
    middle = (PANEL[0] + PANEL[1]) / 2, (PANEL[3] + PANEL[2]) / 2
    half = np.array([middle[0], PANEL[1], PANEL[2], middle[1]])
    found, solution = floor_light(scene, 0.003)
    truth = means_of_lambert(scene, half, 3.0)
    # What was asked, times two: the most that an estimate may be wrong by.
    assert solution.statistics.estimated_error < 0.003
    assert relative(found[:, 0], truth) < 0.006


@pytest.mark.parametrize("height", [0.03, 0.2])
def test_picture_close_above_the_floor_shows_its_texels(height):
    """Just below a panel the light is that of the texel above: what a mean over the panel, or over
    large cells of it, would lose. Lambert's formula for the shining half again."""
    panel = PANEL * [1, 1, 0] + [0, 0, height]
    scene = panel_over_floor(textured(HALF), panel, 16)
    scene = panel_over_floor(textured(HALF, len(scene.triangles)), panel, 16)
    found, _ = floor_light(scene, 0.005)  # of all the surface, of which the floor is half; and estimates scatter by a third
    half = np.array([(panel[0] + panel[1]) / 2, panel[1], panel[2], (panel[3] + panel[2]) / 2])
    truth = means_of_lambert(scene, half, 3.0)
    assert relative(found[:, 0], truth) < 0.01


@pytest.mark.parametrize("height", [0.02, 0.3, 3.0])
def test_one_cell_of_a_varying_picture(height):
    """A single triangle whose radiance rises from 0 to 2 along u, sampled as one light from a point
    ``height`` above (solid angle and the picture's own value where near, area and its mean where
    far): the mean of 2^16 samples is ∫ L K dA, here by 250,000 points. Their scatter is below 2, so
    that a mean's standard error is below 2/2^8 < 1 %; far away the mean of L replaces L, which
    costs less than 2 % at three times the light's size."""
    values = np.zeros((130, 3, 3), np.float32)
    values[-2:, 1] = 2.0
    scene = panel_over_floor(CornerColors(values))
    context = build_context(scene, 0, 1, silent)
    whole = cells.undivided(np.array([129]), np.full((1, 3), 2 / 3))
    light = as_polygons(context.geometry, replace(whole, deviation=np.ones(1)), scene.object)
    corners = scene.vertices[scene.triangles[129]]
    x = corners.mean(axis=0) + [0.1, 0.05, -height]
    u, v = parts(500).T
    away = np.einsum("kc,cd->kd", np.stack([1 - u - v, u, v], 1), corners) - x
    square = (away**2).sum(axis=1)
    truth = 0.5 * (2 * u * away[:, 2] ** 2 / square**2).mean()
    n = 1 << 16
    position = np.tile(context.geometry.normalized(x), (n, 1))
    sample = light.sample(np.zeros(n, int), position, np.tile([0, 0, 1.0], (n, 1)), sobol(n, 2, 1))
    color = np.tile(light.color[0], (n, 1))
    if sample.surface is not None:
        rows, triangle, uv = sample.surface
        color[rows] = context.emission(triangle, uv) * context.unit
    found = (color * sample.irradiance[:, None]).mean(axis=0)
    assert found == pytest.approx(truth, rel=0.02 if sample.surface is None else 0.01)


def test_no_emission_is_counted_twice():
    """A textured panel is wholly explicit: rays must bring nothing of it, so its light on the
    floor is all in the shadow rays' part, and the table of gathered emission is not made."""
    context = build_context(panel_over_floor(textured(HALF)), 0, 1, silent)
    assert context.explicit[-2:].all() and not context.explicit[:-2].any()
    elements = build_elements(context.geometry, context.scene.object, 200)
    assert emission_to_find(context, elements) == (None, None)


def test_large_picture_met_by_rays_shows_its_parts():
    """A panel as large as the floor, half of it shining: a quarter of the scene, left to rays.
    They find the cells' own emission, not their triangle's mean: Lambert's formula for the half."""
    panel = PANEL * [4, 4, 1]
    scene = panel_over_floor(textured(HALF), panel)
    assert not build_context(scene, 0, 1, silent).explicit.any()
    half = np.array([(panel[0] + panel[1]) / 2, panel[1], panel[2], (panel[3] + panel[2]) / 2])
    found, _ = floor_light(scene, 0.01)
    assert relative(found[:, 0], means_of_lambert(scene, half, 3.0)) < 0.02


def test_cells_keep_the_power():
    """Cells tile the triangle: shares and power add up to those of the picture, whatever is cut."""
    pixels = np.random.default_rng(0).uniform(0, 1, (64, 64, 3)) ** 4
    scene = panel_over_floor(textured(pixels))
    found, glowing = cells.cut(scene, np.array([128, 129]), np.full(2, 0.5))
    np.testing.assert_allclose(np.bincount(found.triangle - 128, found.share), 1, rtol=1e-12)
    power = (found.share[:, None] * found.radiance).sum(axis=0) * 0.5
    # Cells of the finest level are as large as half a texel; those on the diagonal are shared.
    np.testing.assert_allclose(power, pixels.mean(axis=(0, 1)), rtol=0.01)
    level = pixels.mean(axis=2)
    assert glowing.mean() == pytest.approx(level.mean() ** 2 / (pixels**2).mean(), rel=0.1)


def test_dark_parts_are_no_lights():
    """One shining texel of 16²: all lights lie in it, and none elsewhere."""
    pixels = np.zeros((16, 16, 3))
    pixels[3, 12] = 1.0
    scene = panel_over_floor(textured(pixels))
    found, glowing = cells.cut(scene, np.array([128, 129]), np.full(2, 0.5))
    middle = UV[found.triangle - 128]
    place = np.einsum("nk,nkd->nd", np.stack([1 - found.corners.mean(axis=1).sum(axis=1),
                      *found.corners.mean(axis=1).T], 1), middle)  # fmt: skip
    assert np.all(np.abs(place - [12.5 / 16, 3.5 / 16]) <= 0.5 / 16)
    # A panel with 1/256 of its area shining counts as that much; one triangle has all of it.
    assert glowing.max() == pytest.approx(2 / 256, rel=0.05)


def test_large_pictures_with_small_bright_parts_are_lights():
    """The whole floor carries a picture that is black but for a spot: still sampled."""
    pixels = np.zeros((64, 64, 3))
    pixels[30:34, 30:34] = 5.0
    scene = panel_over_floor(textured(pixels), PANEL * [4, 4, 1])
    context = build_context(scene, 0, 1, silent)
    assert context.explicit[-2:].all()
    bright = panel_over_floor(textured(np.full((64, 64, 3), 5.0)), PANEL * [4, 4, 1])
    assert not build_context(bright, 0, 1, silent).explicit.any()


def test_the_dark_half_of_a_picture_does_not_vary():
    """Of a wall's picture one triangle is black. Its deviation was 1e-8 by rounding where its mean was 0, and bakes failed, as
    rays that came near it looked for light in a table that was not there."""
    random = np.random.default_rng([zlib.crc32(b"pictures"), 27])
    context = build_context(FAMILIES["pictures"](random)[1], 0, 1, silent)
    patches = Patches(build_elements(context.geometry, context.scene.object, 400))
    assert emission_to_find(context, patches) == (None, None)
