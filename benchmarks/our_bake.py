"""Our own bake of an object in the open file, timed."""

from __future__ import annotations

import atexit
import time
from dataclasses import dataclass
from functools import cache

import numpy as np

from radiosity_addon.replicate_process import ReplicateProcess, start_replicate_process
from radiosity_addon.settings import Settings
from radiosity_addon.solver.solution import Statistics


@dataclass(frozen=True)
class OurBake:
    """``pixels`` (size, size, 3) radiance; ``mask`` texels with alpha; ``seconds`` of the whole
    bake: UV map, export, solve, fit, and the image written."""

    pixels: np.ndarray
    mask: np.ndarray
    seconds: float
    statistics: Statistics


def warm_up() -> None:
    """Import what a bake imports on first use, so that no measurement pays for it."""
    import scipy.ndimage  # noqa: F401
    import scipy.sparse.linalg  # noqa: F401
    import scipy.spatial  # noqa: F401

    import radiosity_addon.solver.sequence  # noqa: F401
    import radiosity_addon.stages.apply  # noqa: F401
    import radiosity_addon.stages.prepare  # noqa: F401
    import radiosity_addon.stages.run  # noqa: F401


@cache
def second_process() -> ReplicateProcess | None:
    twin = start_replicate_process(0)
    if twin is not None:
        atexit.register(twin.close)
    return twin


def our_bake(obj, size: int, error: float, seed: int = 0, **options) -> OurBake:
    """Bake ``obj`` to an image as the command line would, all cores, and time all of it, but the
    start of the second process: it starts while Blender does."""
    import bpy

    from radiosity_addon.stages.apply import apply
    from radiosity_addon.stages.prepare import prepare
    from radiosity_addon.stages.run import run

    settings = Settings(
        objects=(obj.name,), target="image", resolution=size, error=error, seed=seed, **options
    )
    settings.check()
    start = time.perf_counter()
    job = prepare(bpy.context, settings)
    result = run(job, beside=second_process())
    apply(bpy.context, job, result)
    seconds = time.perf_counter() - start
    pixels = np.asarray(result.colors[0], float)
    return OurBake(pixels[..., :3], pixels[..., 3] > 0.5, seconds, result.statistics)
