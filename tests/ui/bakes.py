"""Bakes as the tests of the button take them: step by step, into each phase."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np

from radiosity_addon.pickled import PACKAGE
from radiosity_addon.ui import worker
from tests.export.scene_building import add_object

ALL_PASSES = {"EMIT", "DIRECT", "INDIRECT", "COLOR"}


class WorkerHere:
    """In place of the solver's process, which takes a second to import SciPy: the same program on the same files,
    in this process, when somebody waits for its end. What the process adds, ``test_solver_process.py`` shows."""

    def __init__(self, solver, _: str, keep: list[str]) -> None:
        self._folder, self._keep = solver._folder, Path(keep[0]) if keep else None
        self._given, self.returncode = threading.Event(), None
        self.stdin = self

    def write(self, _: bytes) -> None:
        self._given.set()

    def flush(self) -> None:
        pass

    close = flush

    def poll(self) -> int | None:
        return self.returncode

    def wait(self, seconds: float) -> int:
        if self.returncode is None and not self._given.is_set():
            raise subprocess.TimeoutExpired("the solver", seconds)
        if self.returncode is None:
            with worker.ProgressFile(self._folder / worker.PROGRESS) as progress:
                self.returncode = worker.work(PACKAGE, self._folder, self._keep, self._given, progress, None)
        return self.returncode

    def terminate(self) -> None:
        self.returncode = -signal.SIGTERM


class Patience:
    """Ends after 60 seconds of work, this process's and the solver's: that one gives way to all others,
    so on a machine that does other work it may take minutes for what it does in seconds. Where the
    work cannot be told, and where there is none, it ends after ten minutes."""

    def __init__(self) -> None:
        self._start, self._end = time.process_time(), time.monotonic() + 600

    def left(self, bake) -> bool:
        own, now = time.process_time() - self._start, time.monotonic()
        return own + worked(bake._process) < 60 and now < self._end


def worked(solver) -> float:
    """Seconds of processors that the solver's process has used; 0 where it is not told or has ended."""
    try:
        with open(f"/proc/{solver._process.pid}/stat") as handle:
            ticks = handle.read().rpartition(")")[2].split()[11:13]  # of user, of system
    except (AttributeError, OSError):
        return 0.0
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def until(bpy, bake, *states: str) -> None:
    """Take steps until the bake is in one of the states."""
    patience = Patience()
    while bake.state.name not in states:
        assert patience.left(bake), f"still {bake.state.name}"
        bake.step(bpy.context)
        bake.wait(0.1)


def colors(mesh, name: str = "Radiosity") -> np.ndarray:
    values = np.empty(4 * len(mesh.color_attributes[name].data), np.float32)
    mesh.color_attributes[name].data.foreach_get("color", values)
    return values


def box(bpy):
    return bpy.data.objects["Box"]


def everything(bpy) -> dict:
    """Names of all data-blocks, and what the meshes carry."""
    found = {}
    for name in ("objects", "meshes", "images", "scenes", "materials", "lights", "cameras"):
        found[name] = sorted(block.name for block in getattr(bpy.data, name))
    for mesh in bpy.data.meshes:
        found[mesh.name] = sorted((item.name, item.data_type) for item in mesh.attributes)
    return found


def many(bpy, count: int = 3) -> None:
    """Copies of the box with meshes of their own, far away; images of 16 texels asked for."""
    for index in range(count):
        other = box(bpy).copy()
        other.data, other.name, other.location = box(bpy).data.copy(), f"Other {index}", (5, 0, 0)
        bpy.context.scene.collection.objects.link(other)
    properties = bpy.context.scene.radiosity
    properties.target, properties.resolution = "IMAGE", 16


PHASES = {
    "importing": lambda bake, bpy: bake.state.name == "START" and bake._process is not None,
    "reading": lambda bake, bpy: bake.state.name == "EXPORT" and bake.fraction > 0,
    "solving": lambda bake, bpy: bake.state.name == "SOLVE",
    "writing": lambda bake, bpy: bake.state.name == "WRITE" and len(bpy.data.images) == 2,
}


def reach(bpy, bake, phase: str) -> None:
    patience = Patience()
    while not PHASES[phase](bake, bpy):
        assert patience.left(bake), f"still {bake.state.name}"
        assert bake.state.name != "DONE", f"{phase} was passed over"
        bake.step(bpy.context)
        bake.wait(0.1)


def rendered(bpy, path) -> np.ndarray:
    """(3,) that Cycles sees in the middle of the wall at y = 1."""
    scene = bpy.context.scene
    camera = add_object(bpy, "Eye", bpy.data.cameras.new("Eye"), location=(0, 0, 1))
    camera.rotation_euler = 1.5707963, 0, 0
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 1, False
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return np.array(bpy.data.images.load(str(path)).pixels[:3])
