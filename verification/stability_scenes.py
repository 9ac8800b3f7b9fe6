"""Scenes at the extremes: slivers, prisms, halls, copies of walls. NumPy only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import PointLamp, Scene, Sky, SunLamp
from radiosity_addon.solver.sequence import solve
from radiosity_addon.solver.solution import Solution, compose
from verification import meshes

ALL = ("emit", "direct", "indirect", "color")
CORNERS, _ = meshes.box_polygons()


def radiosity(scene: Scene, error: float = 0.01, divisions: int = 2, **settings):
    """B (n_receivers, 3), with one receiver on each of divisions² parts of every triangle."""
    receivers = meshes.triangle_receivers(scene, divisions)
    solution = solve(scene, receivers, Settings(error=error, **settings))
    return np.pi * compose(solution, ALL), receivers, solution


def part_means(scene: Scene, error: float = 0.01, divisions: int = 2, **settings) -> np.ndarray:
    """(n_objects,) B of the first channel, mean over each object's area."""
    found, receivers, _ = radiosity(scene, error, divisions, **settings)
    area = meshes.areas(scene.vertices, scene.triangles)[receivers.triangle]
    owner = scene.object[receivers.triangle]
    return np.bincount(owner, area * found[:, 0]) / np.bincount(owner, area)


def walls(divisions: int = 4) -> list:
    """The six walls of a unit room, facing inwards."""
    return [meshes.grid(corners, divisions) for corners in CORNERS]


def lamp_room(parts=None, reflectance=0.5, scale: float = 1.0, offset=0.0) -> Scene:
    """A room of ``parts`` with a point lamp off its middle, scaled, then moved by ``offset`` edges;
    the lamp's power grows with the area, so that irradiances stay."""
    scene = meshes.scene(parts or walls(), reflectance)
    position = (np.array([0.5, 0.4, 0.7]) + offset) * scale
    lamp = PointLamp("Lamp", position, np.full(3, scale**2, float))
    return replace(scene, vertices=(scene.vertices + offset) * scale, lamps=(lamp,))


def strips(corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """A wall of ``count`` strips right across it, two triangles each: aspect ``count``."""
    a, b, c, d = corners
    t = np.linspace(0, 1, count + 1)[:, None]
    vertices = np.concatenate([a + t * (d - a), b + t * (c - b)])
    i = np.arange(count)
    lower = np.column_stack([i, count + 1 + i, count + 2 + i])
    upper = np.column_stack([i, count + 2 + i, i + 1])
    return vertices, np.stack([lower, upper], 1).reshape(-1, 3)


def fan(corners: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """A wall of needles from one corner to the two sides opposite, ``count`` to each."""
    a, b, c, d = corners
    t = np.linspace(0, 1, count + 1)[:, None]
    vertices = np.concatenate([[a], b + t * (c - b), c + t[1:] * (d - c)])
    return vertices, np.array([(0, i, i + 1) for i in range(1, 2 * count + 1)])


def needles(corners: np.ndarray, width: float) -> tuple[np.ndarray, np.ndarray]:
    """A wall of ordinary triangles with one seam ``width`` wide across it: aspect 1 / width."""
    a, b, c, d = corners
    p, q = (a + d) / 2, (b + c) / 2
    step = (d - a) * width
    vertices = np.array([a, b, q, p, q + step, p + step, c, d])
    quads = [(0, 1, 2, 3), (3, 2, 4, 5), (5, 4, 6, 7)]
    return vertices, np.array([t for i, j, k, l in quads for t in ((i, j, k), (i, k, l))])


def quad(center, size: float) -> tuple[np.ndarray, np.ndarray]:
    """A horizontal square that faces down."""
    corners = np.array([[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]], float)
    return meshes.grid(corners * size / 2 + np.asarray(center), 1)


def reversed_part(part):
    """The same faces, facing the other way."""
    return part[0], part[1][:, ::-1]


def half_reversed(part):
    """Every other face turned."""
    vertices, triangles = part
    triangles = triangles.copy()
    triangles[::2] = triangles[::2, ::-1]
    return vertices, triangles


def bowl(part):
    """The faces below the middle of a closed mesh: an open shell."""
    vertices, triangles = part
    height = vertices[triangles].mean(axis=1)[:, 2]
    return vertices, triangles[height < np.median(height)]


def prism(degrees: float) -> list:
    """A closed prism 1 long: two walls 1 wide that meet under an angle, a base and two ends."""
    angle = np.radians(degrees)
    a, b = np.zeros(3), np.array([1.0, 0, 0])
    c, up = np.array([np.cos(angle), 0, np.sin(angle)]), np.array([0, 1.0, 0])
    quads = [(b, b + up, a + up, a), (a + up, c + up, c, a), (c, c + up, b + up, b)]
    ends = [np.array([a, c, b]), np.array([a, b, c]) + up]
    return [meshes.grid(np.array(q), 1) for q in quads] + [meshes.polygon(end) for end in ends]


def moebius(count: int = 60):
    """A strip of ``count`` quads with one side only."""
    angle, half = np.linspace(0, 2 * np.pi, count, endpoint=False), np.array([-0.1, 0.1])[:, None]
    radius = 0.25 + half * np.cos(angle / 2)
    height = half * np.sin(angle / 2)
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], -1) + 0.5
    now, following = np.arange(count), np.arange(1, count + 1)
    low, high = now, now + count
    last = following == count  # joined to the first, upside down
    next_low = np.where(last, count, following)
    next_high = np.where(last, 0, following + count)
    lower = np.stack([low, next_low, next_high], 1)
    return vertices.reshape(-1, 3), np.concatenate([lower, np.stack([low, next_high, high], 1)])


