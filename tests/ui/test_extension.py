"""The manifest: what Blender is told about the extension, and the wheels it brings."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import radiosity_addon

ROOT = Path(__file__).resolve().parents[2]
# In a wheel's file name, what each of Blender's platforms is called.
SYSTEMS = {"linux-x64": "x86_64.whl", "windows-x64": "win_amd64.whl", "macos-arm64": "arm64.whl"}


@pytest.fixture(scope="module")
def manifest() -> dict:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text())


def test_version_is_the_packages(manifest):
    assert manifest["version"] == radiosity_addon.__version__


@pytest.mark.parametrize("library", ["scipy-1.16.", "embreex-4.4."])
@pytest.mark.parametrize("python", ["cp311", "cp313"])
def test_every_platform_has_its_wheels(manifest, library, python):
    """Blender up to 5.0 has Python 3.11, later ones 3.13: one wheel for each platform."""
    assert set(manifest["platforms"]) == set(SYSTEMS)
    for system in SYSTEMS.values():
        found = [
            path for path in manifest["wheels"]
            if path.startswith(f"./wheels/{library}") and f"-{python}-{python}-" in path
            and path.endswith(system)
        ]  # fmt: skip
        assert len(found) == 1, (library, python, system)


def test_wheels_are_those_of_the_two_libraries_only(manifest):
    """NumPy is Blender's own and must not come along."""
    assert {Path(path).name.split("-")[0] for path in manifest["wheels"]} == {"scipy", "embreex"}
    assert len(manifest["wheels"]) == 12


def test_texts_are_as_blenders_repository_wants_them(manifest):
    """At most 64 characters, no punctuation at the end."""
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= 64 and text[-1].isalnum()


def test_oldest_blender_is_the_oldest_that_is_tested(manifest):
    tested = re.findall(r"\[(\d+\.\d+)\]=3", (ROOT / ".ci" / "run").read_text())
    assert manifest["blender_version_min"] == min(tested) + ".0"


def test_package_holds_what_is_installed_and_nothing_else(manifest, tmp_path):
    """Laid out with no wheels: the manifest's list becomes the wheels that are there."""
    import importlib.util

    path = ROOT / "tools" / "build_extension.py"
    spec = importlib.util.spec_from_file_location("build_extension", path)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    tool.lay_out(tmp_path / "package", [], ["linux-x64"])
    laid_out = tomllib.loads((tmp_path / "package" / "blender_manifest.toml").read_text())
    assert laid_out["wheels"] == [] and laid_out["platforms"] == ["linux-x64"]
    names = {item.name for item in (tmp_path / "package").iterdir()}
    assert names == {"__init__.py", "radiosity_addon", "blender_manifest.toml", "LICENSE",
                     "README.md", "CHANGELOG.md", "wheels"}  # fmt: skip
    assert not list(tmp_path.rglob("*.pyc"))
    assert list(tmp_path.rglob("presets/radiosity/*.py"))
