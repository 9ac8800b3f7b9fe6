"""Patches that light varies inside, of which a part is seen: rays end on none of them."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.placed_receivers import placed
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.scene import Sky, SunLamp
from radiosity_addon.solver.sequence import open_scene
from radiosity_addon.solver.transport.solve_patches import varied_patches
from verification import meshes
from verification.build import Build
from verification.comparable_texels import texel_receivers

LENGTH, WIDTH, HEIGHT = 4.0, 2.0, 2.5  # of a room [m]
DEPTH, PIECES = 0.12, 10  # of a groove along its ceiling [m], and of all that is in it: number


def room_with_a_groove():
    """A strip of light in a groove: ten glowing bars, 60 quads, between sides one patch high."""
    build = Build()
    wall, glow = build.material(0.65), build.material(0.8, 25.0)
    build.room((LENGTH, WIDTH, HEIGHT), wall, wall, wall, skip=(5,))
    top, low, high = HEIGHT + DEPTH, 0.96, 1.04
    for x, end in zip(*(np.linspace(0, LENGTH, PIECES + 1)[part] for part in (slice(-1), slice(1, None)))):
        for near, far in ((0, low), (high, WIDTH)):
            build.quad([(x, near, HEIGHT), (x, far, HEIGHT), (end, far, HEIGHT), (end, near, HEIGHT)], wall)
        build.quad([(x, low, top), (x, high, top), (end, high, top), (end, low, top)], wall)
        build.quad([(x, low, HEIGHT), (x, low, top), (end, low, top), (end, low, HEIGHT)], wall)
        build.quad([(end, high, HEIGHT), (end, high, top), (x, high, top), (x, high, HEIGHT)], wall)
        build.box((x + 0.01, 0.985, top - 0.035), (end - 0.01, 1.015, top - 0.025), glow)
    far = 20.0
    build.quad([(-far, -far, -1), (far, -far, -1), (far, far, -1), (-far, far, -1)], wall)  # dark, most of the surface
    return build.scene()


def test_beside_a_lamp_of_many_faces_light_varies():
    """From the rim to the height of the lamp the light of a groove's sides grows many times over. Two points of such a
    patch differ less by that than by which of the lamp's faces was chosen; still most of these patches are known to vary."""
    scene = room_with_a_groove()
    receivers = meshes.triangle_receivers(scene, 2)
    context = open_scene(scene, receivers, Settings(threads=1))
    own = placed(context, receivers).patches(1000)
    varied, _ = varied_patches(context, own, make_plan(0.03, receivers.count, True), 0.03, (0, 1))
    corners = scene.vertices[scene.triangles[own.footprints.triangle[own.footprints.start[:-1]]]]
    width = np.ptp(corners, axis=1)
    sides = (corners[:, :, 2].max(axis=1) > HEIGHT + 0.9 * DEPTH) & (width[:, 1] < 1e-6) & (width[:, 2] > 0.9 * DEPTH)
    assert sides.sum() == 2 * PIECES * 2 * 4 and varied[sides].mean() > 0.75


SIDE, LOW, HIGH = 8, 0.31, 0.69  # texels along each side of a floor, and what lies over the floor between these [m]
SUN = {"lamps": (SunLamp("Sun", np.array([0, 0, -1.0]), np.ones(3)),)}
SKY = {"sky": Sky(np.ones((1, 1, 3), np.float32))}


@pytest.mark.parametrize(("glow", "outside"), [(0.0, SUN), (20.0, SUN), (0.0, SKY), (20.0, SKY)])
def test_rays_read_no_texel_of_which_something_covers_a_part_that_is_lit_otherwise(glow, outside):
    """A floor under sun or sky, and a finger's width above it a board, dark or glowing: of the texels under its rim, rays
    from above see the part alone that lies outside."""
    build = Build()
    build.quad([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], build.material(0.5))
    build.quad([(LOW, LOW, 0.01), (LOW, HIGH, 0.01), (HIGH, HIGH, 0.01), (HIGH, LOW, 0.01)], build.material(0.0, glow))
    scene = replace(build.scene(), **outside)
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1.0]]])
    receivers = texel_receivers(uv, np.arange(2), SIDE)
    context = open_scene(scene, receivers, Settings(threads=1))
    own = placed(context, receivers).patches(16)
    plan = make_plan(0.03, receivers.count, True)
    geometry = context.geometry
    texel = np.floor(SIDE * (own.footprints.middle()[0] * geometry.scale + geometry.center))[:, :2]
    low, high = int(LOW * SIDE), int(HIGH * SIDE)
    inside = ((texel >= low) & (texel <= high)).all(axis=1)
    within = ((texel > low) & (texel < high)).all(axis=1)
    for seed in range(4):
        varied, _ = varied_patches(context, own, plan, 0.03, (seed, 1))
        kept = np.count_nonzero(inside & ~within & ~varied)
        assert kept <= (0 if glow else 1) and not varied[~inside].any(), seed  # a dark corner's share is below a tenth of 3 %
