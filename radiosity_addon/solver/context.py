"""Context: one scene made ready for rays, shared by everything that traces them.

Depends on ``scene``, ``geometry``, ``embree``, ``lights``, ``skylight``, ``evaluate``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .embree import Tracer
from .evaluate import evaluate_material
from .geometry import Geometry, build_geometry
from .lights import build_lights, emissive_triangles
from .progress import Progress
from .scene import Scene
from .skylight import Skylight, split_sky


@dataclass(frozen=True)
class Context:
    """Light inside is divided by ``unit``, so that float32 holds scenes of any brightness."""

    scene: Scene
    geometry: Geometry
    tracer: Tracer
    lights: list  # sampled explicitly
    explicit: np.ndarray  # (n_triangles,) bool: emission is sampled, so rays must not count it
    sky: Skylight | None
    unit: float
    seed: int
    threads: int
    progress: Progress

    def tick(self, stage: str):
        """A function of the fraction done that reports it for ``stage``."""
        return lambda fraction: self.progress(stage, fraction)

    def reflectance(self, triangle: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """(n, 3) float64 at barycentric uv (n, 2) of triangles (n,)."""
        return np.clip(evaluate_material(self.scene, "reflectance", triangle, uv), 0, 1)

    def emission(self, triangle: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """(n, 3) float64 radiance in the context's unit."""
        return np.maximum(evaluate_material(self.scene, "emission", triangle, uv), 0) / self.unit


def build_context(scene: Scene, seed: int, threads: int, progress: Progress) -> Context:
    """Normalise the scene, build Embree's tree, list the lights.

    Raises ValueError where vertices are not finite or indices out of range.
    """
    from dataclasses import replace

    geometry = build_geometry(scene.vertices, scene.triangles)
    tracer = Tracer(geometry.vertices, geometry.triangles)
    sky, suns = None, []
    if scene.sky is not None and np.any(scene.sky.pixels > 0):
        pixels, suns = split_sky(scene.sky)
        sky = Skylight(pixels)
    linked = tuple(scene.lamp_objects or (None,) * len(scene.lamps)) + (None,) * len(suns)
    lit = replace(scene, lamps=tuple(scene.lamps) + tuple(suns), lamp_objects=linked)
    lights = build_lights(lit, geometry)
    triangles, _ = emissive_triangles(scene)
    explicit = np.zeros(len(scene.triangles), bool)
    explicit[triangles] = True
    unit = _brightest(scene, lights, sky)
    lights = [replace(light, color=light.color / unit) for light in lights]
    if sky is not None:
        sky = Skylight((np.pi / unit * sky.pixels).astype(np.float32))
    return Context(
        scene, geometry, tracer, lights, explicit, sky, unit, seed, threads, progress
    )


def _brightest(scene: Scene, lights: list, sky: Skylight | None) -> float:
    """A brightness to divide by: the largest colour of any source; 1 where nothing shines."""
    count = len(scene.triangles)
    middle = np.full((count, 2), 1 / 3)
    emission = evaluate_material(scene, "emission", np.arange(count), middle)
    peaks = [float(np.max(light.color)) for light in lights]
    peaks += [float(emission.max())] if emission.size else []
    peaks += [float(sky.pixels.max())] if sky is not None else []
    return max(peaks, default=0.0) or 1.0
