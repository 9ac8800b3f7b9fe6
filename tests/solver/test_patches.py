"""Patches: what receivers and elements make of the surface, and what rays read of them."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requests import build_replicate
from radiosity_addon.solver.elements.elements import build_elements
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import SunLamp
from radiosity_addon.solver.transport.lit_patches import light_receivers
from radiosity_addon.solver.transport.patches import Patches
from radiosity_addon.solver.transport.receiver_patches import (
    build_receiver_patches,
    squares_of_texels,
)
from radiosity_addon.solver.transport.solve_patches import varied_patches
from verification import meshes
from verification.comparable_texels import texel_receivers

UV = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
FLOOR = meshes.polygon(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]))


def patches_of(scene, receivers, largest=np.inf):
    context = build_context(scene, 0, 1, silent)
    footprints = build_footprints(context.geometry, receivers)
    own = build_receiver_patches(
        receivers, footprints, scene.object, context.geometry.area, largest, None
    )
    elements = build_elements(context.geometry, np.zeros(len(scene.triangles), int), 4)
    return Patches(elements, own), footprints


def places(count: int):
    """Of the unit square: (n,) triangle, u, v, and the texel row · 8 + column that each lies in."""
    x, y = np.random.default_rng(0).random((2, count))
    lower = x > y
    u, v = np.where(lower, x - y, x), np.where(lower, y, y - x)
    texel = (y * 8).astype(int) * 8 + (x * 8).astype(int)
    return np.where(lower, 0, 1).astype(np.int32), u.astype(np.float32), v.astype(np.float32), texel


def test_each_texel_of_a_plane_is_a_patch_on_either_side():
    scene = meshes.scene([FLOOR])
    receivers = texel_receivers(UV, np.arange(2), 8)
    patches, footprints = patches_of(scene, receivers)
    assert patches.first == 2 * 64
    triangle, u, v, texel = places(500)
    grid = receivers.grid[:, 1] * 8 + receivers.grid[:, 2]
    front = patches.at(triangle, u, v, np.ones(500, bool))
    back = patches.at(triangle, u, v, np.zeros(500, bool))
    assert np.array_equal(grid[front], texel)
    assert np.array_equal(back, front + 64)
    assert np.array_equal(patches.of(front), front)


def test_receivers_larger_than_elements_are_left_to_these():
    scene = meshes.scene([FLOOR])
    patches, footprints = patches_of(scene, texel_receivers(UV, np.arange(2), 2), largest=0.01)
    assert patches.receivers is None and patches.first == 0
    triangle, u, v, _ = places(50)
    entry = patches.at(triangle, u, v, np.ones(50, bool))
    assert patches.somewhere(entry).all()
    assert (patches.element_of(patches.of(entry)) >= 0).all()


def test_a_receiver_is_no_patch_of_more_than_its_own_place():
    """A receiver of a hundredth of a triangle says nothing of the rest of it."""
    scene = meshes.scene([FLOOR])
    receivers = meshes.triangle_receivers(scene, 10)
    first = receivers.receiver == 0
    small = Receivers(1, receivers.receiver[first], receivers.triangle[first],
                      receivers.corners[first], receivers.square[first], None)  # fmt: skip
    patches, _ = patches_of(scene, small)
    triangle, u, v, _ = places(100)
    entry = patches.at(triangle, u, v, np.ones(100, bool))
    assert (patches.element_of(patches.of(entry)) >= 0).all()


def test_a_texel_around_a_corner_is_a_patch_for_each_way_that_it_faces():
    """The floor and a wall in one texel each: their halves of it share none."""
    wall = meshes.polygon(np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]))
    scene = meshes.scene([FLOOR, wall])
    uv = np.concatenate([UV * [0.5, 1], UV * [0.5, 1] + [0.5, 0]])
    patches, footprints = patches_of(scene, texel_receivers(uv, np.arange(4), 1))
    middle, front = np.full(4, 0.3, np.float32), np.ones(4, bool)
    entry = patches.at(np.arange(4, dtype=np.int32), middle, middle, front)
    assert footprints.count == 1 and patches.receivers.footprints.count == 2
    assert entry[0] == entry[1] != entry[2] == entry[3]


def test_tables_have_the_values_of_patches():
    scene = meshes.scene([FLOOR, meshes.grid(np.array([[0.0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]), 2)])
    patches, _ = patches_of(scene, texel_receivers(UV, np.arange(2), 8))
    values = np.arange(patches.count, dtype=np.float32)[:, None]
    table = patches.table(values, np.float32(-1))
    assert len(table) == patches.entries
    triangle, u, v, _ = places(200)
    for triangle in (triangle, triangle + 2):
        for front in (True, False):
            entry = patches.at(triangle, u, v, np.full(200, front))
            assert np.array_equal(table[entry, 0], patches.of(entry))
    assert table[patches.miss] == table[patches.onward] == -1


def test_what_receivers_gather_is_read_by_the_numbers_of_rays():
    """A row of 8 rays brought 1, 24 gathered rays brought 5: (8 · 1 + 24 · 5) / 32 = 4."""
    scene = meshes.scene([FLOOR], reflectance=0.5)
    receivers = texel_receivers(UV, np.arange(2), 8)

    class Asked:
        seed, passes, target_error = 0, ("direct", "indirect"), 0.03

    replicate = build_replicate(scene, receivers, Asked(), 1)
    own = replicate.placed.patches(10)
    patches = Patches(build_elements(replicate.context.geometry, np.zeros(2, int), 4), own)

    class Solved:
        samples = type("Samples", (), {"patch_rays": 8})

    from radiosity_addon.solver.transport.radiosity import Radiosity

    before = np.ones((patches.entries, 1), np.float32)
    radiosity = Radiosity(
        patches, before, None, None, np.zeros(patches.entries, bool), Solved(), before[:0], 0, 0.0,
        0.0, 0.03,
    )
    some = np.array([3, 7])
    found = radiosity.with_gathered(before[: patches.first], some, np.full((2, 1), 5.0), np.full(2, 24.0))
    changed = np.flatnonzero(found.reflected[:, 0] != 1)
    assert np.array_equal(changed, own.patch[some])
    assert found.reflected[changed, 0] == pytest.approx(4.0)


def test_no_ray_ends_on_patches_that_are_left_out():
    scene = meshes.scene([FLOOR])
    patches, _ = patches_of(scene, texel_receivers(UV, np.arange(2), 8))
    varied = np.arange(64) % 3 == 0
    fewer = replace(patches, receivers=patches.receivers.without(varied))
    triangle, u, v, _ = places(500)
    for front in (True, False):
        before, after = (
            each.at(triangle, u, v, np.full(500, front)) for each in (patches, fewer)
        )
        gone = varied[before % 64]
        assert (after[gone] == patches.onward).all() and np.array_equal(after[~gone], before[~gone])


def test_the_only_patches_of_a_texel_around_a_corner_may_be_left_out():
    wall = meshes.polygon(np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]))
    uv = np.concatenate([UV * [0.5, 1], UV * [0.5, 1] + [0.5, 0]])
    patches, _ = patches_of(meshes.scene([FLOOR, wall]), texel_receivers(uv, np.arange(4), 1))
    fewer = replace(patches, receivers=patches.receivers.without(np.array([True, False])))
    middle, front = np.full(4, 0.3, np.float32), np.ones(4, bool)
    before, after = (
        each.at(np.arange(4, dtype=np.int32), middle, middle, front) for each in (patches, fewer)
    )
    assert np.array_equal(after, np.where(before == 0, patches.onward, before))


def test_what_is_left_when_varied_patches_go_is_as_bright_as_it_is():
    """A floor that a sun lights through a comb, in stripes narrower than a texel. Where patches are left
    out by other points than those that light them, the light of those left is what it is at many points."""
    bars = [[[x, 0, 1], [x + 0.1125, 0, 1], [x + 0.1125, 1, 1], [x, 1, 1]] for x in np.arange(8) / 8]
    scene = meshes.scene([FLOOR, *(meshes.polygon(np.array(bar, float)) for bar in bars)])
    scene = replace(scene, lamps=(SunLamp("Sun", np.array([0, 0, -1.0]), np.ones(3)),))
    context = build_context(scene, 0, 1, silent)
    receivers = texel_receivers(UV, np.arange(2), 64)
    footprints = build_footprints(context.geometry, receivers)
    own = build_receiver_patches(
        receivers, footprints, scene.object, context.geometry.area, np.inf, None
    )
    plan = replace(make_plan(0.03, footprints.count, True), patch_points=2)
    left, light = [], []
    for seed in range(8):
        varied, _ = varied_patches(context, own, plan, 0.003, (seed,))
        lit = light_receivers(context, own.footprints, 2, (seed, 9)).lit.mean(axis=1)
        left.append(~varied)
        light.append(lit)
    truth = light_receivers(context, own.footprints, 64, (99,)).lit.mean(axis=1)
    found, true = ((np.array(left) * each).sum() for each in (np.array(light), truth))
    assert 0.05 < np.mean(left) < 0.99
    assert found == pytest.approx(true, rel=0.04)


def test_a_place_finds_its_texel_on_triangles_that_hold_no_whole_one():
    """Forty small triangles in places of their own, turned and crossing texels' borders."""
    random = np.random.default_rng(3)
    count, size = 40, 64
    middle = (np.stack([np.arange(count) % 8, np.arange(count) // 8], 1) + 0.5) * 8
    uv = (middle[:, None] + random.uniform(-1.5, 1.5, (count, 3, 2))) / size
    flat = np.concatenate([uv, np.zeros((count, 3, 1))], 2)
    scene = meshes.scene([(flat.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))])
    receivers = texel_receivers(uv, np.arange(count), size)
    patches, _ = patches_of(scene, receivers)
    u, v = random.random((2, 2000))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    triangle = random.integers(0, count, 2000).astype(np.int32)
    place = uv[triangle, 0] + u[:, None] * (uv[triangle, 1] - uv[triangle, 0])
    place += v[:, None] * (uv[triangle, 2] - uv[triangle, 0])
    entry = patches.at(triangle, u.astype(np.float32), v.astype(np.float32), np.ones(2000, bool))
    found = entry < patches.first
    texel = receivers.grid[entry[found], :0:-1]
    assert found.mean() > 0.99  # the rest lies on slivers that no texel has
    assert (texel == np.floor(place[found] * size)).all(axis=1).mean() > 0.999


def test_a_texel_says_nothing_of_a_triangle_of_which_it_has_no_part():
    """Of the texels along the diagonal the upper triangle's parts are cut away, as what is buried is:
    rays that end there do not read the lower one's light."""
    scene = meshes.scene([FLOOR])
    receivers = texel_receivers(UV, np.arange(2), 8)
    diagonal = receivers.grid[:, 1] == receivers.grid[:, 2]
    kept = ~(diagonal[receivers.receiver] & (receivers.triangle == 1))
    less = replace(receivers, **{
        name: getattr(receivers, name)[kept]
        for name in ("receiver", "triangle", "corners", "square")
    })  # fmt: skip
    patches, _ = patches_of(scene, less)
    triangle, u, v, texel = places(2000)
    entry = patches.at(triangle, u, v, np.ones(2000, bool))
    away = (triangle == 1) & (texel // 8 == texel % 8)
    assert away.any() and (entry[away] == patches.onward).all()
    grid = receivers.grid[:, 1] * 8 + receivers.grid[:, 2]
    assert np.array_equal(grid[entry[~away]], texel[~away])


def test_a_flat_texel_of_many_triangles_is_one_patch():
    """Wherever it lies: none is divided by where cells of space end."""
    scene = meshes.scene([meshes.grid(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), 24)])
    corners = 0.013 + 0.97 * scene.vertices[scene.triangles][:, :, :2]
    patches, footprints = patches_of(scene, texel_receivers(corners, np.arange(len(corners)), 17))
    assert footprints.count == 17 * 17 and len(footprints.triangle) > 4 * 17 * 17
    assert np.array_equal(patches.receivers.patch, np.arange(17 * 17))


def test_a_piece_of_a_face_is_found_where_another_was_cut():
    """Sixteen pieces of a triangle, of which one is cut in three parts, as where something stands on it."""
    scene = meshes.scene([FLOOR])
    whole = meshes.triangle_receivers(scene, 4)
    a, b, c = whole.corners[5]
    middle = (a + b + c) / 3
    parts = np.array([[a, b, middle], [b, c, middle], [c, a, middle]])
    number = np.insert(whole.receiver, 5, [5, 5])
    corners = np.concatenate([whole.corners[:5], parts, whole.corners[6:]])
    triangle = whole.triangle[number]
    cut = Receivers(whole.count, number, triangle, corners, np.zeros(len(number), bool))
    triangle, u, v, _ = places(1000)
    front = np.ones(1000, bool)
    expected, found = (patches_of(scene, each)[0].at(triangle, u, v, front) for each in (whole, cut))
    assert np.array_equal(expected, found) and len(np.unique(found)) == 32


def test_squares_of_very_many_texels_are_patches_together():
    """Of a floor of 8 × 8 texels with a wall that stands on the fourth row: pairs of pairs are one patch, and of the
    wall's own texels each is one as well as what is beside these."""
    receivers = texel_receivers(UV, np.arange(2), 8)
    assert receivers.count == 64 and squares_of_texels(receivers, None, 64).max() == 15
    row = receivers.grid[:, 1]
    square = squares_of_texels(receivers, row == 3, 64)
    scene = meshes.scene([FLOOR])
    context = build_context(scene, 0, 1, silent)
    footprints = build_footprints(context.geometry, receivers)
    own = build_receiver_patches(
        receivers, footprints, scene.object, context.geometry.area, np.inf, None, square
    )
    sizes = np.bincount(own.patch)
    assert np.array_equal(sizes[own.patch[row == 3]], np.ones(8))
    assert np.array_equal(sizes[own.patch[row == 2]], np.full(8, 2))
    assert np.array_equal(np.sort(sizes), [1] * 8 + [2] * 4 + [4] * 12)
    assert own.footprints.area == pytest.approx(sizes / 64, rel=1e-4)
    triangle, u, v, texel = places(500)
    receiver = np.zeros(64, int)
    receiver[receivers.grid[:, 1] * 8 + receivers.grid[:, 2]] = np.arange(64)
    front = own.at(triangle, u, v, np.ones(500, bool))
    assert np.array_equal(front, own.patch[receiver[texel]])
    assert np.array_equal(own.at(triangle, u, v, np.zeros(500, bool)), front + 24)
    some = np.flatnonzero(row < 3)
    complete = own.are_patches(some)
    assert np.array_equal(np.flatnonzero(complete), np.unique(own.patch[some]))
    assert not own.are_patches(some[1:])[own.patch[some[0]]]
