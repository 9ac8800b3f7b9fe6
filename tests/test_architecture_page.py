"""docs/architecture.md is right: what it names exists, and what exists it names."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests.solver.test_architecture import LAYERS

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "radiosity_addon"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
PLACES = ("radiosity_addon", "tests", "verification", "benchmarks", "tools", "docs")
# The add-on's packages, and the modules beside them, from the lowest to the highest.
ORDER = (
    "__version__", "figures", "components", "steps", "memory", "overall_progress", "pickled", "interrupt",
    "terminal", "cleanup_process", "temporary_folders", "files", "solver", "settings", "libraries",
    "shared_arrays", "child_process", "helper_requests", "helper_processes", "replicate_process", "bake", "export", "stages", "bake_job", "report", "gltf", "options", "arguments",
    "request_files", "ui", "command", "__main__", "__init__",
)
PACKAGES = sorted(
    path.parent.relative_to(PACKAGE).as_posix() for path in PACKAGE.glob("*/**/__init__.py")
)


@pytest.mark.parametrize("page", [ROOT / "README.md", *(ROOT / "docs").glob("*.md")],
                         ids=lambda page: page.name)  # fmt: skip
def test_files_that_the_docs_name_exist(page):
    """``path.py``, from any folder on, but for what a reader is to write."""
    here = [f"/{path.relative_to(ROOT).as_posix()}"
            for place in PLACES for path in (ROOT / place).rglob("*.py")]  # fmt: skip
    named = set(re.findall(r"[\w/]+\.py\b", page.read_text(encoding="utf-8"))) - {"__init__.py"}
    assert [name for name in sorted(named) if not any(path.endswith(f"/{name}") for path in here)] == []


def test_modules_beside_the_packages_are_named():
    beside = [path.name for folder in (PACKAGE, PACKAGE / "solver") for path in folder.glob("*.py")]
    assert [name for name in beside if name != "__init__.py" and name not in PAGE] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_are_named_and_say_what_they_do(package):
    assert f"| `{package}` |" in PAGE
    text = (PACKAGE / package / "__init__.py").read_text(encoding="utf-8")
    assert ast.get_docstring(ast.parse(text))


def test_the_order_of_the_solvers_packages_is_the_one_that_is_tested():
    order = re.search(r"^    tiles > [^`]+?\n\n", PAGE, re.MULTILINE)[0]
    assert re.findall(r"\w+", order) == list(reversed(LAYERS))


def imported(path: Path):
    """What a file imports of the add-on beside its own package: names of packages and modules."""
    folders = path.relative_to(PACKAGE).parts[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == len(folders) + 1:
            words = [node.module] if node.module else [alias.name for alias in node.names]
            yield from (word.split(".")[0] for word in words)


def test_imports_of_the_add_on_point_down_one_order():
    upward = [
        f"{path.relative_to(PACKAGE)} imports {name}"
        for path in PACKAGE.rglob("*.py") if "presets" not in path.parts
        for name in imported(path)
        if ORDER.index(name) >= ORDER.index(path.relative_to(PACKAGE).parts[0].removesuffix(".py"))
    ]  # fmt: skip
    assert upward == []


def test_the_order_of_the_packages_is_the_one_that_is_tested():
    order = re.search(r"^    ui > .*$", PAGE, re.MULTILINE)[0]
    packages = [name for name in ORDER if (PACKAGE / name).is_dir()]
    assert re.findall(r"\w+", order) == list(reversed(packages))


def test_interfaces_are_all_named():
    """Every ``typing.Protocol`` of the add-on."""
    declared = {
        node.name
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef) and any("Protocol" in ast.unparse(b) for b in node.bases)
    }
    table = PAGE[PAGE.index("## Interfaces") : PAGE.index("## The way of")]
    assert len(declared) > 8
    assert [name for name in sorted(declared) if f"`{name}`" not in table] == []
