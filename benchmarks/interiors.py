"""Interiors: measured error beside the estimated one, in rooms of 20,000 triangles and more, by the path tracer.

    python -m benchmarks.interiors [--scenes NAME…] [--sizes 512…] [--errors 0.03…] [--seeds N]

Texels are drawn in proportion to their share of the surface. Each is traced at random points of it by
``verification/path_tracer.py``, which knows nothing of the solver, until its own noise is small
beside the error asked for; what is left of that noise is taken off.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.interior_scenes import INTERIORS
from radiosity_addon.bake_job import prepare
from radiosity_addon.settings import Settings
from radiosity_addon.solver.geometry.footprints import build_footprints
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.sampling.points import footprint_points
from radiosity_addon.solver.sequence import open_scene, solve
from radiosity_addon.stages.bury import open_layout
from radiosity_addon.stages.layout import lay_out
from verification.error import FLOOR, local_squares
from verification.path_tracer import irradiance

TEXELS = 200  # that are traced
POINTS = 64  # of each, at random
FIRST_PATHS = 8  # from each point, from which the number is found that the noise needs
MOST_PATHS = 64
NOISE = 0.4  # times the error asked for: the tracer's standard error at a texel, in the mean square


@dataclass(frozen=True)
class Traced:
    """Two halves (2, n, 3) of the irradiance at texels ``chosen`` (n,), independent, and the mean
    radiance of the surface."""

    chosen: np.ndarray
    halves: np.ndarray
    mean: float

    def error(self, found: np.ndarray, reflectance: np.ndarray) -> tuple[float, float]:
        """The relative error of irradiances ``found`` (n, 3), and its standard error: (x − a)(x − b)
        over the square of max(own, a quarter of the mean) has no part of the tracer's noise."""
        scale = reflectance[self.chosen] / np.pi
        a, b = (half * scale for half in self.halves)
        _, square = local_squares(found[self.chosen] * scale, a, b, self.mean)
        error = np.sqrt(max(square.mean(), 0.0))
        spread = square.std() / np.sqrt(len(square))
        return float(error), float(spread / (2 * error) if error > 0 else np.sqrt(spread))


@dataclass(frozen=True)
class Opened:
    """A scene to bake into one image, and what the solver is given."""

    job: object
    receivers: object
    footprints: object

    @property
    def scene(self):
        return self.job.scene


def opened(settings: Settings) -> Opened:
    """The file that is open in Blender."""
    import bpy

    job = prepare(bpy.context, settings)
    layout = lay_out(job, silent)
    context = open_scene(job.scene, layout.receivers, settings)
    receivers = open_layout(layout, context).receivers
    geometry = build_geometry(job.scene.vertices, job.scene.triangles)
    return Opened(job, receivers, build_footprints(geometry, receivers))


def trace(room: Opened, light: np.ndarray, reflectance: np.ndarray, error: float) -> Traced:
    """The truth at a sample of the texels; ``light`` (count, 3) tells how bright the surface is."""
    random, scene = np.random.default_rng(7), _plain(room.scene)
    area = room.footprints.area
    chosen = random.choice(len(area), TEXELS, p=area / area.sum())
    mean = float((area / area.sum()) @ (light * reflectance / np.pi).mean(axis=1))

    def half(paths: int, seed: int) -> np.ndarray:
        turn = random.random((TEXELS, 3)).astype(np.float32)
        points = footprint_points(room.footprints, chosen, turn, POINTS, 7, seed)
        triangle, uv = points.triangle.T.ravel(), points.uv.transpose(1, 0, 2).reshape(-1, 2)
        found = irradiance(scene, triangle, uv, paths, seed)
        return (found.direct + found.indirect).reshape(TEXELS, POINTS, 3).mean(axis=1)

    def halves(paths: int, seed: int) -> np.ndarray:
        return np.stack([half(paths, seed), half(paths, seed + 1)])

    rough = halves(FIRST_PATHS, 11)
    scale = reflectance[chosen] / np.pi
    level = np.maximum((rough.mean(axis=0) * scale).mean(axis=1), FLOOR * mean)[:, None]
    noise = np.sqrt((((rough[0] - rough[1]) * scale / level) ** 2).mean() / 4)
    paths = int(np.clip(FIRST_PATHS * (noise / (NOISE * error)) ** 2, FIRST_PATHS, MOST_PATHS))
    return Traced(chosen, halves(paths, 21), mean)


def _plain(scene):
    """The same scene as one whose objects meet all rays, which it is. Raises ValueError where not."""
    for met in (scene.casts_shadow, scene.visible):
        if met is not None and not met.all():
            raise ValueError("an object of the scene does not meet all rays; the tracer's do")
    return replace(scene, casts_shadow=None, visible=None, lamp_objects=None, lamp_blockers=None)


def measure(name: str, size: int, errors, seeds: int, say=print) -> None:
    """All errors and seeds for one scene and image size, a line each."""
    INTERIORS[name]()
    passes = ("direct", "indirect", "color")
    settings = Settings(target="image", resolution=size, passes=passes, error=min(errors))
    room, truth = opened(settings), None
    for error in sorted(errors):
        for seed in range(seeds):
            began = time.perf_counter()
            solution = solve(room.scene, room.receivers, replace(settings, error=error, seed=seed))
            light = solution.direct + solution.indirect
            seconds = time.perf_counter() - began
            truth = truth or trace(room, light, solution.diffuse, min(errors))
            found, spread = truth.error(light, solution.diffuse)
            told = solution.statistics.estimated_error
            say(f"{name} {size}² {len(room.scene.triangles)} triangles, asked {100 * error:g} %, seed "
                f"{seed}: measured {100 * found:.2f} ± {100 * spread:.2f} %, estimated {100 * told:.2f} %, "
                f"{seconds:.1f} s")  # fmt: skip


def main(argv: list[str] | None = None) -> None:
    """Measure and print."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("benchmarks.interiors", description=__doc__, formatter_class=raw)
    parser.add_argument("--scenes", nargs="+", choices=INTERIORS, default=list(INTERIORS))
    parser.add_argument("--sizes", type=int, nargs="+", default=[512])
    parser.add_argument("--errors", type=float, nargs="+", default=[0.03])
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args(argv)
    for name in arguments.scenes:
        for size in arguments.sizes:
            measure(name, size, arguments.errors, arguments.seeds,
                    lambda line: print(line, flush=True))  # fmt: skip


if __name__ == "__main__":
    main()
