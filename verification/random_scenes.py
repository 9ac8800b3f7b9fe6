"""Families of random scenes, each about one thing that may go wrong unseen. No answers are known:
the path tracer gives them. Rooms are some meters large."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.scene import AreaLamp, PointLamp, SunLamp
from verification.build import Build

DOWN = np.array([0.0, 0, -1])


def _room(random, skip=(), low=0.3, high=0.85):
    """A room of random size and grays: the build, its size, and a material for furniture."""
    build, size = Build(), random.uniform((3, 3, 2.3), (6, 5, 3.2))
    floor, ceiling, walls, furniture = (build.material(x) for x in random.uniform(low, high, 4))
    build.room(size, floor, ceiling, walls, skip)
    return build, size, furniture


def _furnish(build, size, material, random, count=3, height=(0.3, 1.2)):
    """Boxes on the floor."""
    for _ in range(count):
        extent = np.array([*random.uniform(0.3, 1.2, 2), random.uniform(*height)])
        low = np.array([*random.uniform(0.05, size[:2] - extent[:2] - 0.05), 0.0])
        build.box(low, low + extent, material, skip=(4,))


def _bulb(size, random, radius=0.05):
    """A lamp in the upper part of a room."""
    position = random.uniform((0.2, 0.2, 0.6), (0.8, 0.8, 0.85)) * size
    return PointLamp("bulb", position, np.ones(3) * 10, radius)


def _downward(center, width, depth):
    """A rectangle that faces down."""
    x, y, z = center
    w, d = width / 2, depth / 2
    return [(x - w, y - d, z), (x - w, y + d, z), (x + w, y + d, z), (x + w, y - d, z)]


def _upright(x, low, high):
    """A rectangle at ``x`` from (y, z) ``low`` to ``high`` that faces +x."""
    (a, b), (c, d) = low, high
    return [(x, a, b), (x, c, b), (x, c, d), (x, a, d)]


def windows(random):
    """A glowing window, mostly hidden by a cupboard close to it."""
    build, size, wood = _room(random)
    low = np.array([random.uniform(0.3, 1.0), 0.8])
    high = np.minimum(low + random.uniform((1, 0.8), (2, 1.4)), size[1:] - 0.1)
    build.quad(_upright(1e-3, low, high), build.material(0, 10), False)
    gap, part = random.uniform(0.02, 0.3), random.uniform(0.6, 0.95)
    top = low[1] + part * (high[1] - low[1])
    build.box((gap, low[0] - 0.1, 0), (gap + 0.4, high[0] + 0.1, top), wood, skip=(4,))
    return build, build.scene(), None


def slabs(random):
    """Pictures, a cupboard and a carpet a millimeter from walls and floor."""
    build, size, wood = _room(random)
    for _ in range(3):
        y, z = random.uniform((0.2, 0.5), size[1:] - (1.3, 1.3))
        build.box((1e-3, y, z), (0.03, y + 1, z + 0.7), wood, receives=False)
    x, y = random.uniform(0.3, size[:2] - 1.6)
    build.box((x, y, 1e-3), (x + 1.3, y + 1.2, 0.02), wood)
    build.box((x, size[1] - 0.5, 1e-3), (x + 1, size[1] - 1e-3, 1.8), wood)
    return build, build.scene([_bulb(size, random)]), None


def thin_walls(random):
    """A bright and a dark room, a sheet with a doorway between them."""
    build, size, wood = _room(random)
    x, door = random.uniform(0.35, 0.65) * size[0], random.uniform(0.3, size[1] - 1.2)
    half = random.choice([0.0005, 0.005, 0.03])
    for low, high in (((x - half, 0, 0), (x + half, door, size[2])),
                      ((x - half, door + 0.9, 0), (x + half, size[1], size[2]))):  # fmt: skip
        build.box(low, high, wood, skip=(2, 3, 4, 5))
    lamp = PointLamp("bulb", np.array([0.15, 0.5, 0.7]) * size, np.ones(3) * 10, 0.1)
    return build, build.scene([lamp]), None


def mazes(random):
    """Sheets across a room from either side in turn, a light at one end."""
    build, size, wood = _room(random, low=0.5)
    count = random.integers(2, 5)
    for k in range(count):
        x, gap = size[0] * (k + 1) / (count + 1), random.uniform(0.4, 1.0)
        low, high = (0.0, size[1] - gap) if k % 2 else (gap, size[1])
        build.box((x - 0.02, low, 0), (x + 0.02, high, size[2]), wood, skip=(2, 3, 4, 5))
    glow = build.material(0.5, 20)
    build.quad(_downward((0.3, size[1] / 2, size[2] - 0.05), 0.3, 0.6), glow, False)
    return build, build.scene(), None


def many_lamps(random):
    """Sixty lamps of all kinds and strengths in a furnished room."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random)
    lamps = []
    for k in range(60):
        position, power = random.uniform((0.1, 0.1, 0.6), 0.95) * size, 10 ** random.uniform(-2, 0)
        color = power * random.uniform(0.3, 1, 3)
        if k % 3 == 0:
            lamps.append(PointLamp(f"{k}", position, color, random.choice([0.0, 0.03])))
        elif k % 3 == 1:
            cone = random.uniform(0.5, 2)
            lamps.append(PointLamp(f"{k}", position, 4 * color, 0.02, DOWN, cone, 0.2))
        else:
            u, v = np.array([0.2, 0, 0]), np.array([0, 0.3, 0])
            lamps.append(AreaLamp(f"{k}", position, u, v, DOWN, 10 * color, k % 2 == 0))
    return build, build.scene(lamps), None


