"""Faults: bakes killed, interrupted, starved of disk or memory: python -m benchmarks.faults

Whatever happens, the scene, an earlier result, its image file and its report must stay as they
were, byte for byte, no other file may stay anywhere, and one line must say what happened. Writes
docs/faults.md; ``--only`` prints some rows, writes nothing. Linux; some rows need leave to mount.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import time
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from random import Random

from benchmarks.fault_bakes import (
    RESULTS,
    Bake,
    Outcome,
    Place,
    demo_scene,
    helper_killed,
    interrupt_at,
    kill_at,
    limited,
    make_place,
    mounted,
    removed_during,
    second_killed,
    solver_killed,
)
from benchmarks.fault_child import STAGES
from benchmarks.machine import machine

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "faults.md"


@dataclass
class Row:
    """What one kind of fault did, each time. ``told`` must be in the message of each."""

    fault: str
    status: int
    told: str
    limit: float = float("inf")  # seconds from the fault to the end
    outcomes: list[Outcome] = field(default_factory=list)

    def wrong(self) -> list[Outcome]:
        """Those that are not as they must be: nothing changes but where the bake is done all the same."""
        changed = set(RESULTS) if self.status == 0 else set()
        return [
            o for o in self.outcomes
            if o.status != self.status or self.told not in o.message or set(o.strange) != changed
            or o.message.count("\n") != (self.status > 0) or o.seconds > self.limit
        ]  # fmt: skip

    def line(self) -> str:
        """Markdown."""
        example = self.outcomes[-1].message.strip().removeprefix("radiosity: ") or "–"
        longest = max(o.seconds for o in self.outcomes)
        slowest = f"{longest:.2f}" if longest else "–"
        held = len(self.outcomes) - len(self.wrong())
        return (f"| {self.fault} | {self.status} | {held} of {len(self.outcomes)} | {slowest} "
                f"| {example} |")  # fmt: skip


def signals(fresh, _) -> list[Row]:
    """Ctrl-C and termination at every stage."""
    rows = []
    for number, name in ((signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM")):
        row = Row(f"{name} as each of {len(STAGES)} stages begins", 130, "interrupted", 1.0)
        row.outcomes += [interrupt_at(fresh(), stage, number) for stage in STAGES]
        rows.append(row)
    return rows


def kills(fresh, length: float) -> list[Row]:
    """kill -9 at random, and in the midst of saving."""
    random = Random(0)
    row = Row("kill −9 at 20 random times", -signal.SIGKILL, "")
    row.outcomes += [kill_at(fresh, random.uniform(0, 0.9 * length)) for _ in range(20)]
    late = Row("kill −9 within 40 ms of the start of writing", -signal.SIGKILL, "")
    for stage in ("write", "save"):
        for delay in (0, 0.02, 0.04):
            late.outcomes.append(interrupt_at(fresh(), stage, signal.SIGKILL, delay))
    return [row, late]


def solvers(fresh, _) -> list[Row]:
    """kill -9 of the process that solves for the button."""
    random = Random(1)
    row = Row("the solver's process killed at 5 random times, baking from the button", 1, "stopped")
    for _ in range(5):
        row.outcomes.append(solver_killed(fresh(), random.uniform(0, 2)))
    return [row]


def twins(fresh, _) -> list[Row]:
    """kill -9 of the process that does half of the work."""
    stages = ("transport", "solve", "gather")
    row = Row(f"the second process killed as each of {len(stages)} stages begins", 1, "ended", 1.0)
    row.outcomes += [second_killed(fresh(), stage) for stage in stages]
    helper = Row(f"one of four helper processes killed as each of {len(stages)} stages begins", 0, "")
    helper.outcomes += [helper_killed(fresh(), stage) for stage in stages]
    return [row, helper]


def disks(fresh, _) -> list[Row]:
    """A limit on the size of files, and a file system that is full."""
    import resource

    rows = [Row("image file larger than allowed", 1, "disk not full"),
            Row(".blend larger than allowed", 1, "free some space")]  # fmt: skip
    limit = {resource.RLIMIT_FSIZE: 20_000}
    rows[0].outcomes.append(limited(fresh(), limit))
    place = fresh()
    vertex = [str(place.scene), "--quality", "draft"]
    rows[1].outcomes.append(limited(place, {resource.RLIMIT_FSIZE: 4000}, vertex))
    for size in (50, 200, 400):
        place = fresh()
        with mounted(place.folder / "tight", ["-t", "tmpfs", "-o", f"size={size}k", "none"]) as ok:
            if ok:
                output = ["--output", str(place.folder / "tight" / "out.blend")]
                row = Row(f"file system of {size} kB full while saving", 1, "free some space")
                row.outcomes.append(limited(place, {}, place.words() + output))
                rows.append(row)
    return rows


def folders(fresh, _) -> list[Row]:
    """Output folders that cannot be written to."""
    place, row = fresh(), Row("output on a read-only file system", 1, "is not writable")
    rows = []
    with mounted(place.folder / "images", ["--bind", "-o", "ro", str(place.images)]) as ok:
        if ok:
            row.outcomes.append(limited(place, {}))
            rows.append(row)
    place, row = fresh(), Row("output folder is a file", 1, "is a file")
    output = ["--output", str(place.scene / "out.blend")]
    row.outcomes.append(limited(place, {}, place.words() + output))
    gone = Row("output folder removed during the bake", 1, "does not exist")
    gone.outcomes.append(removed_during(fresh()))
    return [*rows, row, gone]


def memories(fresh, _) -> list[Row]:
    """Limits on the address space (ulimit -v), from hopeless to nearly enough."""
    import resource

    rows = []
    for megabytes, told in ((300, "to start"), (1200, "to start"), (1900, "to start"),
                            (2200, "--resolution"), (2500, "--resolution")):  # fmt: skip
        place = fresh()
        row = Row(f"{megabytes} MB of address space, 1024² texels", 1, told)
        words = place.words() + ["--resolution", "1024"]
        row.outcomes.append(limited(place, {resource.RLIMIT_AS: megabytes << 20}, words))
        rows.append(row)
    return rows


FAULTS = {"signals": signals, "kills": kills, "solvers": solvers, "twins": twins, "disks": disks,
          "folders": folders, "memories": memories}  # fmt: skip

INTRODUCTION = """# Faults

