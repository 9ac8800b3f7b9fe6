"""Only what a scene requires is computed: switched off, the result is the same and costs more."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver import sequence
from radiosity_addon.solver.adaptive.error_estimator import ErrorEstimator
from radiosity_addon.solver.adaptive.estimate import Surface
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.requirements import Requirements
from radiosity_addon.solver.fields import Constant, CornerColors, Texture
from radiosity_addon.solver.gather.lighting import Lighting, points_on_footprints
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.materials.channels import channels_of
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import Material, PointLamp, Sky, SunLamp
from radiosity_addon.solver.solution import compose
from radiosity_addon.solver.transport import solve_patches
from radiosity_addon.solver.transport.places import Places
from radiosity_addon.solver.transport.radiosity import solve_rows
from verification.meshes import box_polygons, box_scene, grid, triangle_receivers
from verification.meshes import scene as make_scene

ALL = Settings().passes
BULB = PointLamp("Bulb", np.array([0.3, 0.4, 0.8]), np.ones(3), 0.1)
SUN = SunLamp("Sun", np.array([0.0, 0.6, -0.8]), np.full(3, 2.0), 0.01)
GRAY_SKY = Sky(np.ones((1, 1, 3), np.float32))
EVERYTHING = Requirements(True, True, True)
TRIES = 5  # of what is timed; the shortest counts


def room(reflectance=0.5, **changes):
    """A unit room of one material with one lamp."""
    scene = box_scene(reflectance=reflectance)
    scene = replace(scene, material=np.zeros_like(scene.material), materials=scene.materials[:1])
    return replace(scene, **{"lamps": (BULB,), **changes})


def furnished(**changes):
    """The room with a block on its floor."""
    walls, _ = box_polygons()
    block, _ = box_polygons((0.3, 0.2, 0.4), (0.5, 0.5, 0))
    parts = [grid(wall, 1) for wall in walls] + [grid(side[::-1], 1) for side in block]
    return replace(make_scene(parts, reflectance=0.5), **{"lamps": (BULB,), **changes})


def floor(**changes):
    """A unit square that faces up."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    return replace(make_scene([grid(corners, 1)], reflectance=0.5), **{"lamps": (), **changes})


def solve(scene, passes=ALL, divisions=8, error=0.03):
    """The baked colors and the figures."""
    settings = Settings(error=error, passes=passes, threads=1)
    found = sequence.solve(scene, triangle_receivers(scene, divisions), settings)
    return compose(found, passes), found.statistics


def apart(one: np.ndarray, two: np.ndarray) -> float:
    """Relative error of one from two, as the project measures it, but that each receiver counts alike."""
    level = np.maximum(two.mean(axis=1), two.mean() / 4)[:, None]
    level = np.where(level > 0, level, 1)
    return float(np.sqrt((((one - two) / level) ** 2).mean()))


COLORS = (
    dict(lamps=(replace(BULB, intensity=np.array([1, 0.9, 1])),)),
    dict(lamps=(replace(SUN, irradiance=np.array([1, 1, 2.0])),)),
    dict(sky=Sky(np.full((4, 8, 3), (1, 1, 1.1), np.float32))),
    dict(materials=(Material("Red", Constant(np.array([0.5, 0.4, 0.4]))),)),
    dict(materials=(Material("Pane", transmittance=Constant(np.array([0.5, 0.5, 0.4]))),)),
    dict(materials=(Material("Back", back=Material("", Constant(np.array([1, 1, 0.0])))),)),
    dict(materials=(Material("Corners", CornerColors(np.tile([[0.5, 0.5, 0.4]], (12, 3, 1)))),)),
)


@pytest.mark.parametrize("changes", COLORS)
def test_one_color_anywhere_takes_three_channels(changes):
    assert channels_of(room()) == 1
    assert channels_of(room(**changes)) == 3


def test_a_single_colored_texel_is_found():
    pixels = np.full((128, 128, 3), 0.5, np.float32)
    picture = Texture(pixels, np.zeros((12, 3, 2), np.float32))
    assert channels_of(room(materials=(Material("Picture", picture),))) == 1
    pixels[77, 31, 1] = 0.6
    assert channels_of(room(materials=(Material("Picture", picture),))) == 3


def test_colors_of_what_is_not_there_do_not_count():
    unused = Material("Unused", Constant(np.array([1, 0, 0.0])))
    assert channels_of(room(materials=(*room().materials, unused))) == 1


