"""Baking again after a change, beside a bake from scratch: python -m benchmarks.again

Prints a table of one scene (``--scene`` of benchmarks/scenes.py, ``--error``). Seconds are of the
solver's part, by the processor over all threads: what else the machine does is left out.
"""

from __future__ import annotations

import argparse
import pickle
import time
from dataclasses import dataclass, replace

from benchmarks import scenes
from radiosity_addon.settings import Settings

SIZE = 256


@dataclass(frozen=True)
class Row:
    """One change: seconds from scratch and again, and what was used again."""

    change: str
    fresh: float
    again: float
    reused: str

    @property
    def ratio(self) -> float:
        """Seconds again over seconds from scratch."""
        return self.again / self.fresh


def brighter(scene):
    """The same scene with other colors and strengths of all that shines."""
    from radiosity_addon.solver.fields import Constant
    from radiosity_addon.solver.scene import lamp_color

    tint = (2.0, 1.5, 1.0)
    lamps = tuple(
        replace(lamp, **{lamp.color_field: lamp_color(lamp) * tint})
        for lamp in scene.lamps
    )
    materials = tuple(
        replace(material, emission=Constant(material.emission.value * tint))
        if isinstance(material.emission, Constant) else material
        for material in scene.materials
    )  # fmt: skip
    return replace(scene, lamps=lamps, materials=materials)


def measure(build, error: float, size: int = SIZE) -> list[Row]:
    """The scene that ``build()`` makes, baked to vertex colors, then changed in four ways."""
    import bpy

    from radiosity_addon.bake_job import discard, prepare

    bpy.ops.wm.read_factory_settings(use_empty=True)
    build()
    vertex = Settings(error=error)
    image = replace(vertex, target="image", resolution=size)
    jobs = []
    for settings in (vertex, image, replace(image, resolution=2 * size)):
        jobs.append(prepare(bpy.context, settings))
        discard(bpy.context, jobs[-1])
    other = replace(jobs[0], settings=replace(vertex, passes=("indirect",)))
    lit = replace(jobs[0], scene=brighter(jobs[0].scene))
    first, _ = _kept(jobs[0])
    second, fresh = _kept(jobs[1])
    return [
        _row("passes: indirect light only", first, other),
        _row(f"target: an image of {size} texels", first, jobs[1], fresh),
        _row(f"resolution: {2 * size} instead of {size} texels", second, jobs[2]),
        _row("colors and strengths of all lights", first, lit),
    ]


def _kept(job) -> tuple[bytes, float]:
    """The pickled cache that a bake from scratch leaves, and its seconds."""
    from radiosity_addon.bake_job import run
    from radiosity_addon.solver.adaptive.solve_cache import SolveCache

    kept = SolveCache()
    seconds = _seconds(lambda: run(job, cache=kept))
    return pickle.dumps(kept), seconds


def _row(change: str, before: bytes, after, fresh: float | None = None) -> Row:
    """``after`` baked with the cache that a bake ``before`` left, and from scratch."""
    from radiosity_addon.bake_job import run

    kept = pickle.loads(before)
    if fresh is None:
        fresh = _seconds(lambda: run(after))
    return Row(change, fresh, _seconds(lambda: run(after, cache=kept)), kept.reused or "nothing")


def _seconds(work) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def table(rows: list[Row]) -> str:
    """Markdown."""
    lines = ["| changed | from scratch | again | again / scratch | used again |"]
    lines.append("|---|---|---|---|---|")
    lines += [
        f"| {row.change} | {row.fresh:.2f} s | {row.again:.2f} s | {row.ratio:.2f} | {row.reused} |"
        for row in rows
    ]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="cornell", help="a function of benchmarks/scenes.py")
    parser.add_argument("--error", type=float, default=0.03)
    asked = parser.parse_args()
    print(table(measure(getattr(scenes, asked.scene), asked.error)))


if __name__ == "__main__":
    main()
