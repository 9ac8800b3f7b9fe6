"""Vertex colors beside much finer ones: what a bake says of its error, and what it is.

    python -m benchmarks.vertices [--scene living_room] [--errors 0.1 0.03 0.01] [--seeds 0 1]
                                  [--truth 0.005]

Cycles bakes a vertex color at a point, so it is no reference for colors fitted to faces; two bakes
of our own to ``--truth`` are, which tells nothing of an error that bakes of any fineness share. A corner counts by
its part of the faces' area. Most of the squared error may sit in few corners: ``most`` is without the worst hundredth
of them. Needs bpy.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from radiosity_addon.bake.layers import bulk
from radiosity_addon.settings import Settings
from radiosity_addon.stages.prepare import prepare
from radiosity_addon.stages.run import run
from verification.error import Measured, local_squares, relative_error

from .scenes import SCENES, build

SEEDS = (101, 202)  # of the two finer bakes


@dataclass(frozen=True)
class Row:
    """One bake: what it says and what it is off, with all corners and without the worst."""

    asked: float
    seed: int
    said: float
    found: Measured
    most: Measured


def corner_colors(obj, error: float, seed: int) -> tuple[np.ndarray, float]:
    """(n, 3) radiance at the object's corners, and the estimated error."""
    import bpy

    settings = Settings(objects=(obj.name,), target="vertex", error=error, seed=seed)
    result = run(prepare(bpy.context, settings))
    return np.asarray(result.colors[0], float)[:, :3], result.statistics.estimated_error


def corner_areas(obj) -> np.ndarray:
    """(n,) square meters of the corners: each triangle gives a third of its own to each of its."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    loops = bulk(mesh.loop_triangles, "loops", np.int32, 3)
    area = bulk(mesh.loop_triangles, "area", np.float32)
    return np.bincount(loops.ravel(), np.repeat(area / 3, 3), len(mesh.loops))


def measure(obj, errors, seeds, truth: float, say=print) -> list[Row]:
    """Bake the object's vertex colors at each error and seed; print and return what was found."""
    a, b = (corner_colors(obj, truth, seed)[0] for seed in SEEDS)
    area = corner_areas(obj)
    share = area / area.sum()
    say(f"two bakes to {100 * truth:g} % are {relative_error(a, b, area=area)} apart")
    rows = []
    for error in errors:
        for seed in seeds:
            x, said = corner_colors(obj, error, seed)
            light = (a + b).mean(axis=1) / 2
            _, squares = local_squares(x, a, b, float(share @ light))
            most = np.sort(np.argsort(share * squares)[: len(squares) - len(squares) // 100])
            rows.append(Row(error, seed, said, relative_error(x, a, b, area),
                            relative_error(x[most], a[most], b[most], area[most])))  # fmt: skip
            row = rows[-1]
            say(f"asked {100 * error:g} %, seed {seed}: says {100 * said:.2f} %, "
                f"is {row.found}; most corners {row.most}")  # fmt: skip
    return rows


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.vertices", description=__doc__)
    parser.add_argument("--scene", choices=list(SCENES), default="living_room")
    parser.add_argument("--errors", type=float, nargs="+", default=[0.1, 0.03, 0.01])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--truth", type=float, default=0.005)
    chosen = parser.parse_args(arguments)
    measure(build(SCENES[chosen.scene]), chosen.errors, chosen.seeds, chosen.truth)


if __name__ == "__main__":
    main()
