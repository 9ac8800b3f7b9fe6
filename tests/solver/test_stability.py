"""The rows of docs/stability.md (the slow ones with ``-m slow``), and what it says of bad input."""

from dataclasses import replace

import numpy as np
import pytest

from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant, CornerColors, Texture
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import AreaLamp, PointLamp, Sky, SunLamp
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from verification import meshes
from verification.stability_cases import CASES
from verification.stability_scenes import ALL, lamp_room, only, quad, radiosity, walls

NO_RECEIVERS = only(meshes.triangle_receivers(meshes.box_scene()), np.zeros(12, bool))


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.name, marks=pytest.mark.slow if c.slow else ()) for c in CASES],
)
def test_extreme(case):
    assert case.measure() <= case.limit


def strictly(scene, receivers=None) -> np.ndarray:
    """Baked radiance, on one thread (NumPy's error state is a thread's own), with floating-point
    errors and warnings raised."""
    receivers = receivers or meshes.triangle_receivers(scene)
    with np.errstate(all="raise"):
        found = compose(solve(scene, receivers, Settings(error=0.05, threads=1)), ALL)
    assert np.isfinite(found).all() and (found >= 0).all()
    return found


ROOM = lamp_room(walls(2))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "change",
    [
        {},
        {"lamps": ()},
        {"lamps": (PointLamp("On a corner", np.zeros(3), np.ones(3)),)},
        {"lamps": (PointLamp("In a wall", np.array([0.5, 0.5, 0]), np.ones(3), 0.1),)},
        {"lamps": (PointLamp("Dark", np.full(3, 0.5), np.zeros(3)),)},
        {"lamps": (PointLamp("Shut", np.full(3, 0.5), np.ones(3), axis=np.array([0, 0, -1.0]),
                             cone=0.0),)},
        {"lamps": (AreaLamp("Point", np.full(3, 0.5), np.zeros(3), np.zeros(3),
                            np.array([0, 0, -1.0]), np.ones(3)),)},
        {"lamps": (SunLamp("Sun", np.array([0, 0, -1.0]), np.ones(3)),)},
        {"lamps": tuple(PointLamp(f"{k} of 40", np.array([0.02 * k + 0.1, 0.5, 0.5]), np.ones(3))
                        for k in range(40))},
        {"sky": Sky(np.ones((16, 32, 3), np.float32))},
        {"sky": Sky(np.eye(32, 64, dtype=np.float32)[..., None] * np.full(3, 1e30, np.float32))},
    ],
    ids=lambda change: next((lamp.name for lamp in change.get("lamps", ())), "+".join(change)),
)  # fmt: skip
def test_lights_under_strict_arithmetic(change):
    strictly(replace(ROOM, **change))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("image", [False, True])
