"""Baking again with kept solves: what is used again, when nothing is, and that the light is right.

A room 3 x 2 x 2 m with a block in it, two lamps of different color: direct light with shadow
edges, and more than half of the light by way of the walls (reflectance 0.7).
"""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive.plan import make_plan
from radiosity_addon.solver.adaptive.solve_cache import (
    SOLUTION,
    TRANSPORT,
    Solve,
    SolveCache,
    array_bytes,
    scene_key,
)
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.scene import Material, PointLamp, Sky
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from radiosity_addon.solver.transport import solve_patches
from verification.meshes import areas, box_polygons, grid, triangle_receivers
from verification.meshes import scene as make_scene

ASKED = 0.05
TRUTH = ASKED / 3  # of the bakes that others are compared with: adds a ninth to the square of the error
SETTINGS = Settings(error=ASKED)
ALL = Settings().passes


def room(left=50.0, right=10.0):
    """The room with lamps of these intensities [W/sr], the right one red."""
    walls, _ = box_polygons((3, 2, 2))
    block, _ = box_polygons((0.6, 0.8, 1.0), (1.0, 0.5, 0))
    parts = [grid(wall, 2) for wall in walls] + [grid(side[::-1], 2) for side in block]
    scene = make_scene(parts, reflectance=0.7)
    lamps = (
        PointLamp("Left", np.array([0.5, 1, 1.5]), np.full(3, left), 0.05),
        PointLamp("Right", np.array([2.5, 1, 1.0]), right * np.array([1.0, 0.2, 0.2]), 0.05),
    )
    return replace(scene, lamps=lamps)


def bake(scene, kept=None, divisions=2, settings=SETTINGS):
    return solve(scene, triangle_receivers(scene, divisions), settings, cache=kept)


