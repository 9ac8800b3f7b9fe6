"""What the numbers were measured on and with: one line for tables. bpy only where present."""

from __future__ import annotations

import os
import platform
import subprocess
from pathlib import Path


def machine() -> str:
    """Processor, cores, Python, Blender and the project's commit."""
    import bpy

    return (f"{processor()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
            f"Blender {bpy.app.version_string}, commit {commit()}")  # fmt: skip


def processor() -> str:
    """Its name as the system tells it."""
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def commit() -> str:
    """Short name of the commit, with + where files differ from it; unknown outside a checkout."""
    folder = Path(__file__).resolve().parent
    command = ["git", "describe", "--always", "--dirty=+"]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.strip()
