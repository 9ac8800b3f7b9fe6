"""Verification stands alone: it imports neither tests nor benchmarks, and they not one another."""

import ast
import tomllib
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[1]


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file imports anywhere, relative imports made absolute."""
    package = path.relative_to(PROJECT).with_suffix("").parts
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = ".".join(package[: -node.level]) + "." if node.level else ""
            base = (above + (node.module or "")).rstrip(".")
            names |= {f"{base}.{alias.name}" for alias in node.names}
    return names


def from_packages(folder: str, *packages: str) -> list[str]:
    """"file imports module" for every import of these packages below a folder."""
    return [
        f"{path.relative_to(PROJECT)} imports {name}"
        for path in (PROJECT / folder).rglob("*.py")
        for name in imported(path)
        if name.split(".")[0] in packages
    ]


@pytest.mark.parametrize(
    "folder, others",
    [
        ("verification", ("tests", "benchmarks")),
        ("benchmarks", ("tests",)),
        ("tests", ("benchmarks",)),
        ("radiosity_addon", ("tests", "benchmarks", "verification")),
    ],
)
def test_nothing_is_imported_from(folder, others):
    assert from_packages(folder, *others) == []


def test_benchmarks_have_their_tests_beside_them():
    """Which the test command runs, so that benchmarks cannot rot."""
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "benchmarks/tests" in project["tool"]["pytest"]["ini_options"]["testpaths"]
    assert from_packages("benchmarks/tests", "benchmarks") != []


def test_the_path_tracer_knows_only_what_a_scene_is():
    """An oracle that shared code with the solver would share its mistakes."""
    files = sorted((PROJECT / "verification").glob("path_tracer*.py"))
    names = {name for path in files for name in imported(path)}
    ours = {".".join(name.split(".")[:3]) for name in names if name.startswith("radiosity_addon.")}
    assert ours == {"radiosity_addon.solver.scene", "radiosity_addon.solver.fields"}
    helpers = {name.split(".")[1] for name in names if name.startswith("verification.")}
    assert helpers == {"path_tracer_fields", "path_tracer_lamps"}


def test_the_extension_is_built_without_verification():
    assert '"/verification/"' in (PROJECT / "blender_manifest.toml").read_text(encoding="utf-8")


def test_no_two_test_modules_share_a_name():
    """Those of tests: pytest and people call them by it."""
    names = [path.name for folder in ("tests", "benchmarks/tests") for path in (PROJECT / folder).rglob("*.py")]
    twice = {name for name in names if names.count(name) > 1}
    assert twice == {"conftest.py"}
