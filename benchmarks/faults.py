"""Faults: bakes killed, interrupted, starved of disk or memory: python -m benchmarks.faults

Whatever happens, the scene, an earlier result, its image file and its report must stay as they
were, byte for byte, no other file may stay anywhere, and one line must say what happened. Writes
docs/faults.md; ``--only`` prints some rows, writes nothing. Linux; some rows need leave to mount.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from random import Random

from benchmarks.fault_child import STAGES
from benchmarks.machine import machine

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "faults.md"
RESULTS = ("images/Radiosity_Cornell.exr", "report.json", "scene_baked.blend")
PATIENCE = 60  # seconds for a stage to come


@dataclass(frozen=True)
class Place:
    """A folder with a scene, an earlier result of it, and temporary files of its own."""

    folder: Path
    size: int = 256  # texels along an edge of the image

    @property
    def scene(self) -> Path:
        return self.folder / "scene.blend"

    @property
    def images(self) -> Path:
        return self.folder / "images"

    def words(self) -> list[str]:
        """The command line of a bake that would replace everything earlier."""
        report = str(self.folder / "report.json")
        image = ["--target", "image", "--image-dir", str(self.images), "--resolution"]
        return [str(self.scene), *image, str(self.size), "--report", report, "--quality=draft"]

    def contents(self) -> dict[str, str]:
        """Digests of all files below, and the folders; the janitor may be at work there, so that
        a folder goes while it is read, which ``os.walk`` passes over."""
        paths = [
            Path(root, name)
            for root, folders, files in os.walk(self.folder)
            for name in (*folders, *files)
        ]
        return {str(path.relative_to(self.folder)): _digest(path) for path in paths}


def _digest(path: Path) -> str:
    if path.is_dir():
        return "folder"
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return "just gone"


def make_place(folder: Path, scene: bytes, size: int = 256) -> Place:
    """``folder`` filled with the scene and what an earlier bake might have left."""
    place = Place(folder, size)
    for each in (place.images, folder / "tmp"):
        each.mkdir(parents=True)
    place.scene.write_bytes(scene)
    (folder / "scene_baked.blend").write_bytes(b"an earlier result")
    (place.images / "Radiosity_Cornell.exr").write_bytes(b"an earlier image")
    (folder / "report.json").write_bytes(b"an earlier report")
    return place


def demo_scene() -> bytes:
    """The built-in Cornell box as a .blend file."""
    import bpy

    from radiosity_addon.export.demo import build_demo

    bpy.ops.wm.read_factory_settings(use_empty=True)
    build_demo("cornell")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "demo.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        return path.read_bytes()


@dataclass
class Bake:
    """A bake under way in a process of its own. ``limits`` are those of ``resource``."""

    place: Place
    words: list[str]
    limits: dict[int, int] = field(default_factory=dict)
    program: str = "benchmarks.fault_child"

    def __post_init__(self) -> None:
        number, name = tempfile.mkstemp(prefix="stages-")
        os.close(number)
        self._stages = Path(name)
        # Under limits plainly: what announces the stages imports NumPy before its time.
        program = "radiosity_addon" if self.limits else self.program
        own = {"TMPDIR": str(self.place.folder / "tmp"), "RADIOSITY_STAGES": name}
        self._process = subprocess.Popen(
            [sys.executable, "-m", program, *self.words],
            cwd=ROOT,
            env={**os.environ, **own},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=self._limit,
        )

    def _limit(self) -> None:
        import resource

        for what, most in self.limits.items():
            resource.setrlimit(what, (most, most))

    def wait_for(self, stage: str) -> None:
        """Return when ``stage`` has begun, or the process has ended."""
        deadline = time.monotonic() + PATIENCE
        while stage not in self._stages.read_text().split() and self._process.poll() is None:
            if time.monotonic() > deadline:
                raise TimeoutError(f"stage {stage} did not come within {PATIENCE} s")
            time.sleep(0.002)

    def send(self, number: int) -> float:
        """Send a signal; returns when, in seconds."""
        self._process.send_signal(number)
        return time.monotonic()

    def kill_twin(self) -> float:
        """Kill the second process of the bake; returns when, in seconds."""
        number = self._process.pid
        children = Path(f"/proc/{number}/task/{number}/children").read_text().split()
        words = {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for child in children}
        [twin] = [child for child, line in words.items() if b"radiosity_addon.replicate_process" in line]
        os.kill(twin, signal.SIGKILL)
        return time.monotonic()

    def end(self) -> tuple[int, str, float]:
        """Wait for the end; exit status, standard error and when it ended."""
        message = self._process.communicate()[1]
        self._stages.unlink()
        return self._process.returncode, message, time.monotonic()


@dataclass(frozen=True)
class Outcome:
    """What a fault did. ``strange``: files that changed, appeared or went."""

    status: int
    message: str
    seconds: float  # from the fault, where there was a moment of it, to the end
    strange: tuple[str, ...]


def outcome(bake: Bake, before: dict, began: float | None = None) -> Outcome:
    """The end of ``bake``, and what is left after the janitor of a killed process has had time."""
    status, message, ended = bake.end()
    deadline = time.monotonic() + (5 if status < 0 else 0)
    while bake.place.contents() != before and time.monotonic() < deadline:
        time.sleep(0.02)
    after = bake.place.contents()
    strange = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    return Outcome(status, message, ended - (began or ended), tuple(sorted(strange)))


def interrupt_at(place: Place, stage: str, number: int = signal.SIGINT, delay=0.0) -> Outcome:
    """A signal ``delay`` seconds after a stage has begun."""
    before, bake = place.contents(), Bake(place, place.words())
    bake.wait_for(stage)
    time.sleep(delay)
    return outcome(bake, before, bake.send(number))


def limited(place: Place, limits: dict[int, int], words: list[str] | None = None) -> Outcome:
    """A bake under limits of ``resource``, such as the size of a file or of the memory."""
    before = place.contents()
    return outcome(Bake(place, words or place.words(), limits), before)


def kill_at(fresh, delay: float) -> Outcome:
    """kill -9 so many seconds after the start; sooner where the bake had put all in place."""
    while True:
        place = fresh()
        before, bake = place.contents(), Bake(place, place.words())
        time.sleep(delay)
        found = outcome(bake, before, bake.send(signal.SIGKILL))
        if set(found.strange) != set(RESULTS):
            return found
        delay *= 0.7


@dataclass
class Row:
    """What one kind of fault did, each time. ``told`` must be in the message of each."""

    fault: str
    status: int
    told: str
    limit: float = float("inf")  # seconds from the fault to the end
    outcomes: list[Outcome] = field(default_factory=list)

    def wrong(self) -> list[Outcome]:
        """Those that are not as they must be."""
        return [
            o for o in self.outcomes
            if o.status != self.status or self.told not in o.message or o.strange
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
    row.outcomes += [twin_killed(fresh(), stage) for stage in stages]
    return [row]


def twin_killed(place: Place, stage: str) -> Outcome:
    """The second process is killed when a stage has begun."""
    before, bake = place.contents(), Bake(place, place.words())
    bake.wait_for(stage)
    return outcome(bake, before, bake.kill_twin())


def solver_killed(place: Place, seconds: float) -> Outcome:
    """The solver's process is killed so long after it has started."""
    before, words = place.contents(), [str(place.scene), str(seconds)]
    return outcome(Bake(place, words, program="benchmarks.fault_button"), before)


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


def removed_during(place: Place) -> Outcome:
    """The folder of the images goes while the light is gathered."""
    before, target = place.contents(), place.folder / "elsewhere"
    target.mkdir()
    words = place.words() + ["--image-dir", str(target)]
    bake = Bake(place, words)
    bake.wait_for("gather")
    target.rmdir()
    return outcome(bake, before)


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


@contextmanager
def mounted(folder: Path, arguments: list[str]):
    """Something mounted on ``folder``; yields whether the system allowed it."""
    folder.mkdir(exist_ok=True)
    done = subprocess.run(["mount", *arguments, str(folder)], stderr=subprocess.DEVNULL)
    try:
        yield done.returncode == 0
    finally:
        if done.returncode == 0:
            subprocess.run(["umount", str(folder)], check=True)


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
