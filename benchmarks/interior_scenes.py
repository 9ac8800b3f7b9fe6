"""Three interiors that scripts make: an office floor with sixty lamps, a stair hall under a skylight, an
attic lit through slits. Each fills the empty file with one mesh."""

from __future__ import annotations

import numpy as np

from .quads import block, column, mesh_object, room
from .scene_parts import emitter, matte, point, sky, sun

DESKS, LAMPS = (8, 6), (10, 6)
FLIGHTS, STEPS = 4, 15
RAFTERS, SLATS, TRUNKS = 14, 36, 60


def office():
    """24 × 15 × 2.8 m: forty-eight desks with chairs, screens and bins under sixty lamps, every second a
    panel 3 cm below the ceiling that glows on both sides, the others bulbs."""
    _empty()
    materials = (matte("Wall", (0.7, 0.7, 0.68)), matte("Carpet", (0.2, 0.22, 0.27)),
                 matte("Wood", (0.5, 0.35, 0.2)), matte("Dark", (0.06, 0.06, 0.07)),
                 emitter("Panel", (1.0, 0.95, 0.85), 12.0))  # fmt: skip
    faces = [(q, 1 if side == "-z" else 0) for side, q in room((0, 0, 0), (24, 15, 2.8))]
    for i in range(DESKS[0]):
        for j in range(DESKS[1]):
            x, y = 1.2 + 2.9 * i, 1.0 + 2.3 * j
            faces += [(q, 2) for q in block((x, y, 0.72), (x + 1.6, y + 0.8, 0.75))]
            for u, v in ((0.02, 0.02), (1.53, 0.02), (0.02, 0.73), (1.53, 0.73)):
                faces += [(q, 3) for q in block((x + u, y + v, 0), (x + u + 0.05, y + v + 0.05, 0.72))]
            faces += [(q, 2) for q in block((x + 1.1, y + 0.1, 0), (x + 1.5, y + 0.7, 0.6))]
            faces += [(q, 3) for q in block((x + 0.5, y + 0.65, 0.85), (x + 1.1, y + 0.68, 1.2))]
            faces += [(q, 3) for q in column((x + 0.8, y + 0.66), 0.03, 0.85, 24)]
            faces += [(q, 3) for q in column((x + 0.8, y - 0.3), 0.04, 0.45, 24)]
            faces += [(q, 1) for q in block((x + 0.55, y - 0.55, 0.45), (x + 1.05, y - 0.05, 0.52))]
            faces += [(q, 1) for q in block((x + 0.55, y - 0.6, 0.6), (x + 1.05, y - 0.55, 1.05))]
            faces += [(q, 0) for q in column((x + 0.25, y + 0.4), 0.15, 0.4, 48)]
    for i in range(LAMPS[0]):
        for j in range(LAMPS[1]):
            x, y = 1.2 + 2.4 * i, 1.25 + 2.5 * j
            if (i + j) % 2:
                low, high = (x - 0.3, y - 0.15, 2.77), (x + 0.3, y + 0.15, 2.77)
                faces.append((np.array([low, (low[0], high[1], 2.77), high, (high[0], low[1], 2.77)]), 4))
            else:
                point(f"Bulb {i} {j}", (x, y, 2.4), 40.0, 0.04, (1.0, 0.8, 0.6))
    return mesh_object("Office", faces, materials)


def stair_hall():
    """7 × 7 × 11 m: four flights of stairs with balusters around a shaft, under a skylight of 2 × 2 m with
    the sun in it."""
    _empty()
    materials = (matte("Wall", (0.75, 0.73, 0.68)), matte("Stone", (0.45, 0.43, 0.4)),
                 matte("Iron", (0.08, 0.08, 0.08)))  # fmt: skip
    faces = [(q, 1 if side == "-z" else 0) for side, q in room((-3.5, -3.5, 0), (3.5, 3.5, 11), ("+z",))]
    faces += [(q, 0) for q in _ceiling_with_hole(3.5, 1.0, 11.0)]
    faces += [(q, 0) for side, q in room((-1, -1, 11), (1, 1, 11.8), skip=("-z", "+z"))]
    rise, run = 0.17, 2 * 2.2 / STEPS
    for flight in range(FLIGHTS):
        turn = flight * np.pi / 2
        for step in range(STEPS):
            z = (flight * STEPS + step + 1) * rise
            x = -2.2 + step * run
            parts = [(q, 1) for q in block((x, -3.49, z - 0.16), (x + run + 0.02, -2.2, z))]
            for k in range(3):
                around = (x + (k + 0.5) * run / 3, -2.25)
                parts += [(_lifted(q, z), 2) for q in column(around, 0.012, 0.9, 16)]
            parts += [(q, 2) for q in block((x, -2.28, z + 0.9), (x + run, -2.22, z + 0.95))]
            faces += [(_turned(q, turn), m) for q, m in parts]
        z = (flight + 1) * STEPS * rise
        faces += [(_turned(q, turn), 1) for q in block((2.2, -3.49, z - 0.16), (3.49, -2.2, z))]
    sky((0.6, 0.75, 1.0), 3.0)
    sun(40.0, (0.5, 0.2, 0.0))
    return mesh_object("Stair hall", faces, materials)


