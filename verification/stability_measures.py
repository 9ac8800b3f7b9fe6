"""Measures: how far the solver is from an exact answer or an invariant, one function a question."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from functools import lru_cache

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.scene import PointLamp, Scene
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import compose
from radiosity_addon.solver.transport.form_factors import patch_form_factors
from radiosity_addon.solver.transport.second_kind import solve_second_kind
from verification import exact, meshes
from verification import stability_scenes as scenes
from verification.stability_scenes import ALL, only, part_means, radiosity, walls, worst


def furnace(parts, rho: float, error: float = 0.01, divisions: int = 1) -> float:
    """Everything emits 1 − ρ in a closed scene: B = 1 at every receiver."""
    found, _, _ = radiosity(meshes.scene(parts, rho, 1 - rho), error, divisions)
    return worst(found, 1.0)


def sphere(rho: float) -> float:
    """Octants of different emission in a closed sphere: relative RMS deviation from B = q + ρφ."""
    q = np.linspace(0.2, 1.6, 8)
    scene = meshes.sphere_scene(3, np.full((8, 1), rho), q[:, None])
    area = meshes.areas(scene.vertices, scene.triangles)
    expected = exact.closed_sphere(q[scene.object], np.full(len(area), rho), area)
    found, _, _ = radiosity(scene, 0.01, 1)
    return float(np.sqrt(np.mean((found[:, 0] / expected - 1) ** 2)))


def applications(rho: float) -> float:
    """Applications of the operator until a residual of 1e-8, one wall of 24 patches emitting."""
    scene = meshes.scene([meshes.grid(corners, 2) for corners in scenes.CORNERS])
    patch = np.arange(len(scene.triangles))
    factors, _ = patch_form_factors(scene, patch, 1 << 10, 2)
    source = (scene.object == 0).astype(float)
    found = solve_second_kind(lambda x: rho * (factors @ x), source, 1e-8, 400)
    return found.iterations if found.residual <= 1e-8 else np.inf


def open_strips(rho: float) -> float:
    """Sparrow's facing strips, 200 long, mean B."""
    scene = meshes.strips_scene(rho, 200.0, 1)
    return worst(part_means(scene, 0.005, 8).mean(), exact.facing_strips(rho)[2])


def box_light(rho: float, exitance: float) -> float:
    """Deviation from B = E / (1 − ρ) in a closed box, ρ as if not below 0."""
    found, _, _ = radiosity(meshes.box_scene(reflectance=rho, exitance=exitance), 0.05)
    return worst(found, exitance / (1 - max(rho, 0)))


def nothing_there(scene: Scene) -> float:
    """The light on a scene without extent, 0 where it is refused with a message."""
    try:
        return float(radiosity(scene)[0].max())
    except ValueError as error:
        return 0.0 if str(error) else 1.0


def refused(scene: Scene, message: str) -> float:
    """0 where the scene is refused with that in the message, 1 where not."""
    try:
        radiosity(scene)
    except ValueError as error:
        return 0.0 if message in str(error) else 1.0
    return 1.0


@lru_cache(maxsize=None)
def plain_room(error: float) -> np.ndarray:
    """Mean B of the walls of the lit room at the origin."""
    return part_means(scenes.lamp_room(), error)


def brightness(factor: float) -> float:
    """The same room, its lamp ``factor`` times as bright."""
    room = scenes.lamp_room()
    lamp = room.lamps[0]
    bright = replace(room, lamps=(replace(lamp, intensity=lamp.intensity * factor),))
    return worst(part_means(bright) / factor, plain_room(0.01))


def mixed_brightness() -> float:
    """A lamp of 1e30 and one of 1e-30 in one room: the sum is the first, to rounding."""
    room = scenes.lamp_room()
    big = replace(room.lamps[0], intensity=np.full(3, 1e30))
    small = PointLamp("Small", np.array([0.2, 0.2, 0.2]), np.full(3, 1e-30))
    alone = part_means(replace(room, lamps=(big,)))
    return worst(part_means(replace(room, lamps=(big, small))), alone)


def placed(scale: float, offset: float) -> float:
    """The lit room at another scale and place against the unit room at the origin."""
    return worst(part_means(scenes.lamp_room(scale=scale, offset=offset)), plain_room(0.01))


def small_lamp(ratio: float) -> float:
    """A two-sided black square of that edge emits 1 W in a room of ρ = ½ and area 6: of the light
    that arrives half is absorbed, Σ A (1 − ρ) H = 1 and so Σ A B = 1, but for what falls back on
    the lamp itself (order ratio², less than the limit)."""
    exitance = np.zeros((7, 1))
    exitance[6] = 1 / (2 * ratio**2)
    parts = [*scenes.walls(), scenes.quad((0.5, 0.5, 0.5), ratio)]
    scene = meshes.scene(parts, np.array([0.5] * 6 + [0.0])[:, None], exitance)
    return worst(part_means(scene)[:6].sum(), 1.0)


def worlds_apart(distance: float) -> float:
    """0 where two lit rooms so many edges apart are warned of, 1 where not."""
    rooms = [(v + [x, 0, 0], t) for x in (0, distance) for v, t in scenes.walls(1)]
    _, _, solution = radiosity(scenes.lamp_room(rooms), 0.5, 1)
    return float(not any("apart" in text for text in solution.statistics.warnings))


def bright_and_faint() -> float:
    """Two emitting squares of 1e30 and 1e-30 W/m²: the light is that of the first, to rounding."""
    lamps = [scenes.quad((x, 0.5, 0.8), 0.2) for x in (0.3, 0.7)]
    means = [
        part_means(meshes.scene([*walls(), *lamps], 0.5,
                                np.array([0.0] * 6 + [1e30, faint])[:, None]))[:6]
        for faint in (1e-30, 0.0)
    ]  # fmt: skip
    return worst(*means)


