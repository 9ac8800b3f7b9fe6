"""The benchmarks' own arithmetic, and tiny runs of them, so that they cannot rot."""

import numpy as np
import pytest

from benchmarks.error import comparable_texels, reference_noise, relative_error
from benchmarks.ladder import Rung, seconds_for
from benchmarks.materials import matte, point, sky


def test_error_by_hand():
    """Two grey receivers 3 and 1: L̄ = 2, so scales 3 and 2; off by 0.3 and 0.4:
    sqrt((0.1² + 0.2²)/2)."""
    truth = np.array([[3.0, 3, 3], [1, 1, 1]])
    measured = relative_error(truth + [[0.3], [-0.4]], truth)
    assert measured.error == pytest.approx(np.sqrt((0.01 + 0.04) / 2))
    assert measured.uncertainty == 0.0


def test_two_noisy_references_are_unbiased_and_their_uncertainty_is_true():
    """x is 3 % off, the references 20 % each: (x−a)² would say 20 %. 200 repetitions must scatter
    about 0.03² as the stated uncertainty says; their mean lies within 4 standard errors. One bright
    receiver, without noise, lifts L̄ above all others: their scale is L̄ and as good as exact."""
    random = np.random.default_rng(0)
    truth = random.uniform(0.5, 1, (4000, 1)) * np.ones(3)
    truth[0] = 4000.0
    scale = np.maximum(truth, truth.mean())
    noise = 0.2 * scale
    noise[0] = 0.0
    x = truth + 0.03 * scale
    found, stated = [], []
    for _ in range(200):
        a, b = (truth + noise * random.normal(size=(4000, 3)) for _ in range(2))
        measured = relative_error(x, a, b)
        found.append(measured.error**2)
        stated.append(2 * measured.error * measured.uncertainty)
    assert np.mean(found) == pytest.approx(0.03**2, abs=4 * np.std(found) / np.sqrt(200))
    assert np.median(stated) == pytest.approx(np.std(found), rel=0.25)


def test_noise_of_references():
    random = np.random.default_rng(1)
    a, b = (1 + 0.05 * random.normal(size=(10000, 3)) for _ in range(2))
    assert reference_noise(a, b) == pytest.approx(0.05, rel=0.03)


@pytest.mark.parametrize(
    "x, a, message",
    [
        (np.ones((2, 3)), np.ones((3, 3)), "shapes"),
        (np.ones((0, 3)), np.ones((0, 3)), "n >= 1"),
        (np.full((1, 3), np.nan), np.ones((1, 3)), "result has 3 values"),
        (np.ones((1, 3)), np.full((1, 3), np.inf), "reference a has 3 values"),
        (np.ones((1, 3)), np.zeros((1, 3)), "black"),
    ],
)
def test_error_refuses(x, a, message):
    with pytest.raises(ValueError, match=message):
        relative_error(x, a)


def test_comparable_texels_of_a_split_square():
    """Two triangles fill [0, ½]² of a 8² image: of its 16 texels the 4 on the diagonal are shared,
    12 lie in one triangle."""
    uv = np.array([[[0, 0], [0.5, 0], [0.5, 0.5]], [[0, 0], [0.5, 0.5], [0, 0.5]]])
    mask = comparable_texels(uv, 8)
    assert mask.sum() == 12 and mask[:4, :4].sum() == 12
    assert not mask[np.arange(4), np.arange(4)].any()


def rung(seconds, error, method="Cycles"):
    from benchmarks.error import Measured

    return Rung(method, "", seconds, Measured(error, 0.0))


def test_time_for_an_error():
    """From 8 s at 4 % and 32 s at 2 %: 2.83 % takes 16 s; 1 %, beyond the ladder, 32 · (2/1)²."""
    rungs = [rung(8, 0.04), rung(32, 0.02), rung(1, 0.5, "other")]
    assert seconds_for(0.04 / np.sqrt(2), rungs) == pytest.approx(16)
    assert seconds_for(0.01, rungs) == pytest.approx(128)
    assert seconds_for(0.5, rungs) == 8
    assert np.isnan(seconds_for(0.01, rungs, "nobody"))
    stuck = [rung(1, 0.02, "OIDN"), rung(4, 0.02, "OIDN")]
    assert seconds_for(0.01, stuck, "OIDN") == np.inf


def test_cycles_bake_sees_a_furnace_wall_and_leaves_the_file_as_it_was(blender):
    """A plane under a white sky of radiance 0.5: a matte 0.8 reflects 0.4."""
    from benchmarks.cycles import cycles_bake

    bpy = blender
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(matte("Matte", (0.8, 0.8, 0.8)))
    plane.data.uv_layers[0].name = "Radiosity"
    sky((0.5, 0.5, 0.5))
    before = (len(bpy.data.images), len(bpy.data.materials), bpy.context.scene.render.engine)
    pixels, mask, seconds = cycles_bake(plane, 8, 4, passes=("direct", "indirect", "color"))
    assert mask.all() and seconds > 0
    np.testing.assert_allclose(pixels, 0.4, atol=1e-3)
    after = (len(bpy.data.images), len(bpy.data.materials), bpy.context.scene.render.engine)
    assert after == before
    with pytest.raises(ValueError, match="no UV map 'Missing'"):
        cycles_bake(plane, 8, 1, uv_map="Missing")


def test_references_are_kept_until_the_scene_changes(blender, tmp_path, monkeypatch):
    from benchmarks import references

    monkeypatch.setenv("RADIOSITY_REFERENCES", str(tmp_path))
    bpy = blender
    bpy.ops.mesh.primitive_plane_add()
    plane = bpy.context.object
    plane.data.materials.append(matte("Matte", (0.8, 0.8, 0.8)))
    plane.data.uv_layers[0].name = "Radiosity"
    point("Lamp", (0, 0, 1), 10.0, 1.0)
    passes = ("direct", "color")
    first = references.cycles_references(plane, 8, 2, passes)
    again = references.cycles_references(plane, 8, 2, passes)
    assert np.array_equal(first.a, again.a) and not np.array_equal(first.a, first.b)
    assert len(list(tmp_path.iterdir())) == 2
    bpy.data.lights[0].energy *= 2
    references.cycles_references(plane, 8, 2, passes)
    assert len(list(tmp_path.iterdir())) == 4


def test_denoiser_only_where_installed():
    from benchmarks.denoise import available, denoise

    pixels = np.ones((16, 16, 3))
    result = denoise(pixels, np.ones((16, 16), bool))
    assert (result is not None) == available()
