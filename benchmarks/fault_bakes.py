"""Bakes in a folder of their own that a fault comes over, and what is left of them. Linux."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ("images/Radiosity_Cornell.exr", "report.json", "scene_baked.blend")
PATIENCE = 60  # seconds for a stage to come


@dataclass(frozen=True)
class Place:
    """A folder with a scene, an earlier result of it, and temporary files of its own."""

    folder: Path
    size: int = 256  # texels along an edge of the image
    options: tuple[str, ...] = ()  # more words of the command line

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
        return [str(self.scene), *image, str(self.size), "--report", report, "--quality=draft",
                *self.options]  # fmt: skip

    def contents(self) -> dict[str, str]:
        """Digests of all files below, and the folders; the cleanup process may be at work there, so that
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


def make_place(folder: Path, scene: bytes, size: int = 256, *options: str) -> Place:
    """``folder`` filled with the scene and what an earlier bake might have left."""
    place = Place(folder, size, options)
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

    def kill_beside(self, program: str) -> float:
        """Kill a process beside the bake's own that runs this program; returns when, in seconds."""
        number = self._process.pid
        children = Path(f"/proc/{number}/task/{number}/children").read_text().split()
        words = {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for child in children}
        found = [child for child, line in words.items() if f"radiosity_addon.{program}".encode() in line]
        os.kill(found[0], signal.SIGKILL)
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
    """The end of ``bake``, and what is left after the cleanup process of a killed process has had time."""
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


def second_killed(place: Place, stage: str) -> Outcome:
    """The second process is killed when a stage has begun."""
    before, bake = place.contents(), Bake(place, place.words())
    bake.wait_for(stage)
    return outcome(bake, before, bake.kill_beside("replicate_process"))


def helper_killed(place: Place, stage: str) -> Outcome:
    """One of four helpers is killed when a stage has begun."""
    before, bake = place.contents(), Bake(place, [*place.words(), "--threads", "6"])
    bake.wait_for(stage)
    return outcome(bake, before, bake.kill_beside("helper_processes"))


def solver_killed(place: Place, seconds: float) -> Outcome:
    """The solver's process is killed so long after it has started."""
    before, words = place.contents(), [str(place.scene), str(seconds)]
    return outcome(Bake(place, words, program="benchmarks.fault_button"), before)


def removed_during(place: Place) -> Outcome:
    """The folder of the images goes while the light is gathered."""
    before, target = place.contents(), place.folder / "elsewhere"
    target.mkdir()
    words = place.words() + ["--image-dir", str(target)]
    bake = Bake(place, words)
    bake.wait_for("gather")
    target.rmdir()
    return outcome(bake, before)


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