def same_as_room(parts, divisions: int = 1) -> float:
    """Mean B of each wall of the lit room, however its walls are cut, against a finer solve of the
    plain room."""
    return worst(part_means(scenes.lamp_room(parts), 0.01, divisions)[:6], plain_room(0.003))


def lamp_with(extra: list, exitance: list) -> float:
    """Light on the walls of a room under a square lamp with something lying on it."""
    lamp = scenes.quad((0.5, 0.5, 0.8), 0.25)
    means = []
    for parts, values in (([], []), (extra, exitance)):
        rho = np.array([0.5] * 6 + [0.0] * (1 + len(parts)))[:, None]
        glow = np.array([0.0] * 6 + [1.0] + values)[:, None]
        scene = meshes.scene([*scenes.walls(), lamp, *parts], rho, glow)
        means.append(part_means(scene)[:6].mean())
    return worst(means[1], means[0])


def lamps(count: int) -> float:
    """``count`` lamps of equal power over a floor, total power fixed: half of it is absorbed by
    every reflection, Σ A B = Φ as for one lamp."""
    random = np.random.default_rng(0)
    many = tuple(
        PointLamp(f"{i}", offset, np.full(3, 1 / (4 * np.pi * count)))
        for i, offset in enumerate(random.uniform(0.1, 0.9, (count, 3)))
    )
    return worst(part_means(replace(scenes.lamp_room(), lamps=many), 0.03).sum(), 1.0)


@lru_cache(maxsize=1)
def boxes(count: int) -> Scene:
    """A furnace with ``count`` small boxes, an object each."""
    side = int(np.ceil(count ** (1 / 3)))
    places = np.stack(np.meshgrid(*[np.arange(side)] * 3), -1).reshape(-1, 3)[:count]
    faces, _ = meshes.box_polygons((0.4 / side,) * 3)
    box = meshes.scene([meshes.grid(face[::-1], 1) for face in faces])
    parts = [(box.vertices + offset, box.triangles) for offset in (places + 0.3) / side]
    return meshes.scene([*scenes.walls(1), *parts], 0.5, 0.5)


def many_objects(count: int) -> float:
    """B = 1 in that furnace."""
    return worst(radiosity(boxes(count), 0.03, 1)[0], 1.0)


def growth(run, few: int, many: int) -> float:
    """How many times as long ``run(many)`` takes as ``run(few)``, the better of two runs each."""
    return _seconds(run, many) / _seconds(run, few)


def _seconds(run, count: int) -> float:
    run(count)  # once for what is made once: scenes, imports
    times = []
    for _ in range(2):
        start = time.perf_counter()
        run(count)
        times.append(time.perf_counter() - start)
    return min(times)


def random_failures(count: int) -> float:
    """0 where ``count`` random scenes are all solved or rightly refused, 1 where one is not."""
    from verification.stability_random import run  # hypothesis is not needed for the other rows

    try:
        run(count)
    except Exception:
        logging.getLogger(__name__).exception("a random scene fails")
        return 1.0
    return 0.0


def suzanne_furnace(rho: float) -> float:
    """A furnace closed around Suzanne. Needs bpy."""
    from verification.real_meshes import room_around, suzanne

    return furnace(room_around(*suzanne()), rho, 0.03)


def elements_of_suzanne(few: int, many: int) -> float:
    """Elements for Suzanne under a lamp in a box, every triangle baked to 3 %: subdivided ``many``
    times against ``few`` times."""
    from verification.real_meshes import suzanne

    numbers = []
    for levels in (few, many):
        vertices, triangles = suzanne(levels)
        scene = scenes.lamp_room([*walls(), (0.2 * vertices + [0.5, 0.5, 0.35], triangles)])
        numbers.append(radiosity(scene, 0.03, 1)[2].statistics.elements)
    return numbers[1] / numbers[0]


def with_triangle(scene: Scene, corners) -> float:
    """Largest change of the others' B by one more triangle (3, 3)."""
    count, start = len(scene.triangles), len(scene.vertices)
    more = replace(
        scene, vertices=np.concatenate([scene.vertices, corners]),
        triangles=np.concatenate([scene.triangles, [[start, start + 1, start + 2]]]),
        material=np.append(scene.material, 0), object=np.append(scene.object, 0),
    )  # fmt: skip
    every = meshes.triangle_receivers(more)
    found = solve(more, only(every, every.triangle < count), Settings(error=0.05))
    before = solve(scene, meshes.triangle_receivers(scene), Settings(error=0.05))
    return float(np.abs(compose(found, ALL) - compose(before, ALL)).max())


def alone(scene: Scene) -> float:
    """Light that comes back to a single triangle, none of which may; 1 where it is not lit."""
    _, _, solution = radiosity(scene)
    lit = np.isfinite(solution.direct).all() and (solution.direct > 0).all()
    return float(solution.indirect.max()) if lit else 1.0


def rounding(rounded: bool) -> float:
    """0 where a room of edge 1e-6 at a distance of 1 is warned of if and only if its vertices are
    float32 numbers: those are 6e-8 apart there, 6 % of the edge."""
    room = scenes.lamp_room(walls(1), scale=1e-6, offset=1e6)
    if rounded:
        room = replace(room, vertices=room.vertices.astype(np.float32).astype(float))
    _, _, solution = radiosity(room, 0.1, 1)
    said = any("origin" in text for text in solution.statistics.warnings)
    return float(said != rounded)
