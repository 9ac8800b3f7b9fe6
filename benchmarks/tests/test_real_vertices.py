"""A tiny run of the benchmark of real scenes' vertex colors."""

import numpy as np
import pytest

from benchmarks.real_vertices import measure, noise
from benchmarks.scene_parts import plane_under_white_sky


def test_vertex_colors_of_real_scenes_are_held_against_lightmaps(blender, tmp_path):
    """A plane under a white sky of radiance 0.5 shows 0.4 everywhere; a lightmap of 0.5 is missed by a fifth."""
    plane_under_white_sky("Lightmap")
    blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "plane.blend"))
    light, full = np.full((8, 8, 3), 0.5), np.ones((8, 8), bool)
    np.savez(tmp_path / "plane.npz", a=light, b=light, mask=full, clean=full)
    lines = []
    measure(tmp_path / "plane.blend", [0.1], 2, lines.append)
    asked, seed, _, _, of_all, best, *shown = lines[-1].strip("| ").split(" | ")
    assert (asked, seed) == ("10 %", "1") and float(best) <= float(of_all) < 0.01
    assert [float(each) for each in shown] == pytest.approx([20] * 4, abs=0.01)


def test_the_worst_hundredth_is_told_apart():
    """Of 200 corners alike one is twice as bright as in another bake: it is off by 1 / √2, relative to the mean 1.5."""
    light = np.ones((200, 3))
    other = light.copy()
    light[7] = 2
    of_all, best = noise(light, other, np.ones(200))
    assert of_all == pytest.approx(np.sqrt(1 / 400) / 1.5) and best == 0
