"""A real Blender in a window on a virtual screen, with a real mouse and keyboard.

``RADIOSITY_BLENDER`` names Blender (a command, split at spaces). ``RADIOSITY_BESIDE`` names a
command that runs others where that Blender lives (a container); Xvfb, xdotool and ImageMagick's
``import`` are taken from there, or from this machine when it is not set.
"""

from __future__ import annotations

import itertools
import json
import os
import shlex
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np

SIZE = (1280, 800)
TOOLS = ("Xvfb", "xdotool", "import")
PATIENCE = 180  # seconds for anything to happen, on a machine that does other work


def blender_command() -> list[str]:
    """The words that start Blender."""
    return shlex.split(os.environ["RADIOSITY_BLENDER"])


def run_blender(environment: dict, *words) -> str:
    """What a Blender in the background prints, in this environment."""
    line = [*blender_command(), *map(str, words)]
    done = subprocess.run(line, env={**os.environ, **environment}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def beside() -> list[str]:
    """The words before a command that is to run where Blender lives."""
    return shlex.split(os.environ.get("RADIOSITY_BESIDE", ""))


def missing() -> str:
    """What keeps this machine from opening a window; empty when nothing does."""
    if "RADIOSITY_BLENDER" not in os.environ:
        return "RADIOSITY_BLENDER names no Blender"
    for tool in TOOLS:
        if not beside() and not shutil.which(tool):
            return f"{tool} is not installed"
    return ""


_opened = itertools.count()


class Window:
    """Blender open in a window. Use as a context manager."""

    def __init__(self, folder: Path, environment: dict, *words) -> None:
        self._folder = folder
        self._display = f":{70 + (os.getpid() + 100 * next(_opened)) % 900}"
        self._environment = {**os.environ, **environment, "DISPLAY": self._display}
        self._words = words
        self._log = open(folder / "blender.log", "wb")
        self._running: list[subprocess.Popen] = []

    def __enter__(self) -> Window:
        try:
            self._open()
        except BaseException:
            self.__exit__()
            raise
        return self

    def _open(self) -> None:
        width, height = SIZE
        self._launch([*beside(), "Xvfb", self._display, "-screen", "0", f"{width}x{height}x24"])
        time.sleep(1.5)
        inside = Path(__file__).with_name("inside.py")
        geometry = ["--window-geometry", "0", "0", str(width), str(height)]
        self._launch([*blender_command(), "--gpu-backend", "opengl", *geometry, *self._words,
                      "--python", str(inside), "--", str(self._folder)])  # fmt: skip
        self.ask("answer = True")

    def __exit__(self, *_) -> None:
        for process in reversed(self._running):
            process.terminate()
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(PATIENCE)
        self._log.close()

    def _launch(self, line: list[str]) -> None:
        process = subprocess.Popen(
            line, env=self._environment, stdin=subprocess.DEVNULL, stdout=self._log,
            stderr=self._log,
        )  # fmt: skip
        self._running.append(process)

    @property
    def log(self) -> str:
        """What Blender has printed."""
        return (self._folder / "blender.log").read_text(errors="replace")

    def ask(self, code: str):
        """Run ``code`` inside Blender and return what it put into ``answer``."""
        reply = self._folder / "answer.json"
        reply.unlink(missing_ok=True)
        part = self._folder / "ask.part"
        part.write_text(code)
        os.replace(part, self._folder / "ask.py")
        self.until(reply.exists, "Blender does not answer")
        told = json.loads(reply.read_text())
        if "error" in told:
            raise AssertionError(told["error"])
        return told["answer"]

    def until(self, condition, complaint: str, patience: float = PATIENCE) -> float:
        """Wait until ``condition()``; return the seconds it took."""
        start = time.perf_counter()
        while not condition():
            if time.perf_counter() - start > patience or self._running[-1].poll() is not None:
                raise AssertionError(f"{complaint}\n{self.log[-3000:]}")
            time.sleep(0.01)
        return time.perf_counter() - start

    def click(self, x: int, y: int) -> None:
        """Press and release the left mouse button there; (0, 0) is the top left corner."""
        self._tool("xdotool", "mousemove", str(x - 3), str(y))
        time.sleep(0.2)
        self._tool("xdotool", "mousemove", str(x), str(y))
        time.sleep(0.3)
        self._tool("xdotool", "click", "1")

    def point(self, x: int, y: int) -> None:
        """Move the mouse there."""
        self._tool("xdotool", "mousemove", str(x), str(y))
        time.sleep(0.3)

    def key(self, name: str) -> None:
        """Press a key, as xdotool names it."""
        self._tool("xdotool", "key", name)

    def type(self, text: str) -> None:
        """Type the text, key by key."""
        self._tool("xdotool", "type", "--delay", "50", text)

    def picture(self, path: Path) -> Path:
        """Save what the screen shows."""
        self._tool("import", "-window", "root", str(path))
        return path

    def shrink(self, picture: Path, path: Path) -> None:
        """Save a picture with fewer pixels and colors."""
        small = self._folder / "small.png"  # in a folder that a container sees
        self._tool("convert", str(picture), "-resize", "900x", "-colors", "256", f"PNG8:{small}")
        shutil.copy(small, path)

    def pixels(self) -> np.ndarray:
        """(height, width, 3) uint8 of the screen, the lowest row first."""
        path = self._folder / "screen.rgb"
        self._tool("import", "-window", "root", "-depth", "8", f"rgb:{path}")
        width, height = SIZE
        return np.fromfile(path, np.uint8).reshape(height, width, 3)[::-1]

    def _tool(self, *words: str) -> None:
        subprocess.run([*beside(), *words], env=self._environment, check=True, timeout=30)
