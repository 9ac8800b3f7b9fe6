"""The exported file in its real consumer: three.js shows what Blender shows."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("bpy")
sys.path.insert(0, str(Path(__file__).parent))

import browser  # noqa: E402
import crate_scene  # noqa: E402

from radiosity_addon.solver.fields import srgb_to_linear  # noqa: E402
from tests.one_core import main  # noqa: E402

pytestmark = pytest.mark.skipif(bool(browser.missing()), reason=browser.missing())
LIGHT = "direct,indirect"
EVERYTHING = "emit,direct,indirect,color"


@pytest.mark.parametrize("passes", [EVERYTHING, LIGHT])
@pytest.mark.parametrize("target", ["vertex", "image"])
def test_three_shows_the_pixels_of_blender(blender, tmp_path, target, passes):
    """Within 2 % in the root mean square over pixels, in the mean (which a wrong factor of π, a
    curve too many or a picture upside down misses by far) within 1 %.

    Compared are pixels that neither picture cuts at 1, away from edges, where anti-aliasing
    differs: those whose 3 × 3 neighbors in Blender's picture lie within 15 % of them. A pixel is
    judged against itself, but against a quarter of the mean at least.
    """
    crate_scene.build(blender, tmp_path / "scene.blend")
    glb, baked = tmp_path / "scene.glb", tmp_path / "baked.blend"
    status = main([
        str(tmp_path / "scene.blend"), "--target", target, "--passes", passes, "--quality", "draft",
        "--resolution", "256", "--output", str(baked), "--export", str(glb),
    ])  # fmt: skip
    assert status == 0
    shown = _pixels(blender, browser.picture(glb, *crate_scene.SIZE), tmp_path)
    blender.ops.wm.open_mainfile(filepath=str(baked))
    truth = crate_scene.rendered(
        blender,
        lambda item: crate_scene.glow(blender, item, target == "image", passes == EVERYTHING),
        tmp_path,
    )
    judged = _away_from_edges(truth) & (truth.max(-1) < 0.98) & (truth.max(-1) > 0)
    assert judged.mean() > 0.4
    against = np.maximum(truth.mean(-1), 0.25 * truth[judged].mean())[..., None]
    off = ((shown - truth) / against)[judged]
    print(f"{target} {passes}: rms {np.sqrt((off**2).mean()):.4f} mean {off.mean():.5f} "
          f"judged {judged.mean():.2f}")  # fmt: skip
    assert np.sqrt((off**2).mean()) < 0.02
    assert abs(off.mean()) < 0.01


def _pixels(bpy, png: bytes, folder: Path) -> np.ndarray:
    """(height, width, 3) linear, bottom row first."""
    path = folder / "three.png"
    path.write_bytes(png)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(crate_scene.SIZE[0] * crate_scene.SIZE[1] * 4, np.float32)
    image.pixels.foreach_get(pixels)
    return srgb_to_linear(pixels.reshape(crate_scene.SIZE[1], crate_scene.SIZE[0], 4)[..., :3].astype(float))


def _away_from_edges(truth: np.ndarray) -> np.ndarray:
    padded = np.pad(truth, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = truth.shape[:2]
    near = [padded[y : y + height, x : x + width] for y in range(3) for x in range(3)]
    spread = np.max(near, axis=0) - np.min(near, axis=0)
    return (spread <= 0.15 * np.maximum(truth, 1e-3)).all(-1)
