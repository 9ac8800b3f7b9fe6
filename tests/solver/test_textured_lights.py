"""Light of pictures in whole scenes: signs with single lit texels, a ceiling of stripes."""

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant, Texture
from radiosity_addon.solver.materials.emissive_parts import cut
from radiosity_addon.solver.materials.evaluate import evaluate_field
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import Material, Scene
from radiosity_addon.solver.sequence import solve
from verification import exact

BLACK = Constant(np.zeros(3))
SIGN, HEIGHT, LOW = 0.3, 0.5, 0.35  # a sign above the middle of a unit floor: side, height, corner


def quads(corners, materials) -> Scene:
    """Quads (n, 4, 3) of two triangles each, one object and material each."""
    number, n = np.arange(len(corners), dtype=np.int32), len(corners)
    triangles = 4 * np.repeat(number, 2)[:, None] + np.tile([[0, 1, 2], [0, 2, 3]], (n, 1))
    which = np.repeat(number, 2)
    names = tuple(f"o{k}" for k in number)
    return Scene(np.concatenate(corners).astype(float), triangles.astype(np.int32), which, which,
                 materials, names)  # fmt: skip


def sign(pixels, interpolation="Closest", part=(0.0, 1.0)) -> Scene:
    """A glowing quad above a black floor. UV run along x and y over ``part`` of the picture."""
    a, c = LOW, LOW + SIGN
    floor = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    panel = [[a, a, HEIGHT], [a, c, HEIGHT], [c, c, HEIGHT], [c, a, HEIGHT]]
    uv = np.zeros((4, 3, 2), np.float32)
    low, high = part
    uv[2:] = np.array([[[low, low], [low, high], [high, high]],
                       [[low, low], [high, high], [high, low]]])  # fmt: skip
    glow = Texture(np.asarray(pixels, np.float32), uv, "EXTEND", interpolation)
    return quads([floor, panel], (Material("floor", BLACK), Material("sign", BLACK, glow)))


def places_of(scene: Scene, triangles, each: int, seed: int = 0):
    """``each`` small receivers at random places on triangles, and these places (n, 3)."""
    rng, tri = np.random.default_rng(seed), np.repeat(np.asarray(triangles, np.int32), each)
    s, t = rng.random((2, len(tri)))
    s, t = 0.02 + 0.95 * np.where(s + t > 1, [1 - s, 1 - t], [s, t])
    corner = np.array([[0, 0], [0.005, 0], [0, 0.005]])
    corners = np.stack([s, t], 1)[:, None] + corner
    number = np.arange(len(tri), dtype=np.int32)
    middle = corners.mean(axis=1)
    weights = np.column_stack([1 - middle.sum(axis=1), middle])
    where = Receivers(len(tri), number, tri, corners, np.zeros(len(tri), bool))
    return where, np.einsum("nk,nkd->nd", weights, scene.vertices[scene.triangles[tri]])


def from_below(x, lit) -> np.ndarray:
    """(n,) Lambert's factor of a polygon from places that face up."""
    return exact.point_to_polygon(x, np.broadcast_to([0, 0, 1.0], x.shape), np.asarray(lit))


def of_texels(x, levels, edges) -> np.ndarray:
    """(n,) irradiance below squares of radiance ``levels`` (rows, columns) between ``edges`` of the
    sign, in shares of its side."""
    edge, total = LOW + SIGN * np.asarray(edges), 0.0
    for row, column in zip(*np.nonzero(levels)):
        (a, c), (b, d) = edge[[column, column + 1]], edge[[row, row + 1]]
        lit = [(a, b, HEIGHT), (c, b, HEIGHT), (c, d, HEIGHT), (a, d, HEIGHT)]
        total = total + np.pi * levels[row, column] * from_below(x, lit)
    return total


def floor_light(scene: Scene, error: float = 0.01, each: int = 40):
    """(n,) direct light at places on the floor, and the places."""
    where, x = places_of(scene, [0, 1], each)
    settings = Settings(error=error, passes=("direct",))
    return solve(scene, where, settings).direct.mean(axis=1), x


@pytest.mark.parametrize("n, i, j", [(4, 2, 2), (5, 2, 2), (6, 3, 3), (7, 3, 3), (10, 0, 0)])
def test_one_lit_texel_gives_its_light(n, i, j):
    """Texels that fall on no cells' borders: Lambert's factor of the lit square, mean over places
    to a third of the error asked."""
    pixels = np.zeros((n, n, 3))
    pixels[j, i] = 10
    found, x = floor_light(sign(pixels))
    truth = of_texels(x, pixels[..., 0], np.arange(n + 1) / n)
    assert found.mean() == pytest.approx(truth.mean(), rel=0.0034)
    assert np.sqrt(np.mean((found / truth - 1) ** 2)) < 0.02


