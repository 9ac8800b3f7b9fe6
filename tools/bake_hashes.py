"""Hashes of small bakes of all kinds: a change that is to leave every bit as it is shows here that
it does.

    python tools/bake_hashes.py before.json [--threads N]
    (change the code)
    python tools/bake_hashes.py after.json --compare before.json

Bits differ among machines and versions of NumPy: compare what one machine wrote. Needs bpy.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from radiosity_addon import bake_job
from radiosity_addon.solver.adaptive.solve_cache import SolveCache
from radiosity_addon.solver.progress import silent
from tools.bake_scenes import BAKES, Bake


def digest(result: bake_job.Result) -> str:
    """A hash of all that is the same in each run: colors, figures but seconds, warnings."""
    found, statistics = hashlib.sha256(), result.statistics
    for colors in result.colors:
        colors = np.ascontiguousarray(colors)
        found.update(f"{colors.dtype} {colors.shape}".encode())
        found.update(colors.tobytes())
    figures = (
        statistics.elements, statistics.rays, statistics.iterations, statistics.residual, statistics.estimated_error,
        statistics.error_95, statistics.energy, result.receivers, result.warnings,
    )  # fmt: skip
    found.update(repr(figures).encode())
    return found.hexdigest()[:24]


def hashes(bake: Bake, threads: int, run=bake_job.run) -> list[str]:
    """Of a bake, and of the second where it is baked again; ``run``: as ``bake_job.run``."""
    import bpy

    settings = replace(bake.settings, threads=threads)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bake.build()
    kept = SolveCache() if bake.again else None
    found = []
    for change in (None, bake.again)[: 2 if bake.again else 1]:
        if change:
            change()
        job = bake_job.prepare(bpy.context, settings)
        found.append(digest(run(job, silent, kept, None, bake.tiling)))
        bake_job.discard(bpy.context, job)
    return found


def differing(one: dict[str, list[str]], other: dict[str, list[str]]) -> Iterator[str]:
    """Names of bakes that both have and whose hashes are not the same, or that one lacks."""
    return (name for name in {**one, **other} if one.get(name) != other.get(name))


def main(argv: list[str] | None = None, bakes: dict[str, Bake] = BAKES, run=bake_job.run) -> int:
    """Write the hashes of ``bakes``; the exit status is 1 where some are others than before."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("file", type=Path, help="JSON to write")
    parser.add_argument("--compare", type=Path, help="JSON to compare with")
    parser.add_argument("--threads", type=int, default=1)
    asked = parser.parse_args(argv)
    found = {name: hashes(bake, asked.threads, run) for name, bake in bakes.items()}
    asked.file.write_text(json.dumps(found, indent=1))
    if asked.compare is None:
        return 0
    others = list(differing(json.loads(asked.compare.read_text()), found))
    print(f"not the same: {', '.join(others)}" if others else f"all {len(found)} are the same")
    return bool(others)


if __name__ == "__main__":
    sys.exit(main())
