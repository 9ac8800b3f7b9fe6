"""A job that needs no Blender: a square under a sun."""

from __future__ import annotations

import numpy as np

from radiosity_addon.bake.exported_object import CornerMap, ExportedObject
from radiosity_addon.bake_job import Job
from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.scene import Material, Scene, SunLamp

SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
HALVES = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
UV = (SQUARE[HALVES][..., :2] + 1) / 2  # the square fills the image


def square_job(target: str, strength: float = np.pi, resolution: int = 8, **options) -> Job:
    """A square of reflectance 0.5 under a sun at its zenith: radiance 0.5 · strength / π."""
    scene = Scene(
        vertices=SQUARE,
        triangles=HALVES,
        material=np.zeros(2, np.int32),
        object=np.zeros(2, np.int32),
        materials=(Material("Gray", Constant(np.full(3, 0.5))),),
        objects=("Square",),
        lamps=(SunLamp("Sun", np.array([0.0, 0, -1]), np.full(3, strength)),) if strength else (),
    )
    loops, one_hot = HALVES.ravel(), CornerMap(np.arange(7), np.arange(6), np.ones(6), 6)
    exported = ExportedObject("Square", 0, 2, UV, one_hot, loops, loops)
    settings = Settings(target=target, resolution=resolution, quality="draft", **options)
    return Job(settings, scene, (exported,), (), (), ())
