"""The command line from inside Blender.

``RADIOSITY_BLENDER`` may name a real Blender (a command, split at spaces) whose Python has SciPy and
embreex; the module bpy stands in for it otherwise.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from tests.one_core import FAST  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = ROOT / "radiosity_addon" / "__main__.py"
AS_BLENDER = """
import runpy, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
script, sys.argv = sys.argv[2], ["blender", "--background", *sys.argv[1:]]
runpy.run_path(script, run_name="__main__")
"""


def blender_style(scene, *words, cwd) -> subprocess.CompletedProcess:
    """The script run by its path in a process whose Blender has ``scene`` open."""
    line = [sys.executable, "-c", AS_BLENDER, str(scene), str(SCRIPT), "--", *map(str, words)]
    return subprocess.run(line, cwd=cwd, capture_output=True, text=True)


def test_script_bakes_the_open_file(room, tmp_path):
    done = blender_style(room, *FAST, "--threads", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Baked 1 object" in done.stdout
    assert room.with_name("room_baked.blend").exists()


@pytest.mark.parametrize(("words", "status"), [(["--bogus"], 2), (["--objects", "Sphinx"], 1)])
def test_script_passes_the_exit_status_on(words, status, room, tmp_path):
    done = blender_style(room, *words, cwd=tmp_path)
    assert done.returncode == status
    assert done.stderr.count("\n") == 1 and words[-1] in done.stderr


@pytest.mark.skipif("RADIOSITY_BLENDER" not in os.environ, reason="RADIOSITY_BLENDER is not set")
def test_real_blender(room):
    """The statuses come through Blender itself, and the file is the same as any other."""
    blender = shlex.split(os.environ["RADIOSITY_BLENDER"])
    line = [*blender, "--background", str(room), "--python", str(SCRIPT), "--"]
    done = subprocess.run([*line, "--quality", "draft"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Baked 1 object" in done.stdout
    assert room.with_name("room_baked.blend").exists()
    for words, status in ((["--bogus"], 2), (["--objects", "Sphinx"], 1)):
        assert subprocess.run([*line, *words], capture_output=True).returncode == status