def relative_error(found, truth) -> float:
    """The project's measure, over the room's surface: each place against itself or a quarter of
    the mean, whichever is brighter."""
    x, t = compose(found, ALL), compose(truth, ALL)
    scene = room()
    area = areas(scene.vertices, scene.triangles)
    area = np.repeat(area, len(t) // len(area))
    mean = t.mean(axis=1)
    level = np.maximum(mean, np.average(mean, weights=area) / 4)[:, None]
    return float(np.sqrt(np.average(((x - t) ** 2 / level**2).mean(axis=1), weights=area)))


@pytest.fixture(scope="module")
def once():
    """What a bake of the room gives, and the pickled cache that kept its solve."""
    empty = SolveCache()
    found = bake(room(), empty)
    assert empty.reused == ""
    return found, pickle.dumps(empty)


@pytest.fixture
def kept(once):
    """A cache with the room's solve, the test's own."""
    return pickle.loads(once[1])


@pytest.fixture
def no_rows(monkeypatch):
    """A function after which a new solve's rays between surfaces are an error."""
    trace = solve_patches.trace_transport

    def refuse(*words):
        if len(words) < 6:
            raise AssertionError("traced between surfaces")
        return trace(*words)  # for the few sides that no ray had met before

    return lambda: monkeypatch.setattr(solve_patches, "trace_transport", refuse)


def test_other_passes_give_what_a_fresh_bake_gives_without_a_solve(no_rows, kept):
    indirect = replace(SETTINGS, passes=("indirect",))
    fresh = bake(room(), settings=indirect)
    no_rows()
    again = bake(room(), kept, settings=indirect)
    for name in ("direct", "indirect", "emission"):
        assert np.array_equal(getattr(fresh, name), getattr(again, name))
    assert "transport" not in again.statistics.seconds
    assert again.statistics.rays < fresh.statistics.rays
    assert again.statistics.estimated_error == fresh.statistics.estimated_error


def test_other_receivers_need_no_solve(no_rows, kept):
    truth = bake(room(), divisions=4, settings=Settings(error=TRUTH))
    no_rows()
    again = bake(room(), kept, divisions=4)
    assert kept.reused == SOLUTION
    assert relative_error(again, truth) < ASKED


def test_other_strengths_and_colors_need_no_rows(no_rows, kept):
    """The lamp that gave a sixth of the light now gives nine tenths of it."""
    truth = bake(room(10, 100), settings=Settings(error=TRUTH))
    no_rows()
    again = bake(room(10, 100), kept)
    assert kept.reused == TRANSPORT
    assert relative_error(again, truth) < ASKED
    assert again.statistics.estimated_error < ASKED
    bake(room(10, 100), kept)
    assert kept.reused == SOLUTION


def test_all_lamps_twice_as_strong_is_twice_the_light_of_other_surfaces(once, kept):
    """Rows and elements are the same and the system is linear: what differs is the direct light's
    statistical error at the elements, far below the asked one."""
    twice = bake(room(100, 20), kept)
    assert twice.indirect.mean() == pytest.approx(2 * once[0].indirect.mean(), rel=ASKED / 5)


def test_strength_of_glowing_faces_is_light():
    scene, kept = room(), SolveCache()
    dim, bright = (
        replace(scene, materials=(Material("Glow", Constant(np.full(3, 0.5)), Constant(value)),
                                  *scene.materials[1:]))
        for value in (np.full(3, 0.1), np.array([0.5, 0.1, 0.1]))
    )  # fmt: skip
    bake(dim, kept)
    bake(bright, kept)
    assert kept.reused == TRANSPORT


PLAN = make_plan(ASKED, 100, True)


def put_one(kept, scene, receivers, seed):
    """Begin a bake and put a solve of PLAN."""
    kept.begin(scene_key(scene, receivers, seed))
    kept.put(kept.key(PLAN), Solve(PLAN, ("one", "other"), 1.0))


def moved(scene):
    lamp = replace(scene.lamps[0], position=np.array([0.5, 1, 1.4]))
    return replace(scene, lamps=(lamp, *scene.lamps[1:]))


CHANGES = {
    "a vertex": lambda s: replace(s, vertices=s.vertices + 1e-6 * (np.arange(3) == 2)),
    "reflectance": lambda s: replace(s, materials=(Material("New"), *s.materials[1:])),
    "a lamp's place": moved,
    "a lamp goes out": lambda s: room(50, 0),
    "a lamp goes away": lambda s: replace(s, lamps=s.lamps[:1]),
    "a sky": lambda s: replace(s, sky=Sky(np.ones((1, 1, 3), np.float32))),
    "shadows": lambda s: replace(s, casts_shadow=np.arange(len(s.objects)) > 0),
    "a lamp's shadows": lambda s: replace(s, lamp_blockers=(np.zeros(0, int),) * len(s.lamps)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_changed_scene_is_solved_again(change):
    scene, kept = room(), SolveCache()
    receivers = triangle_receivers(scene, 1)
    put_one(kept, scene, receivers, 0)
    kept.begin(scene_key(replace(scene), receivers, 0))
    assert kept.get(kept.key(PLAN))
    kept.begin(scene_key(CHANGES[change](scene), receivers, 0))
    assert kept.get(kept.key(PLAN)) is None and not kept.solves


def test_other_seed_and_other_objects_are_solved_again():
    scene, kept = room(), SolveCache()
    receivers = triangle_receivers(scene, 1)
    floor = replace(receivers, triangle=np.zeros_like(receivers.triangle))
    for other in ((scene, receivers, 1), (scene, floor, 0)):
        put_one(kept, scene, receivers, 0)
        kept.begin(scene_key(*other))
        assert kept.get(kept.key(PLAN)) is None and not kept.solves


def test_less_error_is_solved_anew_and_more_is_not(kept):
    bake(room(), kept, settings=Settings(error=2 * ASKED))
    assert kept.reused == SOLUTION
    bake(room(), kept, settings=Settings(error=ASKED / 2))
    assert kept.reused == ""


def test_only_the_finest_is_kept_where_there_is_little_room(kept):
    (key, solve), = kept.solves.items()
    finer = replace(key, plan=replace(key.plan, elements=2 * key.plan.elements))
    kept.put(finer, solve)
    assert list(kept.solves) == [key, finer]
    one = array_bytes(solve)
    assert one > 1e5  # bytes: hundreds of rows of 64 rays
    assert list(kept.shrunk(one).solves) == [finer]
    assert kept.shrunk(one - 1).solves == {}


def test_the_very_solve_is_preferred_else_the_finest():
    """Four times the elements are as fine for any plan; a plan that was solved gets its own. Under
    other lamps its own light would have to be found anew all the same, so that the finest is best."""
    scene, kept = room(), SolveCache()
    receivers = triangle_receivers(scene, 1)
    put_one(kept, scene, receivers, 0)
    fine = replace(PLAN, elements=4 * PLAN.elements)
    kept.put(kept.key(fine), Solve(fine, ("fine", "fine"), 1.0))
    assert kept.get(kept.key(PLAN))[1].plan == PLAN
    assert kept.get(kept.key(replace(PLAN, elements=PLAN.elements + 1)))[1].plan == fine
    assert kept.get(kept.key(replace(fine, row_rays=2 * fine.row_rays))) is None
    kept.begin(scene_key(room(10, 100), receivers, 0))
    assert kept.get(kept.key(PLAN))[1].plan == fine
    kept.put(kept.key(PLAN), Solve(PLAN, ("lit", "lit"), 1.0))
    assert list(kept.solves) == [kept.key(PLAN)]  # those under the other lamps are forgotten
