"""The extension's zip, installed from the file into a Blender profile of the test's own."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
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


window = load(HERE / "window.py")


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


@pytest.fixture(scope="session")
def profile(zip_file, tmp_path_factory) -> dict:
    """The environment of a Blender that knows nothing but the extension, installed and enabled."""
    folder = tmp_path_factory.mktemp("profile")
    environment = {"BLENDER_USER_RESOURCES": str(folder)}
    line = [*window.blender_command(), "--command", "extension", "install-file"]
    line += ["--repo", "user_default", "--enable", str(zip_file)]
    done = subprocess.run(
        line, env={**window.os.environ, **environment}, capture_output=True, text=True
    )
    assert done.returncode == 0 and "Installed" in done.stdout, done.stdout + done.stderr
    return environment


@pytest.fixture(scope="module")
def blender_window(profile, tmp_path_factory):
    """Blender with the extension, in a window."""
    with window.Window(tmp_path_factory.mktemp("window"), profile) as opened:
        yield opened
