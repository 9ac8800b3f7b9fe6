"""The packages of the solver: imports point down one order, and nothing but bpy-free code is met."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from radiosity_addon.solver.sampling.streams import Stream

ROOT = Path(__file__).resolve().parents[2]
SOLVER = ROOT / "radiosity_addon" / "solver"
# From the lowest to the highest. A module imports its own layer's package or lower ones only.
LAYERS = (
    "expected", "workers", "ragged", "array_struct", "progress", "passes", "fields", "scene", "receivers", "solution", "check", "geometry",
    "materials", "sampling", "tracing", "lights", "direct", "elements", "transport", "gather",
    "filtering", "adaptive", "energy", "sequence", "tiles",
)


def _layer(path: Path) -> str:
    """The package or top module that a file of the solver belongs to."""
    first = path.relative_to(SOLVER).parts[0]
    return first.removesuffix(".py")


def _imports(path: Path):
    """(layer imported, line) of each relative import in a file."""
    depth = len(path.relative_to(SOLVER).parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            assert node.level <= depth, f"{path.name}:{node.lineno} imports from above the solver"
            if node.level == depth:  # what stands beside the packages
                yield node.module.split(".")[0], node.lineno


def test_every_package_has_its_layer():
    found = {_layer(path) for path in SOLVER.rglob("*.py")} - {"__init__"}
    assert found == set(LAYERS)


def test_no_import_points_upward():
    upward = []
    for path in SOLVER.rglob("*.py"):
        if path.parent == SOLVER and path.stem == "__init__":
            continue
        own = LAYERS.index(_layer(path))
        upward += [
            f"{path.relative_to(SOLVER)}:{line} imports {target}"
            for target, line in _imports(path)
            if LAYERS.index(target) > own
        ]
    assert upward == []


def names_of_modules(folder: Path) -> list[str]:
    """Of the modules and packages in a folder; a package's main module has its name."""
    packages = [path.parent.name for path in folder.rglob("__init__.py") if path.parent != folder]
    return packages + [
        path.stem for path in folder.rglob("*.py")
        if path.stem not in ("__init__", "__main__", "conftest", path.parent.name)
    ]  # fmt: skip


def test_module_names_are_used_once():
    """The same name in two packages would stand for two things; so would one of the add-on's beside it."""
    names = names_of_modules(SOLVER.parent)
    beside = {name: names_of_modules(ROOT / name) for name in ("verification", "benchmarks", "tools", "tests")}
    every = names + [name for found in beside.values() for name in found]
    assert len(names) > 250 and all(beside.values())
    assert sorted({name for name in every if every.count(name) > 1}) == []


def test_keys_name_their_stream():
    """A number after the seed could be another part's stream; ``sampling.streams`` has each once."""
    plain = re.compile(r"\bseed, *\d|\bsobol\(\w+, *\w+, *\d")
    found = [str(path.relative_to(SOLVER)) for path in SOLVER.rglob("*.py")
             if plain.search(path.read_text(encoding="utf-8"))]  # fmt: skip
    assert found == []


def test_each_stream_belongs_to_one_file():
    """Two parts that share random numbers would err alike."""
    used = {stream.name: [] for stream in Stream}
    for path in SOLVER.rglob("*.py"):
        for name in set(re.findall(r"\bStream\.([A-Z_]+)", path.read_text(encoding="utf-8"))):
            used[name].append(path.name)
    assert {name: files for name, files in used.items() if len(files) != 1} == {}
    assert len(Stream.__members__) == len({int(stream) for stream in Stream})


def test_rays_are_looked_up_in_one_place():
    """Seeds, rows, gather and paths shoot, follow transmission and look up what was met by ``shoot``. What leaves
    a beam's lamp meets no patches."""
    places = {"patches.hit": {"transport/rays.py"},
              "followed": {"transport/rays.py", "direct/beams.py", "direct/transmission.py"}}  # fmt: skip
    for name, expected in places.items():
        call = re.compile(rf"\b{re.escape(name)}\(")
        assert {path.relative_to(SOLVER).as_posix() for path in SOLVER.rglob("*.py")
                if call.search(path.read_text(encoding="utf-8"))} == expected  # fmt: skip


def module_of(path: Path) -> str:
    """``lights.sources`` of its path."""
    return ".".join(path.relative_to(SOLVER).with_suffix("").parts)


def modules_imported(path: Path):
    """Modules that a file of the solver imports, for types alone, too."""
    package = module_of(path).split(".")
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            yield ".".join([*package[: -node.level], *(node.module or "").split(".")])


def test_no_two_modules_import_each_other():
    """What both need lies in a third one."""
    uses = {module_of(path): set(modules_imported(path)) for path in SOLVER.rglob("*.py")}
    assert "lights.light_sampler" in uses["lights.sources"]
    mutual = {(one, other) for one in uses for other in uses[one] if one in uses.get(other, ())}
    assert mutual == set()
