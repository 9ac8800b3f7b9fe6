"""Parts of one color: pictures of nearest texels cut along their texels' borders."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.fields import Texture
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.materials.emissive_parts import cut
from radiosity_addon.solver.materials.texture_blocks import MOST_BLOCKS, one_colored_parts
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import Material
from tests.solver.test_textured_lights import BLACK, sign

HALVES = np.array([[[0, 0], [0, 1], [1, 1]], [[0, 0], [1, 1], [1, 0]]], np.float32)


def areas(parts: np.ndarray) -> np.ndarray:
    """(m,) of barycentric triangles (m, 3, 2), in shares of the whole."""
    return np.abs(np.linalg.det(parts[:, 1:] - parts[:, :1]))


@pytest.mark.parametrize("extension, shift", [
    ("EXTEND", 0.0), ("CLIP", 0.0), ("REPEAT", -3.0), ("MIRROR", 2.0),
])  # fmt: skip
def test_parts_tile_what_shines(extension, shift):
    """A picture of two colors beside black, wherever its repetitions lie: each color's area is
    that of its texels, 2/25 and 6/25 of the quad, 2 and 2 times as much of a triangle in sum."""
    pixels = np.zeros((5, 5, 3), np.float32)
    pixels[1, 2:4] = 7
    pixels[2:4, 1:4] = 3
    field = Texture(pixels, HALVES + np.float32(shift), extension, "Closest")
    found = [one_colored_parts(field, triangle) for triangle in (0, 1)]
    parts, colors = (np.concatenate(arrays) for arrays in zip(*found))
    for color, texels in ((7, 2), (3, 6)):
        mine = colors[:, 0] == color
        assert areas(parts)[mine].sum() / 2 == pytest.approx(texels / 25, rel=1e-6)
    assert (parts >= -1e-9).all() and (parts.sum(axis=2) <= 1 + 1e-9).all()
    assert set(colors[:, 0]) == {3, 7}


def test_many_colors_are_left_to_other_cells():
    """More parts than MOST_BLOCKS, or a triangle that is a line in the picture: None."""
    noise = np.random.default_rng(0).random((12, 12, 3)).astype(np.float32)
    assert 12 * 12 / 2 > MOST_BLOCKS
    assert one_colored_parts(Texture(noise, HALVES, "EXTEND", "Closest"), 0) is None
    line = np.array([[[0, 0], [1, 1], [0.5, 0.5]]], np.float32)
    assert one_colored_parts(Texture(noise[:2], line, "EXTEND", "Closest"), 0) is None


def test_a_lit_texel_is_one_rectangle():
    """A lit texel inside one half of a sign is one light of its four corners: area 0.3²/25, exact
    as a constant face is. One on the diagonal is two triangles of that area, or their rectangle."""
    for row, column in ((1, 3), (2, 2)):
        pixels = np.zeros((5, 5, 3))
        pixels[row, column] = 10
        context = build_context(sign(pixels), 0, 1, silent)
        (lights,) = context.sources.batches
        area = lights.area * context.geometry.scale**2
        assert len(lights.color) == 1 and len(context.sources.always) == 1
        assert area.sum() == pytest.approx(0.09 / 25, rel=1e-5)
        assert (lights.triangle == -1).all()


def test_a_strip_of_lamps_is_a_few_lights():
    """256 × 4 texels of which every 16th column glows: 16 rectangles that the quad's diagonal cuts
    into 2 triangles and 2 quadrilaterals at most, in place of thousands of cells; all the power."""
    pixels = np.zeros((4, 256, 3))
    pixels[:, 8::16] = 200
    cells, _ = cut(sign(pixels), np.array([2, 3]), np.full(2, 0.5))
    assert len(cells.triangle) <= 16 * 6
    assert (cells.deviation == 0).all() and (cells.radiance == 200).all()
    assert (0.5 * cells.share).sum() == pytest.approx(1 / 16, rel=1e-6)


def test_encoded_and_tinted_parts():
    """Texels are decoded and multiplied by the factor: 0.5 in sRGB is 0.2140411."""
    scene = sign(np.kron(np.eye(2), [[1]])[..., None] * np.full(3, 0.5))
    field = scene.materials[1].emission
    tinted = Texture(field.pixels, field.uv, "EXTEND", "Closest", np.array([2.0, 1, 0]), True)
    scene = replace(scene, materials=(scene.materials[0], Material("sign", BLACK, tinted)))
    cells, _ = cut(scene, np.array([2, 3]), np.full(2, 0.5))
    truth = [2 * 0.2140411, 0.2140411, 0]
    np.testing.assert_allclose(cells.radiance, np.tile(truth, (len(cells.radiance), 1)), rtol=1e-5)