def luminaires(random):
    """Two, or sixteen, lamps that shine unevenly: sharp, soft and round ones, spots among them."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random)
    lamps = []
    for k in range(random.choice([2, 16])):
        position, shape = random.uniform((0.15, 0.15, 0.6), 0.9) * size, random.random((9, 18)) ** 4
        shape[random.integers(3, 9) :] = 0  # dark above
        shape = shape.astype(np.float32)
        beam = {"axis": DOWN, "cone": 2.0, "blend": 0.5} if k % 4 == 3 else {}
        radius = (0.0, 0.05, 0.1, 0.05)[k % 4]
        lamps.append(PointLamp(f"{k}", position, np.ones(3), radius, sphere=k % 4 == 2,
                               distribution=shape, **beam))  # fmt: skip
    return build, build.scene(lamps), None


def tiny_lamps(random):
    """One glowing square of a millimeter to a centimeter."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random)
    edge = 10 ** random.uniform(-3, -2)
    center = random.uniform((0.2, 0.2, 0.6), (0.8, 0.8, 0.9)) * size
    build.quad(_downward(center, edge, edge), build.material(0.5, 10 / edge**2), False)
    return build, build.scene(), None


def pictures(random):
    """A glowing picture of few or many texels, small on a wall or as large as the ceiling."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random, 2)
    shape = random.choice([3, 5, 7, 10, 24, 50], 2)
    lit = random.random(shape) < random.choice([0.1, 0.5])
    lit[tuple(random.integers(shape))] = True
    picture = lit[..., None] * random.uniform(0.2, 1, (*shape, 3))
    if random.random() < 0.5:
        corners = _upright(0.01, (0.5, 1.0), (1.5, 1.7))
    else:
        corners = _downward((size[0] / 2, size[1] / 2, size[2] - 1e-3), *(size[:2] - 0.02))
    build.quad(corners, build.material(0.2, 10, picture=picture), False)
    return build, build.scene(), None


def panels(random):
    """Panels that glow on both sides, 1 to 5 cm below the ceiling."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random, 1)
    glow = build.material(random.uniform(0, 0.8), 10)
    for x in (0.3, 0.7):
        center = (x * size[0], random.uniform(0.3, 0.7) * size[1],
                  size[2] - random.uniform(0.01, 0.05))  # fmt: skip
        build.quad(_downward(center, *random.uniform(0.4, 1.2, 2)), glow, False)
    return build, build.scene(), None


def narrow_spots(random):
    """One to three spots of 0.5 to 6 degrees, the only light."""
    build, size, wood = _room(random)
    _furnish(build, size, wood, random, 2)
    lamps = []
    for k in range(random.integers(1, 4)):
        axis = np.array([*random.uniform(-0.6, 0.6, 2), -1.0])
        cone = np.radians(10 ** random.uniform(-0.3, 0.8))
        lamps.append(PointLamp(f"{k}", np.array([0.5, 0.5, 0.9]) * size, np.ones(3) / cone**2, 0.0,
                               axis / np.linalg.norm(axis), cone, 0.2))  # fmt: skip
    return build, build.scene(lamps), None


