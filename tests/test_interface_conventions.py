"""What the add-on's code keeps to where its parts meet: typed parameters and results, no method called by its
name, nothing frozen that is filled in place, nothing learned that a closure holds."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ADD_ON = ROOT / "radiosity_addon"
SOLVER = ADD_ON / "solver"
FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
CHANGES = {"append", "add", "update", "extend", "insert", "pop", "clear", "setdefault", "remove"}


def untyped(tree: ast.AST):
    """Names of parameters without a type, but for ``self`` and ``cls``."""
    for node in ast.walk(tree):
        if isinstance(node, FUNCTION):
            words = node.args
            every = [*words.posonlyargs, *words.args, *words.kwonlyargs, words.vararg, words.kwarg]
            for word in filter(None, every):
                if word.annotation is None and word.arg not in ("self", "cls"):
                    yield word.arg


def without_return_type(tree: ast.AST):
    """Names of functions that do not say what they return."""
    yield from (node.name for node in ast.walk(tree) if isinstance(node, FUNCTION) and node.returns is None)


def called_by_name(tree: ast.AST):
    """Calls of what ``getattr`` or ``methodcaller`` found."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            made = isinstance(node.func, ast.Call) and ast.unparse(node.func.func) == "getattr"
            if made or ast.unparse(node.func).endswith("methodcaller"):
                yield ast.unparse(node)


def base_name(node: ast.AST) -> str:
    """``a`` of ``a.b[c]``; "" of what is no name."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


def changed(tree: ast.AST):
    """(name, source) of what code changes in place: ``name.a = b``, ``name[a] = b``,
    ``name.append(b)`` and the like."""
    for node in ast.walk(tree):
        if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(node.ctx, ast.Store):
            yield base_name(node), ast.unparse(node)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            if ast.unparse(node.func) == "object.__setattr__":
                yield "self", ast.unparse(node)
            elif node.func.attr in CHANGES:
                yield base_name(node.func.value), ast.unparse(node)


def filled_in_place(tree: ast.AST):
    """What frozen classes change of themselves."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            if any("frozen=True" in ast.unparse(each) for each in node.decorator_list):
                yield from (source for name, source in changed(node) if name == "self")


def own_names(function: ast.AST) -> set[str]:
    """Parameters and variables of a function, with those of functions in it."""
    parameters = {node.arg for node in ast.walk(function) if isinstance(node, ast.arg)}
    return parameters | {node.id for node in ast.walk(function)
                         if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}  # fmt: skip


def held_by_closures(tree: ast.AST):
    """What functions within functions change of the outer one's variables."""
    for outer in ast.walk(tree):
        if not isinstance(outer, FUNCTION):
            continue
        for inner in ast.walk(outer):
            if inner is outer or not isinstance(inner, (*FUNCTION, ast.Lambda)):
                continue
            held = own_names(outer) - own_names(inner)
            yield from (source for name, source in changed(inner) if name in held)
            yield from (ast.unparse(node) for node in ast.walk(inner) if isinstance(node, ast.Nonlocal))


RULES = [untyped, without_return_type, called_by_name, filled_in_place, held_by_closures]


# Elsewhere Blender's own things have no types, and its callbacks keep what they find in closures.
OF_THE_SOLVER = [untyped, without_return_type, held_by_closures]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_the_code_keeps_to(rule):
    folder = SOLVER if rule in OF_THE_SOLVER else ADD_ON
    found = {
        path.relative_to(ADD_ON).as_posix(): list(rule(ast.parse(path.read_text(encoding="utf-8"))))
        for path in sorted(folder.rglob("*.py"))
    }
    assert len(found) > 90
    assert {path: what for path, what in found.items() if what} == {}


BREACHES = {
    untyped: ("def f(self, a, b: int, *c, d=1): ...", ["a", "d", "c"]),
    without_return_type: ("def f() -> None: ...\ndef g(): ...", ["g"]),
    called_by_name: ("getattr(a, b)(c)\nx = getattr(a, b)", ["getattr(a, b)(c)"]),
    filled_in_place: (
        "@dataclass(frozen=True)\nclass A:\n def f(self):\n  self.a[0] = b = 1\n"
        "  object.__setattr__(self, 'a', b)\n  c[0] = 1",
        ["self.a[0]", "object.__setattr__(self, 'a', b)"],
    ),
    held_by_closures: (
        "def f():\n a = []\n def g(b):\n  c = []\n  a.append(b)\n  c.append(b)\n  D.d = 1\n a.append(1)\n return g",
        ["a.append(b)"],
    ),
}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_breaches_are_found(rule):
    code, expected = BREACHES[rule]
    assert list(rule(ast.parse(code))) == expected


def test_tests_patch_no_constants():
    """What tests change is an argument: a patched constant shows nothing of what users can have."""
    patched = [
        f"{path.name}:{node.lineno} {ast.unparse(node)}"
        for path in sorted(Path(__file__).parent.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("patch.setattr")
        and any(isinstance(each, ast.Constant) and str(each.value).rpartition(".")[2].isupper()
                for each in node.args[:2])
    ]  # fmt: skip
    assert patched == []


CLOCKS = {"perf_counter", "monotonic", "process_time", "seconds"}


def limits_of_seconds(function: ast.AST):
    """Assertions that less time passed than a limit."""
    for check in ast.walk(function):
        if not isinstance(check, ast.Assert):
            continue
        for node in ast.walk(check.test):
            less = isinstance(node, ast.Compare) and isinstance(node.ops[-1], (ast.Lt, ast.LtE))
            if less and set(re.findall(r"\w+", ast.unparse(node.left))) & CLOCKS:
                yield ast.unparse(node)


def test_tests_that_hold_a_limit_of_seconds_are_marked():
    """Their failure may mean that the machine was busy."""
    tests = [
        (path.name, node)
        for folder in ("tests", "benchmarks/tests")
        for path in sorted((ROOT / folder).rglob("test_*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, FUNCTION) and list(limits_of_seconds(node))
    ]
    unmarked = [
        f"{name}: {node.name}" for name, node in tests
        if not any(ast.unparse(each) == "pytest.mark.timed" for each in node.decorator_list)
    ]  # fmt: skip
    assert len(tests) > 3
    assert unmarked == []
