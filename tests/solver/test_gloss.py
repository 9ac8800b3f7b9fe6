"""Gloss goes on as if matte, and is not baked: exact in a closed furnace."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant, Texture, is_rescaled
from radiosity_addon.solver.materials.evaluate import evaluate_field
from radiosity_addon.solver.materials.region_means import (
    FieldMeans,
    Regions,
    material_means,
    reflectance_means,
    triangle_regions,
)
from radiosity_addon.solver.scene import Material
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from verification import meshes

PASSES = ("emit", "direct", "indirect", "color")


def glossy_box(reflectance: float, diffuse: float):
    """A closed box that glows alike everywhere, of which a part of the reflectance is shown."""
    scene = meshes.box_scene(reflectance=reflectance, exitance=1.0)
    shown = Constant(np.full(3, diffuse))
    return replace(scene, materials=tuple(replace(m, diffuse=shown) for m in scene.materials))


@pytest.mark.parametrize("diffuse", [0.0, 0.5, 0.8])
def test_a_furnace_keeps_what_gloss_mirrors(diffuse):
    """E = 1 and ρ = 0.8 alike everywhere: the irradiance is H = 1 / (1 - ρ) = 5, whatever the diffuse part;
    of it that part is shown, E + ρ_d H."""
    scene = glossy_box(0.8, diffuse)
    solution = solve(scene, meshes.triangle_receivers(scene), Settings(error=0.003))
    np.testing.assert_allclose(solution.direct + solution.indirect, 5.0, rtol=5e-3)
    np.testing.assert_allclose(np.pi * compose(solution, PASSES), 1 + 5 * diffuse, rtol=5e-3)
    np.testing.assert_allclose(compose(solution, ("color",)), diffuse, atol=1e-12)


@pytest.mark.parametrize("extension", ["REPEAT", "CLIP"])
@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_an_offset_is_added_to_a_picture_everywhere(extension, interpolation):
    """At points and in means; also beyond a picture that is clipped, where there is nothing else."""
    pixels = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)
    uv = np.array([[[0, 0], [1, 0], [0, 1]]], np.float32)
    plain = Texture(pixels, uv, extension, interpolation, 0.5)
    raised = replace(plain, offset=np.array([0.1, 0.2, 0.3]))
    place = np.array([[0.3, 0.2], [0.9, 0.05], [1.7, 0.4], [-0.4, 2.2]])
    first = np.zeros(len(place), int)
    one, other = (evaluate_field(field, first, place) for field in (plain, raised))
    np.testing.assert_allclose(other, one + raised.offset, rtol=1e-6)
    sides = np.tile([[0.6, 0.1]], (len(place), 1)), np.tile([[-0.1, 0.5]], (len(place), 1))
    regions = Regions(first, place, *sides, True)
    (one, spread), (other, same) = (FieldMeans(field)(regions) for field in (plain, raised))
    np.testing.assert_allclose(other, one + raised.offset, rtol=1e-6)
    np.testing.assert_allclose(spread, same, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("shared", [True, False])
def test_one_pictures_means_are_looked_for_once(shared):
    """Base · 0.9 is shown and base · 0.7 + 0.2 is sent on: both exact means of a receiver, of one picture
    or of equal ones."""
    pixels = np.random.default_rng(2).random((6, 5, 3)).astype(np.float32)
    uv = np.tile(np.array([[[0, 0], [1, 0], [0, 1]]], np.float32), (12, 1, 1))
    shown = Texture(pixels, uv, "EXTEND", "Closest", np.full(3, 0.9))
    own = pixels if shared else pixels.copy()
    sent = Texture(own, uv, "EXTEND", "Closest", np.full(3, 0.7), offset=np.full(3, 0.2))
    assert is_rescaled(shown, sent) == shared
    material = Material("Coated", sent, diffuse=shown)
    scene = replace(meshes.box_scene(), materials=(material,), material=np.zeros(12, np.int32))
    regions = triangle_regions(np.zeros(1, int), np.array([[[0.1, 0.2], [0.7, 0.1], [0.2, 0.7]]]))
    base, _ = FieldMeans(replace(shown, factor=1.0))(regions)
    diffuse, _ = material_means(scene, "diffuse_reflectance", regions)
    np.testing.assert_allclose(diffuse, 0.9 * base, rtol=1e-12)
    np.testing.assert_allclose(reflectance_means(scene, regions, diffuse), 0.7 * base + 0.2, rtol=1e-7)
