"""The Cornell box at 256²: our error and time beside Cycles', in one run.

    python -m benchmarks.cornell [--errors 0.03 0.01] [--seeds 0] [--samples 16 64 256]
                                 [--reference 2048]

References are two Cycles bakes, kept between runs (see references.py).
"""

from __future__ import annotations

import argparse
import json

from radiosity_addon.solver.workers.parallel import thread_count
from verification.comparable_texels import comparable_texels, triangle_uvs
from verification.error import reference_noise

from .ladder import Rung, cycles_ladder, judged, seconds_for, table
from .machine import machine
from .our_bake import our_bake, warm_up
from .references import cycles_references

PASSES = ("emit", "direct", "indirect", "color")
SIZE = 256


def measure(errors, seeds, samples, reference: int, size: int = SIZE, say=print) -> dict:
    """Bake the demo ourselves at each error and seed, then with Cycles; print and return it all."""
    obj = build()
    warm_up()
    ours = {(e, s): our_bake(obj, size, e, s) for e in errors for s in seeds}
    say(machine())
    references = cycles_references(obj, size, reference, PASSES)
    comparable = comparable_texels(triangle_uvs(obj), size) & references.mask
    noise = 100 * reference_noise(references.a[comparable], references.b[comparable])
    say(f"{references.mask.sum()} texels, {comparable.sum()} compared; references: {reference} "
        f"samples, each {noise:.2f} % off, {references.seconds:.0f} s")  # fmt: skip
    rungs = []
    for (error, seed), bake in ours.items():
        effort = f"error {error:g}, seed {seed}"
        rungs.append(judged("ours", effort, bake.seconds, bake.pixels, references, comparable))
        say(_figures(effort, bake))
    rungs += cycles_ladder(obj, size, references, comparable, PASSES, samples)
    say(table(rungs))
    for rung in rungs:
        if rung.method == "ours":
            say(_verdict(rung, rungs))
    return {"rungs": rungs, "bakes": ours}


def build():
    """The demo alone in the file, with its UV map made (not timed: Cycles needs it as well)."""
    import bpy

    from radiosity_addon.bake.unwrap import ensure_uv_map
    from radiosity_addon.export.demo import build_demo

    bpy.ops.wm.read_factory_settings(use_empty=True)
    obj = build_demo("cornell")
    ensure_uv_map([obj], "Radiosity", SIZE)
    return obj


def _figures(effort: str, bake) -> str:
    figures = bake.statistics
    seconds = ", ".join(f"{name} {value:.2f}" for name, value in figures.seconds.items())
    embree = figures.seconds.get("embree", 0.0) / thread_count(0)
    share = f"; {bake.seconds / embree:.1f} × Embree alone on all cores" if embree else ""
    return (f"ours, {effort}: estimated {100 * figures.estimated_error:.2f} %, "
            f"{figures.elements} elements, {figures.rays / 1e6:.2f} M rays, "
            f"{figures.iterations} iterations; {seconds}{share}")  # fmt: skip


def _verdict(rung: Rung, rungs: list[Rung]) -> str:
    """How long Cycles needs for the error that we reached."""
    parts = []
    for method in ("Cycles", "Cycles + OIDN"):
        needed = seconds_for(rung.error.error, rungs, method)
        if needed == needed:  # not measured: nan
            parts.append(f"{method} {needed:.1f} s ({needed / rung.seconds:.1f} ×)")
    return f"{rung.effort}: {rung.error} in {rung.seconds:.2f} s; as good: {', '.join(parts)}"


def main(arguments=None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cornell", description=__doc__)
    parser.add_argument("--errors", type=float, nargs="+", default=[0.1, 0.03, 0.01])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--samples", type=int, nargs="*", default=[16, 64, 256])
    parser.add_argument("--reference", type=int, default=2048)
    parser.add_argument("--json", help="write the figures there too")
    chosen = parser.parse_args(arguments)
    result = measure(chosen.errors, chosen.seeds, chosen.samples, chosen.reference)
    if chosen.json:
        rows = [{"method": r.method, "effort": r.effort, "seconds": r.seconds,
                 "error": r.error.error, "uncertainty": r.error.uncertainty}
                for r in result["rungs"]]  # fmt: skip
        with open(chosen.json, "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=1)


if __name__ == "__main__":
    main()
