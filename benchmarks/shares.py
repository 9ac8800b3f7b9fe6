"""Shares: what part of the processor's time of a bake each of its works takes.

    python -m benchmarks.shares [--scenes cornell] [--errors 0.03 0.01 0.003] [--repeats 3]

Prints the table of docs/cost.md. Both replicates run on one thread. Time inside Embree is counted by
the tracer in the quickest of ``repeats`` bakes; the other shares are of one more under a profiler,
which charges Python more than NumPy. Some works hold others. Needs bpy.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import time

from radiosity_addon.settings import Settings
from radiosity_addon.stages.prepare import prepare
from radiosity_addon.stages.run import run

from .our_bake import warm_up
from .scenes import SCENES, build

INSIDE = "inside Embree"
WORKS = {  # (file, function) that do it, Embree and all
    "elements, their rows and the linear system": [("solve_patches.py", "solve_radiosity")],
    "direct light": [("lighting.py", "add_direct")],
    "of which Lambert's formula": [("lambert.py", "polygon_form_factor")],
    "gathering": [("lighting.py", "add_gathered")],
    "of which rays that go on, and rows for what no ray had met before": [("late_rows.py", "light_of_unknown")],
    "looking up what patch a ray met": [("patches.py", "hit")],
    "directions and places of rays": [
        ("points.py", "footprint_points"),
        ("rays.py", "_shared_directions"),
        ("rays.py", "_own_directions"),
    ],
    "smoothing and judging, and who is whose neighbor": [
        ("error_estimator.py", "weigh"), ("error_estimator.py", "common"), ("error_estimator.py", "lacking"),
        ("sequence.py", "estimator_of"),
    ],
    "texels and footprints": [("layout.py", "lay_out"), ("footprints.py", "build_footprints")],
}  # fmt: skip


def shares(obj, size: int, error: float, repeats: int) -> tuple[float, dict[str, float]]:
    """Seconds of one bake of ``obj`` on one thread, and the shares of its works in [0, 1]."""
    import bpy

    settings = Settings(
        objects=(obj.name,), target="image", resolution=size, error=error, threads=1
    )
    bakes = []
    for _ in range(repeats):
        job, start = prepare(bpy.context, settings), time.perf_counter()
        statistics = run(job).statistics
        bakes.append((time.perf_counter() - start, statistics.seconds["embree"]))
    seconds, embree = min(bakes)
    job, profile = prepare(bpy.context, settings), cProfile.Profile()
    profile.runcall(run, job)
    found = {(key[0].replace("\\", "/").rsplit("/", 1)[-1], key[2]): entry[3]
             for key, entry in pstats.Stats(profile).stats.items()}  # fmt: skip
    whole = found["run.py", "run"]
    works = {
        work: sum(found.get(function, 0.0) for function in functions) / whole
        for work, functions in WORKS.items()
    }
    return seconds, {INSIDE: embree / seconds, **works}


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.shares", description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=["cornell"])
    parser.add_argument("--errors", type=float, nargs="+", default=[0.03, 0.01, 0.003])
    parser.add_argument("--size", type=int, help="of the image; the scene's own where not given")
    parser.add_argument("--repeats", type=int, default=3)
    chosen = parser.parse_args(arguments)
    warm_up()
    for name in chosen.scenes:
        scene = SCENES[name]
        obj, size = build(scene), chosen.size or scene.size
        columns = [shares(obj, size, error, chosen.repeats) for error in chosen.errors]
        asked = " | ".join(f"{100 * error:g} %" for error in chosen.errors)
        print(f"\n| {name}, {size}² | {asked} |\n|{'---|' * (1 + len(columns))}")
        for work in columns[0][1]:
            print(f"| {work} | {' | '.join(f'{100 * part[work]:.0f} %' for _, part in columns)} |")
        print(f"| processor's seconds | {' | '.join(f'{seconds:.2f}' for seconds, _ in columns)} |")


if __name__ == "__main__":
    main()