def test_part_of_a_random_picture():
    """UV from 0.1 to 0.75 of 16²: texels 2 to 11 whole, 1 from 1.6 on. Every seventh glows."""
    rng = np.random.default_rng(1)
    pixels = np.repeat((rng.random((16, 16, 1)) < 0.15) * rng.uniform(5, 20, (16, 16, 1)), 3, 2)
    found, x = floor_light(sign(pixels, part=(0.1, 0.75)))
    edges = (np.array([1.6, *np.arange(2, 13)]) - 1.6) / (12 - 1.6)
    truth = of_texels(x, pixels[1:12, 1:12, 0], edges)
    assert found.mean() == pytest.approx(truth.mean(), rel=0.005)


def test_interpolated_picture():
    """3 × 3 texels, linear, one lit: Lambert's factors of 60² squares of the interpolated values
    in their middles: their means but for the curvature across a twentieth of a texel."""
    pixels = np.zeros((3, 3, 3))
    pixels[1, 2] = 10
    scene = sign(pixels, "Linear")
    middle = (np.arange(60) + 0.5) / 60
    field = scene.materials[1].emission
    v, u = (axis.ravel() for axis in np.meshgrid(middle, middle, indexing="ij"))
    whole = np.array([[[0, 0], [1, 0], [0, 1]]], np.float32)
    own = Texture(field.pixels, whole, "EXTEND", "Linear")
    levels = evaluate_field(own, np.zeros(3600, int), np.stack([u, v], 1))[:, 0]
    levels = levels.reshape(60, 60)
    found, x = floor_light(scene, error=0.003, each=15)
    truth = of_texels(x, levels, np.arange(61) / 60)
    assert found.mean() == pytest.approx(truth.mean(), rel=0.005)


@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
@pytest.mark.parametrize("n", [3, 5, 6, 7, 50])
def test_cells_have_the_power_of_any_picture(n, interpolation):
    """The whole sign's power is the mean of all texels, for interpolated ones too (EXTEND: what
    each texel's hat loses beyond an edge, the edge's repetition gives back)."""
    pixels = np.random.default_rng(n).random((n, n, 3)) ** 8
    cells, _ = cut(sign(pixels, interpolation), np.array([2, 3]), np.full(2, 0.5))
    power = (0.5 * cells.share[:, None] * cells.radiance).sum(axis=0)
    truth = pixels.astype(np.float32).mean(axis=(0, 1), dtype=float)
    np.testing.assert_allclose(power, truth, rtol=1e-9)


def test_a_ceiling_of_stripes():
    """50 stripes, half of each glows, on half of the scene's surface: rays find them. Lambert's
    factors of the stripes, 0.4 below; at 3 % the elements are as wide as several stripes."""
    count, height, level = 50, 0.4, 10.0
    stripes = ((np.arange(10 * count) % 10) < 5) * level
    pixels = np.repeat(np.tile(stripes[None, :, None], (10 * count, 1, 1)), 3, axis=2)
    box = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    up = box + [0, 0, height]
    walls = [[box[k], up[k], up[(k + 1) % 4], box[(k + 1) % 4]] for k in range(4)]
    uv = np.zeros((12, 3, 2), np.float32)
    uv[2:4] = up[::-1][[[0, 1, 2], [0, 2, 3]]][..., :2]
    glow = Texture(np.asarray(pixels, np.float32), uv, "EXTEND", "Closest")
    gray = Material("gray", Constant(np.full(3, 0.5)))
    scene = quads([box, up[::-1], *walls], (gray, Material("c", BLACK, glow), *[gray] * 4))
    where, x = places_of(scene, [0, 1], 150)
    truth = 0.0
    for k in range(count):
        a, c = k / count, (k + 0.5) / count
        stripe = [(a, 0, height), (c, 0, height), (c, 1, height), (a, 1, height)]
        truth = truth + np.pi * level * from_below(x, stripe)
    found = solve(scene, where, Settings(error=0.03))
    direct, light = found.direct.mean(axis=1), (found.direct + found.indirect).mean(axis=1)
    off = np.sqrt(np.mean(((direct - truth) / np.maximum(light, light.mean() / 4)) ** 2))
    assert direct.mean() == pytest.approx(truth.mean(), rel=0.005)
    assert off < 0.025 and off < 1.5 * found.statistics.estimated_error
