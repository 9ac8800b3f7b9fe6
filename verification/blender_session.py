"""Blender session: what all tests that open Blender lean on, those of the benchmarks too.

A ``conftest.py`` imports from here. Blender is imported only by the fixture that hands it out.
"""

from __future__ import annotations

import atexit
import os
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version

import pytest

from radiosity_addon.solver.workers.parallel import BLAS_ENVIRONMENT

# Before NumPy is imported: sums are rounded as in the processes that the add-on starts.
os.environ.update(BLAS_ENVIRONMENT)

status = 1  # of a session that never began


def pytest_report_header() -> str:
    """The versions of what results depend on, in the log of every run."""
    packages = ("bpy", "numpy", "scipy", "embreex")
    return ", ".join(f"{name} {_version(name)}" for name in packages)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def pytest_sessionfinish(exitstatus):
    global status
    status = int(exitstatus)


@atexit.register  # before Blender's own, so that it runs after them
def leave():
    """End the process here: Blender 4.5 waits for one of its own threads forever when the process
    is taken apart after some of the tests."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


@cache
def _started():
    """bpy with factory settings. To read them starts all of Blender's add-ons anew, and takes five times as
    long as to read an empty file, which leaves preferences as they are: so does every test."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy


@pytest.fixture
def blender():
    """bpy with an empty file: no objects, no world, factory settings."""
    bpy = _started()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy
