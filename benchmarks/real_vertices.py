"""Vertex colors of real scenes: how far what they show is from the light, and from bake to bake.

    python -m benchmarks.real_vertices FOLDER [--scenes kitchen town] [--errors 0.03] [--seeds 2]

FOLDER is that of ``benchmarks.real``. *Shown* is the color interpolated to the middle of each texel that lies in one triangle, against
the light of two Cycles bakes there: what a mesh is too coarse to show is most of it. It is told over the surface (*by area*), and as seen
in pictures from anywhere (*in views*, each texel by its mean free path in the object alone; all have about one area), for all and for the best 99 %, as hidden
places are shown far too bright. *Noise* is the error of one bake that another seed tells, by the corners' part of the surface. A bake
*estimates* its own but for the hundredth of the surface that is least seen. Needs bpy.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from radiosity_addon.bake.faces import triangle_areas
from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.settings import Settings
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.receivers import chosen_receivers
from radiosity_addon.solver.transport.free_paths import find_free_paths
from radiosity_addon.stages.prepare import prepare
from radiosity_addon.stages.run import run
from verification import meshes
from verification.comparable_texels import covered_texels, triangle_uvs
from verification.error import local_squares

from .machine import machine
from .our_bake import second_process, warm_up
from .real import PASSES, UV_MAP, opened_object
from .vertices import corner_areas

BEST = 0.99  # share [of the surface, or of what is seen]: the rest may be far off, where nobody looks


@dataclass(frozen=True)
class Places:
    """Middles of k texels that lie in one triangle each: the corners (k, 3) int around them, their barycentric coordinates
    (k, 3), the light there in two references (k, 3) each, and how much of them is seen (k,)."""

    corners: np.ndarray
    weights: np.ndarray
    references: tuple[np.ndarray, np.ndarray]
    seen: np.ndarray

    def shown(self, colors: np.ndarray) -> np.ndarray:
        """(k, 3) of ``colors`` (n_loops, 3)."""
        return (self.weights[:, :, None] * colors[self.corners]).sum(axis=1)


def places_of(obj, stored) -> Places:
    """Those of an object's lightmap whose references are ``stored``, in a scene of this object alone."""
    keep = stored["mask"] & stored["clean"]
    uv = triangle_uvs(obj, UV_MAP)
    points = np.array([obj.matrix_world @ each.co for each in obj.data.vertices])
    triangles, loops = (np.array([getattr(each, name)[:] for each in obj.data.loop_triangles]) for name in ("vertices", "loops"))
    some = triangle_areas(points, triangles) > 0
    uv, triangles, loops = uv[some], triangles[some], loops[some]
    receivers = texel_receivers(uv, np.arange(len(uv)), len(keep))
    texel, triangle, corners = covered_texels(receivers, uv, len(keep))
    kept = keep[receivers.grid[texel, 1], receivers.grid[texel, 2]]
    texel, triangle, corners = texel[kept], triangle[kept], corners[kept]
    row, column = receivers.grid[texel, 1], receivers.grid[texel, 2]
    middle = (corners[:, 1] + corners[:, 2]) / 2
    context = build_context(meshes.scene([(points, triangles)], 0.5), 0, 1, silent)
    chosen = chosen_receivers(receivers, np.isin(np.arange(receivers.count), texel))
    return Places(
        loops[triangle], np.column_stack([1 - middle.sum(axis=1), middle]),
        tuple(stored[name][row, column].astype(float) for name in "ab"), find_free_paths(context, chosen).mean,
    )  # fmt: skip


def off(places: Places, colors: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """The relative error of what ``colors`` (n_loops, 3) show, by ``weight`` (k,) of the places: of all and of the BEST."""
    a, b = places.references
    _, squares = local_squares(places.shown(colors), a, b, float((a + b).mean() / 2))
    return _all_and_best(squares, weight)


def noise(colors: np.ndarray, other: np.ndarray, area: np.ndarray) -> tuple[float, float]:
    """The relative error of ``colors`` (n, 3) that those of ``other`` (n, 3), of another seed, tell, by ``area`` (n,): of all and of the BEST."""
    mean = (colors + other) / 2
    _, squares = local_squares(colors, mean, mean, float(np.average(mean.mean(axis=1), weights=area)))
    return _all_and_best(2 * squares, area)


def _all_and_best(squares: np.ndarray, weight: np.ndarray) -> tuple[float, float]:
    """Roots of the means of ``squares`` (k,) by ``weight`` (k,): of all and of the BEST."""
    share = weight / weight.sum()
    order = np.argsort(squares)
    total, reached = np.cumsum((share * squares)[order]), np.cumsum(share[order])
    best = min(np.searchsorted(reached, BEST), len(reached) - 1)
    return float(np.sqrt(max(total[-1], 0))), float(np.sqrt(max(total[best] / reached[best], 0)))


def measure(path: Path, errors: list[float], seeds: int, say=print) -> None:
    """Print the table of one scene."""
    import bpy

    obj = opened_object(path)
    places, area = None, corner_areas(obj)
    say(f"\n## {path.stem}\n\n| asked | seed | seconds | estimated, % | noise, % | best 99 % | in views, % | best 99 % | by area, % | best 99 % |\n"
        "|---|---|---|---|---|---|---|---|---|---|")  # fmt: skip
    for error in errors:
        bakes = []
        for seed in range(seeds):
            settings = Settings(objects=(obj.name,), target="vertex", error=error, seed=seed, passes=PASSES)
            started = time.perf_counter()
            result = run(prepare(bpy.context, settings), beside=second_process())
            bakes.append((np.asarray(result.colors[0], float)[:, :3], time.perf_counter() - started, result.statistics))
        places = places or places_of(obj, np.load(path.with_suffix(".npz")))
        for seed, (colors, seconds, found) in enumerate(bakes):
            differs = noise(colors, bakes[seed - 1][0], area) if seeds > 1 else (np.nan, np.nan)
            figures = (found.estimated_error, *differs, *off(places, colors, places.seen), *off(places, colors, np.ones(len(places.seen))))
            say(f"| {100 * error:g} % | {seed} | {seconds:.1f} | " + " | ".join(f"{100 * each:.2f}" for each in figures) + " |")


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.real_vertices", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", nargs="+", default=["kitchen", "town"])
    parser.add_argument("--errors", type=float, nargs="+", default=[0.03])
    parser.add_argument("--seeds", type=int, default=2)
    chosen = parser.parse_args(arguments)
    warm_up()
    print(f"Measured on: {machine()}.")
    for name in chosen.scenes:
        measure(chosen.folder / f"{name}.blend", chosen.errors, chosen.seeds)


if __name__ == "__main__":
    main()
