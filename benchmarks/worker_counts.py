"""Workers: what a bake takes of 1, 2, 4 and 8 processes in all, and what it would take on as many cores.

    python -m benchmarks.worker_counts FILE.blend [--error 0.03] [--size 512] [--threads 1 2 4 8] [--uv-map Lightmap]

Each bake is the command line's, as users start it. Processor seconds are those of all its processes, from
the first to the last, Blender's and the libraries' import among them; with more processes than cores its own
wall seconds say nothing. So one bake more, on one thread under a profiler, tells what processes share
among them (``Context.map_chunks``) and what each replicate, or only the first process, does alone; wall
seconds on n cores follow: alone + of a replicate + shared / n. Linux alone tells the seconds of processes that outlive
those who started them. Needs bpy.
"""

from __future__ import annotations

import argparse
import cProfile
import ctypes
import hashlib
import json
import os
import pstats
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from radiosity_addon.settings import Settings
from radiosity_addon.stages.prepare import prepare
from radiosity_addon.stages.run import run

from .machine import machine

SUBREAPER = 36  # number [prctl]: who inherits the children of children that have ended
PASSES = "direct,indirect,color"


@dataclass(frozen=True)
class Whole:
    """A bake of so many ``threads``: processor seconds and peak memory [bytes] of all its processes, the hash of
    its image."""

    threads: int
    seconds: float
    memory: int
    image: str


def whole_bake(path: Path, error: float, size: int, uv_map: str, threads: int) -> Whole:
    """The command line's bake, in processes of its own."""
    with tempfile.TemporaryDirectory() as folder:
        report, images = Path(folder) / "o.json", Path(folder) / "images"
        images.mkdir()
        words = ["--target", "image", "--resolution", str(size), "--uv-map", uv_map, "--margin", "0",
                 "--passes", PASSES, "--error", str(error), "--threads", str(threads),
                 "--output", str(Path(folder) / "o.blend"), "--image-dir", str(images),
                 "--report", str(report)]  # fmt: skip
        before = _children_seconds()
        subprocess.run([sys.executable, "-m", "radiosity_addon", str(path), *words], check=True,
                       stdout=subprocess.DEVNULL)  # fmt: skip
        found = hashlib.sha256(b"".join(p.read_bytes() for p in sorted(images.iterdir())))
        memory = json.loads(report.read_text(encoding="utf-8"))["peak_memory"]
        return Whole(threads, _children_seconds() - before, memory, found.hexdigest()[:12])


def _children_seconds() -> float:
    """Processor seconds of all children that have ended, and theirs."""
    try:
        while True:
            os.wait()
    except ChildProcessError:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime


@dataclass(frozen=True)
class Parts:
    """Processor seconds of a bake on one thread: what processes share, what each replicate does alone, and what
    only the first process does."""

    shared: float
    replicate: float
    first: float

    def wall(self, cores: int) -> float:
        """Seconds on so many cores, two at least."""
        return self.first + self.replicate + self.shared / cores


def parts_of(path: Path, error: float, size: int, uv_map: str) -> Parts:
    """Those of a bake of the file's largest object with that UV map."""
    import bpy

    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj = max((o for o in bpy.data.objects if uv_map in getattr(o.data, "uv_layers", ())),
              key=lambda o: len(o.data.polygons))  # fmt: skip
    settings = Settings(objects=(obj.name,), target="image", resolution=size, error=error, threads=1,
                        uv_map=uv_map, margin=0, passes=tuple(PASSES.split(",")))  # fmt: skip
    job, profile = prepare(bpy.context, settings), cProfile.Profile(time.process_time)
    profile.runcall(run, job)
    found = {(key[0].replace("\\", "/").rsplit("/", 1)[-1], key[2]): entry[3]
             for key, entry in pstats.Stats(profile).stats.items()}  # fmt: skip
    shared = found["context.py", "map_chunks"]
    second = found["second_replicate.py", "answers"]
    # Both replicates share and do about the same; the second is all that its answers take.
    replicate = max(second - shared / 2, 0.0)
    return Parts(shared, replicate, found["run.py", "run"] - shared - 2 * replicate)


def main(arguments=None) -> None:
    """Print both tables."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("benchmarks.worker_counts", description=__doc__, formatter_class=raw)
    parser.add_argument("file", type=Path)
    parser.add_argument("--error", type=float, default=0.03)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--uv-map", default="Lightmap")
    chosen = parser.parse_args(arguments)
    ctypes.CDLL(None).prctl(SUBREAPER, 1, 0, 0, 0)
    what = chosen.file, chosen.error, chosen.size, chosen.uv_map
    print(f"Measured on: {machine()}.\n\n{chosen.file.stem}, {chosen.size}², {100 * chosen.error:g} %\n")
    print("| processes | processor's seconds | × of one | memory, GB | image |\n|---|---|---|---|---|")
    first = None
    for threads in chosen.threads:
        bake = whole_bake(*what, threads)
        first = first or bake
        same = "the same" if bake.image == first.image else "another"
        print(f"| {threads} | {bake.seconds:.1f} | {bake.seconds / first.seconds:.2f} | "
              f"{bake.memory / 1e9:.2f} | {same} |", flush=True)  # fmt: skip
    parts = parts_of(*what)
    total = parts.shared + 2 * parts.replicate + parts.first
    shares = [100 * each / total for each in (parts.shared, 2 * parts.replicate, parts.first)]
    print("\n| shared | of each replicate, both | only in the first process |"
          f"\n|---|---|---|\n| {' | '.join(f'{share:.1f} %' for share in shares)} |")  # fmt: skip
    walls = ", ".join(f"{cores}: {parts.wall(cores) / parts.wall(2):.2f}" for cores in (2, 4, 8, 16))
    print(f"\nWall seconds on so many cores, × those on two: {walls}")


if __name__ == "__main__":
    main()
