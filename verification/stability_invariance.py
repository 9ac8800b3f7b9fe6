"""Invariance: what must not change the colors, tried on a lit room around a blob. NumPy only."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from radiosity_addon.solver.scene import Scene
from verification import meshes
from verification import stability_scenes as scenes
from verification.stability_scenes import radiosity


@lru_cache(maxsize=None)
def blob_room() -> tuple[Scene, np.ndarray]:
    """The room, and B of the first channel at its triangles."""
    room = scenes.lamp_room([*scenes.walls(2), meshes.blob(2)])
    lamp = replace(room.lamps[0], position=np.array([0.85, 0.2, 0.85]))  # beside the blob
    room = replace(room, lamps=(lamp,))
    return room, radiosity(room, 0.003, 1)[0][:, 0]


def changed(change) -> float:
    """Relative error (docs/theory.md) of the changed room, solved for 1 %, against the room as it
    was, solved for 0.3 %. ``change`` gives a scene and the old number of each of its triangles."""
    room, before = blob_room()
    scene, order = change(room)
    after, before = radiosity(scene, 0.01, 1)[0][:, 0], before[order]
    area = meshes.areas(scene.vertices, scene.triangles)
    level = np.maximum(before, np.average(before, weights=area) / 4)
    return float(np.sqrt(np.average(((after - before) / level) ** 2, weights=area)))


def unchanged(scene: Scene):
    """Nothing at all: how far the two solves are apart by themselves."""
    return scene, slice(None)


def rotated(scene: Scene):
    """Turned about all axes."""
    q, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    q = q * np.sign(np.linalg.det(q))
    lamp = scene.lamps[0]
    lamp = replace(lamp, position=q @ lamp.position)
    return replace(scene, vertices=scene.vertices @ q.T, lamps=(lamp,)), slice(None)


def mirrored(scene: Scene):
    """x ↦ −x, the faces turned back to their side."""
    flip = np.array([-1.0, 1, 1])
    lamp = scene.lamps[0]
    lamp = replace(lamp, position=lamp.position * flip)
    scene = replace(scene, vertices=scene.vertices * flip, lamps=(lamp,))
    return replace(scene, triangles=scene.triangles[:, ::-1].copy()), slice(None)


def shuffled(scene: Scene):
    """Triangles in another order, each starting at another corner."""
    order = np.random.default_rng(3).permutation(len(scene.triangles))
    triangles = np.roll(scene.triangles, 1, axis=1)[order]
    return replace(
        scene, triangles=triangles, material=scene.material[order], object=scene.object[order]
    ), order


def reordered(scene: Scene):
    """Objects and materials in the opposite order."""
    order = np.argsort(-scene.object, kind="stable")
    last = len(scene.objects) - 1
    return replace(
        scene, triangles=scene.triangles[order], material=last - scene.material[order],
        object=last - scene.object[order], materials=scene.materials[::-1],
        objects=scene.objects[::-1],
    ), order  # fmt: skip


def split(scene: Scene):
    """Every triangle an object of its own, with vertices of its own."""
    count = len(scene.triangles)
    return replace(
        scene, vertices=scene.vertices[scene.triangles].reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        object=np.arange(count, dtype=np.int32), objects=tuple(f"{k}" for k in range(count)),
    ), slice(None)  # fmt: skip


def noisy(scene: Scene):
    """Vertices moved by float32's rounding error."""
    noise = np.random.default_rng(4).uniform(-6e-8, 6e-8, scene.vertices.shape)
    return replace(scene, vertices=scene.vertices + noise), slice(None)


def moved_apart(scene: Scene):
    """Vertices of every triangle moved by float32's rounding error on their own: cracks."""
    scene, order = split(scene)
    return noisy(scene)[0], order


CHANGES = (unchanged, rotated, mirrored, shuffled, reordered, split, noisy, moved_apart)