def test_textures_and_panes_under_strict_arithmetic(image):
    """A picture on the floor, a glowing picture on the ceiling, a tinted pane across the middle of
    the room; receivers anywhere, or the texels of an image."""
    scene = lamp_room([*walls(1), quad((0.5, 0.5, 0.5), 0.6)])
    random = np.random.default_rng(0)
    uv = random.random((len(scene.triangles), 3, 2)).astype(np.float32)
    picture = Texture(random.random((8, 8, 3)).astype(np.float32) ** 30, uv)
    own = list(scene.materials)
    own[4] = replace(own[4], reflectance=picture)
    own[5] = replace(own[5], emission=picture)
    own[6] = replace(own[6], transmittance=Constant(np.array([0.5, 1e-30, 0])))
    receivers = meshes.triangle_receivers(scene, 2)
    if image:
        place = np.arange(receivers.count)
        grid = np.stack([0 * place, place // 8, place % 8], 1).astype(np.int32)
        receivers = replace(receivers, grid=grid)
    strictly(replace(scene, materials=tuple(own)), receivers)


STRENGTHS = (0.0, 1e-300, 1e-30, 1.0, 1e30, 1e300)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("reflectance, exitance", [
    *((reflectance, exitance) for reflectance in (0.0, 0.5) for exitance in STRENGTHS),
    *((1 - 1e-6, exitance) for exitance in (1e-300, 1e300)),  # paths go on for long: seconds each
])  # fmt: skip
def test_closed_box_under_strict_arithmetic(reflectance, exitance):
    """Uniform emission in a closed scene: radiance q / π (1 − ρ)."""
    found = strictly(meshes.box_scene(reflectance=reflectance, exitance=exitance))
    expected = exitance / (1 - reflectance) / np.pi
    assert found == pytest.approx(expected, rel=1e-5, abs=0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("quantity", ["reflectance", "emission", "transmittance"])
def test_material_that_is_not_finite_is_named(quantity, bad):
    pixels = np.full((2, 2, 3), bad, np.float32)
    uv = np.zeros((len(ROOM.triangles), 3, 2), np.float32)
    for field in (
        Constant(np.array([0, bad, 0])),
        Texture(pixels, uv),
        CornerColors(np.full((len(ROOM.triangles), 3, 3), bad, np.float32)),
    ):
        materials = (replace(ROOM.materials[0], **{quantity: field}), *ROOM.materials[1:])
        with pytest.raises(ValueError, match=f"the {quantity} of material 'part 0' is not finite"):
            radiosity(replace(ROOM, materials=materials))


@pytest.mark.parametrize("member", ["position", "intensity", "radius"])
def test_lamp_that_is_not_finite_is_named(member):
    lamp = replace(ROOM.lamps[0], **{member: np.nan * np.ones(3) if member != "radius" else np.nan})
    with pytest.raises(ValueError, match=f"the {member} of lamp 'Lamp' is .*nan"):
        radiosity(replace(ROOM, lamps=(lamp,)))


def test_lamp_too_far_away_for_numbers_is_named():
    """At 1e20 times the room's size squares of its distance are beyond float32: the bake ended with a word on NaN."""
    far = replace(ROOM.lamps[0], name="Far", position=np.array([0, 0, 1e14]))
    radiosity(replace(ROOM, lamps=(far,)))
    far = replace(far, position=np.array([0, 0, 1e20]))
    with pytest.raises(ValueError, match="lamp 'Far' is 1e.20 times as far away .* make it a sun"):
        radiosity(replace(ROOM, lamps=(*ROOM.lamps, far)))


def test_sky_that_is_not_finite_is_named():
    with pytest.raises(ValueError, match="the sky has pixels that are not finite"):
        radiosity(replace(ROOM, sky=Sky(np.full((1, 1, 3), np.nan, np.float32))))


def test_vertex_that_is_not_finite_is_refused_only_where_it_is_used():
    vertices = np.concatenate([ROOM.vertices, [[np.nan, np.inf, 0]]])
    np.testing.assert_array_equal(strictly(replace(ROOM, vertices=vertices)), strictly(ROOM))
    vertices = ROOM.vertices.copy()
    vertices[0] = np.nan
    with pytest.raises(ValueError, match="a vertex is not finite; leave such faces out"):
        radiosity(replace(ROOM, vertices=vertices))


@pytest.mark.parametrize("scale", [1e-120, 1e120])
def test_scene_out_of_range_is_refused(scale):
    with pytest.raises(ValueError, match="units across; that must lie between 1e-100 and 1e.100"):
        radiosity(replace(ROOM, vertices=ROOM.vertices * scale))


def test_nothing_to_bake_is_said():
    for scene in (ROOM, replace(ROOM, triangles=ROOM.triangles[:0], material=ROOM.material[:0],
                                object=ROOM.object[:0])):  # fmt: skip
        with pytest.raises(ValueError, match="there is no surface to bake"):
            solve(scene, NO_RECEIVERS, Settings())


@pytest.mark.parametrize("what", ["triangles", "materials", "receivers"])
def test_numbers_out_of_range_are_refused(what):
    scene, receivers = ROOM, meshes.triangle_receivers(ROOM)
    if what == "triangles":
        scene = replace(ROOM, triangles=ROOM.triangles + 1)
    elif what == "materials":
        scene = replace(ROOM, material=ROOM.material + 1)
    else:
        receivers = Receivers(1, np.zeros(1, np.int32), np.array([999]), receivers.corners[:1],
                              receivers.square[:1])  # fmt: skip
    with pytest.raises(ValueError, match="do not exist"):
        solve(scene, receivers, Settings())


def test_objects_are_named_that_are_too_small_for_the_scene():
    """A ball of 1 m inside a dome for the sky, whose faces are many and large. Rays start 5e-7 of the scene's
    extent above a face, a thirtieth of the ball where the dome is 62.5 km across."""
    for radius, said in ((25_000.0, False), (40_000.0, True)):
        dome, ball = meshes.icosphere(2, radius, inward=True), meshes.icosphere(1, 0.5)
        _, _, solution = radiosity(meshes.scene([dome, ball], exitance=[[1.0], [0.0]]), 0.1, 1)
        texts = [text for text in solution.statistics.warnings if '"part 1" less than' in text]
        assert bool(texts) == said and not any('"part 0"' in text for text in texts)
