"""Real scenes: ours beside Cycles and its denoiser, in one run, against references that a folder holds.

    python -m benchmarks.real FOLDER [--scenes kitchen town] [--errors 0.1 0.03 0.01] [--seeds N]

FOLDER has NAME.blend with a UV map ``Lightmap``, and NAME.npz with two independent Cycles bakes ``a``
and ``b`` (n, n, 3), the ``mask`` of texels that have a face, and ``clean``: those that lie in one
triangle. Those that lie wholly or partly inside other geometry are judged apart: ours leaves out what
is buried, Cycles counts it as black. Needs bpy; pyoidn for the denoiser.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from verification.error import relative_error

from .buried_texels import buried_texels
from .ladder import Rung, cycles_ladder, judged, seconds_for
from .machine import commit, machine
from .our_bake import our_bake, warm_up
from .references import References

UV_MAP = "Lightmap"
PASSES = ("direct", "indirect", "color")
OPTIONS = {"uv_map": UV_MAP, "margin": 0, "passes": PASSES}
NEVER = 1000.0  # factor [our seconds]: a rival that would take longer does not get there
SAMPLES = (4, 16, 64, 256, 1024)  # of Cycles


def opened_object(path: Path):
    """Open a scene's file: the object that its lightmap is of, the largest with the UV map."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path))
    mapped = (each for each in bpy.data.objects if UV_MAP in getattr(each.data, "uv_layers", ()))
    return max(mapped, key=lambda each: len(each.data.polygons))


def measure(path: Path, errors: list[float], seeds: int, say=print) -> None:
    """Print the table of one scene."""
    stored = np.load(path.with_suffix(".npz"))
    clean = stored["mask"] & stored["clean"]
    truth = References(stored["a"].astype(float), stored["b"].astype(float), stored["mask"], 0.0)
    size = len(clean)
    obj = opened_object(path)
    buried = buried_texels(obj, size, **OPTIONS)
    say(f"\n## {path.stem}, {size}²: {clean.sum():,} texels, of which {(clean & buried).sum():,} are buried in part\n")
    say("| method | effort | seconds | measured, % | open texels, % | estimated, % | 95 % within, % |")
    say("|---|---|---|---|---|---|---|")
    ours = []
    for error in errors:
        for seed in range(1, seeds + 1):
            bake = our_bake(obj, size, error, seed, **OPTIONS)
            rung = judged("ours", f"{100 * error:g} %", bake.seconds, bake.pixels, truth, clean)
            found = bake.statistics
            say(_line(rung, bake.pixels, truth, clean & ~buried, found.estimated_error, found.error_95))
            ours.append(rung)
    rivals = cycles_ladder(obj, size, truth, clean, PASSES, SAMPLES, uv_map=UV_MAP)
    for rung in rivals:
        say(_line(rung))
    for rung in ours:
        plain, denoised = (
            seconds_for(rung.error.error, rivals, rival) / rung.seconds
            for rival in ("Cycles", "Cycles + OIDN")
        )
        denoised = f"{denoised:.1f} × than" if denoised < NEVER else "never reached by"
        say(f"\n{rung.effort}: {plain:.1f} × faster than Cycles, {denoised} Cycles + OIDN")


def _line(rung: Rung, pixels=None, truth=None, open_texels=None, told=None, within=None) -> str:
    cells = [rung.method, rung.effort, f"{rung.seconds:.1f}", _percent(rung.error)]
    if pixels is not None:
        open_error = relative_error(pixels[open_texels], truth.a[open_texels], truth.b[open_texels])
        cells += [_percent(open_error), f"{100 * told:.2f}", f"{100 * within:.2f}"]
    return f"| {' | '.join(cells + [''] * (7 - len(cells)))} |"


def _percent(error) -> str:
    return f"{100 * error.error:.2f} ± {100 * error.uncertainty:.2f}"


def main(arguments=None) -> None:
    """Print machine and commit, then a table a scene."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("benchmarks.real", description=__doc__, formatter_class=raw)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", nargs="+", default=["kitchen", "town"])
    parser.add_argument("--errors", type=float, nargs="+", default=[0.1, 0.03, 0.01])
    parser.add_argument("--seeds", type=int, default=1)
    chosen = parser.parse_args(arguments)
    print(f"Measured on: {machine()}, commit {commit()}.")
    warm_up()
    for name in chosen.scenes:
        measure(chosen.folder / f"{name}.blend", chosen.errors, chosen.seeds)


if __name__ == "__main__":
    main()