def plane(center, u, v, divisions: int = 1):
    """A rectangle center ± u ± v."""
    center, u, v = (np.asarray(a, float) for a in (center, u, v))
    corners = np.array([center - u - v, center + u - v, center + u + v, center - u + v])
    return meshes.grid(corners, divisions)


def house(beyond: float = 0.0, below: float = 0.0, divisions: int = 1) -> list:
    """Four walls and a roof of a unit cube, on its floor's plane or reaching ``below`` it; all
    reach ``beyond`` the cube's edges."""
    half = 0.5 + beyond
    side = np.array([0, 0, (1 + below + beyond) / 2])
    middle = (1 + beyond - below) / 2
    walls = [
        plane((x, 0.5, middle), (0, half, 0), side, divisions) for x in (0, 1)
    ] + [plane((0.5, y, middle), (half, 0, 0), side, divisions) for y in (0, 1)]
    return [*walls, plane((0.5, 0.5, 1), (half, 0, 0), (0, half, 0), divisions)]


def beside_the_sun(parts, toward=(0.3, 0.2, -1.0)) -> Scene:
    """``parts`` on a large ground under a bright sun and sky."""
    ground = meshes.grid(np.array([[-5, -5, -1], [5, -5, -1], [5, 5, -1], [-5, 5, -1]], float), 2)
    return sunny(meshes.scene([*parts, ground], 0.5), toward)


def sunny(scene: Scene, toward) -> Scene:
    """Under a bright sun and sky."""
    sun = SunLamp("Sun", np.asarray(toward, float) / np.linalg.norm(toward), np.full(3, 1e3))
    return replace(scene, lamps=(sun,), sky=Sky(np.full((1, 1, 3), 10.0, np.float32)))


def turned(scene: Scene) -> Scene:
    """A scene under one sun, rotated about all axes."""
    q, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    sun = scene.lamps[0]
    sun = replace(sun, direction=q @ sun.direction)
    return replace(scene, vertices=scene.vertices @ q.T, lamps=(sun,))


def only(receivers: Receivers, chosen: np.ndarray) -> Receivers:
    """The ``chosen`` (count,) bool of receivers with one cell each."""
    return Receivers(
        int(chosen.sum()),
        np.arange(chosen.sum(), dtype=np.int32),
        receivers.triangle[chosen],
        receivers.corners[chosen],
        receivers.square[chosen],
    )


def soup(count: int, seed: int, size: float = 0.2):
    """``count`` random triangles inside the unit room, cutting through each other."""
    random = np.random.default_rng(seed)
    center = random.uniform(0.2, 0.8, (count, 1, 3))
    corners = center + random.uniform(-size, size, (count, 3, 3)) * 0.9
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def worst(found: np.ndarray, expected) -> float:
    """Largest relative deviation."""
    return float(np.abs(found / expected - 1).max())


def estimated(solution: Solution) -> float:
    """The error the solver says it reached."""
    return solution.statistics.estimated_error