def attic():
    """9 × 6 m under a gable of boards with gaps of 15 mm, through which sun and sky shine; rafters,
    trunks, barrels."""
    _empty()
    materials = (matte("Board", (0.35, 0.24, 0.15)), matte("Floor", (0.4, 0.3, 0.2)),
                 matte("Trunk", (0.25, 0.12, 0.07)), matte("Cloth", (0.6, 0.58, 0.5)))  # fmt: skip
    faces = [(q, 1) for q in block((0, 0, -0.05), (9, 6, 0.001))]
    for x in (0.0, 9.0):
        gable = [(x, 0, 0), (x, 6, 0), (x, 3, 3.2), (x, 3, 3.2)]
        inner = np.array(gable if x else gable[::-1])
        faces.append((inner[[0, 1, 2, 2]] + [[0, 0, 0], [0, 0, 0], [0, 0.001, 0], [0, -0.001, 0]], 3))
    width = 1 / SLATS
    for side in (0, 1):
        for k in range(SLATS):
            faces += [(q, 0) for q in _board(side, k * width, (k + 1) * width - 0.0036, (0, 9), 0.02)]
        for k in range(RAFTERS):
            x = 0.3 + k * 8.4 / (RAFTERS - 1)
            faces += [(q, 0) for q in _board(side, 0.0, 0.97, (x - 0.04, x + 0.04), -0.12, -0.001)]
    random = np.random.default_rng(4)
    for k in range(TRUNKS):
        x, y = random.uniform(0.4, 8.0), random.uniform(1.0, 4.6)
        if k % 3:
            size = random.uniform(0.2, 0.6, 3)
            faces += [(q, 2 + k % 2) for q in block((x, y, 0.002), (x + size[0], y + size[1], size[2]))]
        else:
            faces += [(_lifted(q, 0.002), 2) for q in column((x, y), random.uniform(0.1, 0.3), 0.6, 200)]
    sky((0.55, 0.7, 1.0), 6.0)
    sun(200.0, (0.6, 0.5, 0.0))
    return mesh_object("Attic", faces, materials)


def _board(side: int, low: float, high: float, along, thickness: float, base: float = 0.0):
    """Six quads of a board on the roof's side, between shares of its height, ``along`` x."""
    foot, ridge = np.array([0.0, 6.0 * side, 0.0]), np.array([0.0, 3.0, 3.2])
    slope = ridge - foot
    out = np.array([0.0, -slope[2], slope[1]]) * (1 if side == 0 else -1)
    out /= np.linalg.norm(out)
    if out[2] < 0:
        out = -out
    corners = np.array([
        foot + share * slope + [x, 0, 0] + height * out
        for height in sorted((base, base + thickness)) for share in (low, high) for x in along
    ])  # fmt: skip
    middle, quads = corners.mean(axis=0), []
    for number in ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)):
        quad = corners[list(number)]
        normal = np.cross(quad[1] - quad[0], quad[2] - quad[0])
        quads.append(quad if normal @ (quad.mean(axis=0) - middle) > 0 else quad[::-1])
    return quads


def _ceiling_with_hole(half: float, hole: float, z: float) -> list[np.ndarray]:
    """Eight quads around a square hole, seen from below."""
    steps = (-half, -hole, hole, half)
    return [
        np.array([(a, c, z), (a, d, z), (b, d, z), (b, c, z)])
        for i, (a, b) in enumerate(zip(steps, steps[1:]))
        for j, (c, d) in enumerate(zip(steps, steps[1:]))
        if (i, j) != (1, 1)
    ]


def _turned(quad: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return quad @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def _lifted(quad: np.ndarray, height: float) -> np.ndarray:
    return quad + np.array([0, 0, height])


def _empty() -> None:
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)


INTERIORS = {"office": office, "stair_hall": stair_hall, "attic": attic}