A bake of the Cornell box into an image of 256² texels, with a file of it and a report, which an
earlier bake left behind too. Held means: the scene and all that was there are the same, byte for
byte; no other file is left, in the folders or among the temporary files; the exit status is right
(a process that was killed has no say in it); there is one line on standard error, shown here; and
Ctrl-C was answered within a second. Regenerate with `python -m benchmarks.faults`.

"""


def main() -> int:
    """Run all faults, or those named; 1 where something is not as it must be."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--only", choices=FAULTS)
    only = parser.parse_args().only
    scene, rows = demo_scene(), []
    with tempfile.TemporaryDirectory() as folder:
        numbers = count()

        def fresh() -> Place:
            return make_place(Path(folder) / str(next(numbers)), scene)

        place, began = fresh(), time.monotonic()
        Bake(place, place.words()).end()
        length = time.monotonic() - began
        for name, run in FAULTS.items():
            rows += run(fresh, length) if only in (None, name) else []
    lines = ["| fault | exit status | held | longest answer [s] | what it says |",
             "|---|---|---|---|---|", *(row.line() for row in rows)]  # fmt: skip
    text = "\n".join(lines).replace(folder, "…") + "\n"
    print(text)
    for row in rows:
        for each in row.wrong():
            print("not held:", row.fault, each)
    if only is None:
        PAGE.write_text(INTRODUCTION + text + f"\n{machine()}\n", encoding="utf-8")
    return int(any(row.wrong() for row in rows))


if __name__ == "__main__":
    sys.exit(main())
