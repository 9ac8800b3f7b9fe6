"""Scenes of quads and boxes, put together by hand, and small receivers at random places of them."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.fields import Constant, Texture
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import Material, Scene, Sky
from verification.meshes import BOX, CORNERS

BLACK = np.zeros(3)


class Build:
    """Collects quads; vertices at one place are joined in the end. Lengths in meters."""

    def __init__(self):
        self.quads, self.materials, self.solids = [], [], []

    def material(self, reflectance=0.5, radiance=0.0, transmittance=0.0, picture=None) -> int:
        """The number of a new material; colors (3,) or numbers. ``picture`` (h, w, 3) multiplies
        ``radiance``, ``reflectance`` may be such a picture: from corner to corner of each quad."""
        self.materials.append((reflectance, radiance, transmittance, picture))
        return len(self.materials) - 1

    def quad(self, corners, material: int, receives: bool = True) -> None:
        """Counter-clockwise, seen from its front."""
        self.quads.append((np.asarray(corners, float), material, receives))

    def room(self, size, floor: int, ceiling: int, walls: int, skip=()) -> None:
        """From the origin, facing inwards, but for ``skip``: 0 to 5 are −x +x −y +y −z +z."""
        for face, corners in enumerate(CORNERS[BOX] * np.asarray(size, float)):
            if face not in skip:
                self.quad(corners,
                          (walls, walls, walls, walls, floor, ceiling)[face])  # fmt: skip

    def box(self, low, high, material: int, skip=(), receives: bool = True) -> None:
        """A solid, facing outwards; its bottom receives nothing, as it often lies on something."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        self.solids.append((low, high))
        for face, corners in enumerate(CORNERS[BOX] * (high - low) + low):
            if face not in skip:
                self.quad(corners[::-1], material, receives and face != 4)

    def scene(self, lamps=(), sky=None) -> Scene:
        """All of it; every quad an object of its own."""
        count = len(self.quads)
        corners = np.concatenate([quad for quad, _, _ in self.quads])
        vertices, index = np.unique(np.round(corners, 12), axis=0, return_inverse=True)
        quads = index.reshape(-1, 4)
        triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
        owner = np.repeat(np.arange(count, dtype=np.int32), 2)
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
        uv = np.tile(square[[0, 1, 2, 0, 2, 3]].reshape(2, 3, 2), (count, 1, 1))
        material = np.array([m for _, m, _ in self.quads], np.int32)[owner]
        sky = None if sky is None else Sky(np.asarray(sky, np.float32))
        return Scene(vertices, triangles, material, owner,
                     tuple(_material(k, uv, *m) for k, m in enumerate(self.materials)),
                     tuple(f"quad {k}" for k in range(count)), tuple(lamps), sky)  # fmt: skip


def _material(number: int, uv, reflectance, radiance, transmittance, picture) -> Material:
    if np.ndim(reflectance) == 3:
        reflects = Texture(np.asarray(reflectance, np.float32), uv, "EXTEND", "Closest")
    else:
        reflects = Constant(BLACK + reflectance)
    glows = Constant(BLACK + radiance)
    if picture is not None:
        glows = Texture(np.asarray(picture, np.float32), uv, "EXTEND", "Closest", BLACK + radiance)
    return Material(f"material {number}", reflects, glows, Constant(BLACK + transmittance))


def small_receivers(build: Build, scene: Scene, count: int, random, within=None, size=2e-3):
    """``count`` triangles with legs of about ``size`` [m] at random places of the quads that
    receive, by area, none where a box stands on them: Receivers, triangles (n,) and the middles'
    uv (n, 2). ``within`` (low, high): only places in that box."""
    corners = scene.vertices[scene.triangles]
    edges = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    receives = np.repeat([r for _, _, r in build.quads], 2)
    chance = np.where(receives, area, 0) / area[receives].sum()
    triangle, uv = np.zeros(0, int), np.zeros((0, 2))
    while len(triangle) < count:
        some = random.choice(len(area), 64 * count, p=chance)
        weight = random.random((len(some), 2))
        weight[weight.sum(axis=1) > 1] = 1 - weight[weight.sum(axis=1) > 1]
        weight *= 0.98
        points = corners[some, 0] + np.einsum("nk,nkd->nd", weight, edges[some])
        good = np.ones(len(some), bool)
        for low, high in build.solids:  # on its own faces a point is not inside
            inside = (points > low - 1e-6) & (points < high + 1e-6)
            on_rim = (np.abs(points - low) < 1e-6) | (np.abs(points - high) < 1e-6)
            mine = np.array([np.all((q >= low - 1e-9) & (q <= high + 1e-9))
                             for q, _, _ in build.quads])[scene.object[some]]  # fmt: skip
            good &= ~(inside.all(axis=1) & ~(on_rim.any(axis=1) & mine))
        if within is not None:
            good &= ((points >= within[0]) & (points <= within[1])).all(axis=1)
        triangle = np.concatenate([triangle, some[good]])[:count]
        uv = np.concatenate([uv, weight[good]])[:count]
    legs = np.minimum(size / np.linalg.norm(edges[triangle], axis=2), 0.01)
    cells = np.stack([uv, uv + legs * [1, 0], uv + legs * [0, 1]], 1)
    number = np.arange(count, dtype=np.int32)
    where = Receivers(count, number, triangle.astype(np.int32), cells, np.zeros(count, bool))
    return where, triangle, cells.mean(axis=1)
