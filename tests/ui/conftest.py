"""What the interface's tests lean on: a job that needs no Blender, and the add-on registered."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import identity

from radiosity_addon.bake.faces import face_receivers
from radiosity_addon.export.exported import ExportedObject
from radiosity_addon.job import Job
from radiosity_addon.settings import Settings
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.receivers import concatenate
from radiosity_addon.solver.scene import Material, Scene, SunLamp


@pytest.fixture
def make_job():
    """A function: the job of a square (reflectance 0.5) under a sun of irradiance π, so that its
    radiance is 0.5. With ``copies`` = 10,000 there are 400,000 receivers: minutes of work."""

    def make(copies: int = 1, **options) -> Job:
        vertices = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
        halves = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
        scene = Scene(
            vertices=vertices,
            triangles=halves,
            material=np.zeros(2, np.int32),
            object=np.zeros(2, np.int32),
            materials=(Material("Grey", Constant(np.full(3, 0.5))),),
            objects=("Square",),
            lamps=(SunLamp("Sun", np.array([0.0, 0, -1]), np.full(3, np.pi)),),
        )
        loops = halves.ravel()
        target = ExportedObject("Square", 0, 2, None, identity(6).tocsr(), loops, loops)
        numbers = np.arange(2, dtype=np.int32)
        receivers = concatenate([face_receivers(vertices, halves, numbers, budget=0.1)] * copies)
        settings = Settings(quality="draft", **options)
        return Job(settings, scene, receivers, (0, receivers.count), (target,), (), (), ())

    return make


@pytest.fixture
def addon(blender):
    """The add-on registered in an empty file; taken away afterwards."""
    import radiosity_addon

    radiosity_addon.register()
    yield blender
    radiosity_addon.unregister()
