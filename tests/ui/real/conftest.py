"""The extension's zip, installed from the file into a Blender profile of the test's own."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import time
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[2]


def load(path: Path):
    """The module in ``path``: tests are no package, and tools are none either."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


window, box = load(HERE / "window.py"), load(HERE / "box.py")


def blenders_python() -> str:
    """``3.13``: the version of the Python inside that Blender."""
    code = "import sys; print('PYTHON %d.%d' % sys.version_info[:2])"
    line = [*window.blender_command(), "--background", "--factory-startup", "--python-expr", code]
    told = subprocess.run(line, capture_output=True, text=True, check=True).stdout
    return next(row.split()[1] for row in told.splitlines() if row.startswith("PYTHON"))


@pytest.fixture(scope="session")
def zip_file(tmp_path_factory) -> Path:
    """The package for this Blender, built by the one command; with wheels for its Python."""
    if window.missing():
        pytest.skip(f"no window: {window.missing()}")
    folder = tmp_path_factory.mktemp("dist")
    words = ["--platform", "linux-x64", "--python", blenders_python(), "--output", folder]
    tool = ROOT / "tools" / "build_extension.py"
    subprocess.run([sys.executable, str(tool), *map(str, words)], check=True, cwd=ROOT)
    return next(folder.glob("*linux_x64.zip"))


def install(zip_file: Path, folder: Path) -> dict:
    """The environment of a Blender that knows nothing but the extension, installed and enabled."""
    environment = {"BLENDER_USER_RESOURCES": str(folder)}
    words = ["--command", "extension", "install-file", "--repo", "user_default", "--enable"]
    assert "Installed" in window.run_blender(environment, *words, zip_file)
    return environment


@pytest.fixture(scope="session")
def profile(zip_file, tmp_path_factory) -> dict:
    """The profile of the tests that share a Blender."""
    return install(zip_file, tmp_path_factory.mktemp("profile"))


@pytest.fixture
def new_profile(zip_file, tmp_path) -> dict:
    """The profile of a Blender in which the extension has never run."""
    return install(zip_file, tmp_path / "new")


@pytest.fixture(scope="module")
def blender_window(profile, tmp_path_factory):
    """Blender with the extension, in a window."""
    with window.Window(tmp_path_factory.mktemp("window"), profile) as opened:
        yield opened


@pytest.fixture(scope="module")
def room(blender_window):
    """The window with the box in it and the sidebar open."""
    blender_window.ask(box.IMPORTS + box.AREA + box.ROOM)
    time.sleep(1)
    blender_window.ask(box.AREA + "region.active_panel_category = 'Radiosity'")
    time.sleep(1)
    return blender_window