@pytest.mark.timed
def test_one_channel_gives_what_three_give_in_less_time(monkeypatch):
    """Rays cost the same; the sums over neighbors, a third as wide, are timed alone, by turns."""
    weigh, seconds = ErrorEstimator.weigh, ([], [])

    def timed(self, halves, left, held_out):
        gray = Surface(
            self.surface.diffuse[:, :1], self.surface.emission[:, :1], self.surface.area
        )
        narrow = [
            Lighting(half.direct[:, :1], half.beams[:, :1], half.points, half.bounced[:, :1], half.first[:, :1],
                     half.rays, half.correction[:, :1])
            for half in halves
        ]  # fmt: skip
        for _ in range(TRIES):
            for judge, some, spent in zip((replace(self, surface=gray), self), (narrow, halves),
                                          seconds):  # fmt: skip
                began = time.process_time()
                verdict = weigh(judge, some, left)
                spent.append(time.process_time() - began)
        return verdict

    scene = furnished(sky=GRAY_SKY)
    one, _ = solve(scene, divisions=24)
    monkeypatch.setattr(ErrorEstimator, "weigh", timed)
    context = build_context(scene, 0, 1, silent, channels=3)
    settings = Settings(error=0.03, threads=1)
    three = compose(
        sequence.solve_opened(context, triangle_receivers(scene, 24), settings), settings.passes
    )
    assert apart(one, three) < 1e-3  # rounding may tip what gets another sample
    assert min(seconds[0]) < 0.9 * min(seconds[1])


@pytest.mark.parametrize(
    ("scene", "passes", "needs"),
    [
        (furnished(sky=GRAY_SKY), ("direct",), (True, True, False)),
        (furnished(), ("direct",), (True, False, False)),
        (furnished(sky=GRAY_SKY), ("emit", "color"), (False, False, False)),
        (room(reflectance=0.0), ALL, (True, False, False)),
        (furnished(lamps=()), ALL, (True, False, False)),
        (box_scene(exitance=1.0, reflectance=0.0), ALL, (True, True, False)),
    ],
)
def test_light_that_is_not_asked_for_or_cannot_be_costs_nothing(scene, passes, needs):
    """The same colors, within the errors asked for, as with everything; fewer rays."""
    context = build_context(scene, 0, 1, silent)
    assert sequence.requirements_of(context, passes) == Requirements(*needs)
    less, statistics = solve(scene, passes)
    options = sequence.Options(requirements=EVERYTHING)
    settings = Settings(error=0.03, passes=passes, threads=1)
    found = sequence.solve_opened(context, triangle_receivers(scene, 8), settings, options)
    more, with_all = compose(found, passes), found.statistics
    assert apart(less, more) < 0.03 * np.sqrt(2)
    assert statistics.rays < with_all.rays
    assert needs[2] or statistics.elements == 0


def test_sides_that_no_light_leaves_get_no_unknowns():
    """The outside of a closed room: half of all sides. With a row for each of them the light is
    the same and costs more rays."""
    scene = furnished()
    context, key = build_context(scene, 0, 1, silent), (0, 1)
    footprints = build_footprints(context.geometry, triangle_receivers(scene, 8))
    everyone = np.arange(footprints.count)
    plan = replace(make_plan(0.03, footprints.count, False), elements=1000)
    few = solve_patches.solve_radiosity(
        context, footprints.count, points_on_footprints(footprints, everyone, 4, *key), None, plan,
        0.03, key,
    )  # fmt: skip
    rays, elements = context.rays, few.patches.elements
    cells = np.flatnonzero(elements.element >= 0)
    middle = elements.corners[cells].astype(float).mean(axis=1)
    every = few
    for front in (True, False):
        sides = Places(cells, elements.triangle[cells], *middle.T, np.full(len(cells), front))
        sides = sides.on(few.patches)
        sides = sides.take(every.unknown[sides.entry])
        every = solve_patches.extended(context, every, sides, (*key, front))
    assert every.transport.count > few.transport.count + 500
    assert context.rays > 1.3 * rays
    again = solve_rows(context, every.patches, every.transport, 0.03)
    known = ~few.unknown
    assert np.abs(again.reflected[known] - few.reflected[known]).max() < 1e-3 * few.reflected.max()