def panoramas(random):
    """Walls on a floor under a panorama with bright strips."""
    build = Build()
    ground, walls = build.material(0.4), build.material(random.uniform(0.3, 0.8))
    build.quad([(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0)], ground)
    for _ in range(3):
        x, y = random.uniform(0.2, 2.8, 2)
        extent = (0.1, 1) if random.random() < 0.5 else (1, 0.1)
        build.box((x, y, 0), (x + extent[0], y + extent[1], random.uniform(0.3, 1.5)), walls, (4,))
    sky = np.full((64, 128, 3), 0.2)
    for _ in range(random.integers(1, 4)):
        row, column, long = random.integers(36, 54), random.integers(0, 118), random.integers(3, 9)
        rows, columns = (long, 1) if random.random() < 0.5 else (1, long)
        sky[row : row + rows, column : column + columns] = random.uniform(50, 400)
    return build, build.scene(sky=sky), None


def sun_through_slits(random):
    """A dim room with slits of one to five centimeters in its ceiling, under the sun."""
    build, size, wood = _room(random, skip=(5,))
    _furnish(build, size, wood, random, 1)
    edge, top = 0.0, size[2]
    for _ in range(random.integers(1, 4)):
        start = edge + random.uniform(0.3, 0.9)
        build.quad(_downward(((edge + start) / 2, size[1] / 2, top), start - edge, size[1]), wood)
        edge = start + random.uniform(0.01, 0.05)
    build.quad(_downward(((edge + size[0]) / 2, size[1] / 2, top), size[0] - edge, size[1]), wood)
    way = np.array([*random.uniform(-0.6, 0.6, 2), -1.0])
    sun = SunLamp("sun", way / np.linalg.norm(way), np.ones(3) * 100, np.radians(0.5))
    return build, build.scene([sun], sky=np.full((1, 1, 3), 0.5)), None


def sheds(random):
    """A shed open to one side, on a ground of 40 m to 1 km, under sun and sky."""
    build, size, wood = _room(random, skip=(1, 4))
    half = 10 ** random.uniform(1.3, 2.7)
    ground = build.material(random.uniform(0.2, 0.6))
    build.quad([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], ground)
    thick = 0.1
    build.box((-thick, -thick, size[2] + 1e-3), (*(size[:2] + thick), size[2] + thick), wood)
    way = np.array([random.uniform(-0.3, 1), random.uniform(-1, 1), -1.0])
    sun = SunLamp("sun", way / np.linalg.norm(way), np.ones(3) * 3, np.radians(0.5))
    return build, build.scene([sun], np.full((1, 1, 3), 1.0)), (-1e-6, size + 1e-6)


def contacts(random):
    """Boxes in corners, on one another and against walls."""
    build, size, wood = _room(random)
    a, b = random.uniform(0.5, 1.5, 3), random.uniform(0.3, 0.5, 3)
    build.box((0, 0, 0), np.minimum(a, size - 0.5), wood, skip=(0, 2, 4))
    low = np.array([0.1, 0.1, min(a[2], size[2] - 0.5)])
    build.box(low, low + np.minimum(b, 0.4), wood, skip=(4,))
    build.box((size[0] - 0.5, 0.5, 0), (size[0], 1.5, 0.8), wood, skip=(1, 4))
    return build, build.scene([_bulb(size, random)]), None


def uneven(random):
    """Walls with pictures of reflectances between 0.02 and 0.95, in colors."""
    build, size = Build(), random.uniform((3, 3, 2.3), (6, 5, 3.2))
    spotted = []
    for _ in range(3):
        dark = random.random((*random.integers(3, 20, 2), 1)) < 0.5
        spotted.append(build.material(np.where(dark, 0.02, random.uniform(0.3, 0.95, 3))))
    build.room(size, *spotted)
    _furnish(build, size, build.material(random.uniform(0.02, 0.9, 3)), random)
    return build, build.scene([_bulb(size, random)]), None


def panes(random):
    """Tinted panes between a lamp and the rest of the room, and before a window to the sky."""
    build, size, wood = _room(random, skip=(0,))
    _furnish(build, size, wood, random, 1)
    glass = build.material(0.05, 0, random.uniform(0.3, 0.9, 3))
    build.quad(_upright(0.0, (0, 0), tuple(size[1:])), glass, False)
    x = random.uniform(0.4, 0.6) * size[0]
    build.quad(_upright(x, (0.3, 0.3), tuple(size[1:] - 0.3)), glass, False)
    return build, build.scene([_bulb(size, random)], np.full((1, 1, 3), 1.0)), None


FAMILIES = {
    family.__name__: family
    for family in (windows, slabs, thin_walls, mazes, many_lamps, luminaires, tiny_lamps, pictures,
                   panels, narrow_spots, panoramas, sun_through_slits, sheds, contacts, uneven, panes)
}  # fmt: skip
