"""What the code of the add-on keeps to, so that it can be read: short functions, one word for one
thing."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "radiosity_addon"
MOST_PARAMETERS, MOST_LINES = 7, 40
# Functions that need more, by file and name, and why. Take out what no longer does.
EXCEPTIONS: dict[str, str] = {}
FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)


def nodes(kinds):
    """(path, node) of each such node of the add-on."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, kinds):
                yield path.relative_to(PACKAGE).as_posix(), node


def parameters(node) -> int:
    """Of a function, but for ``self`` and ``cls``."""
    words = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return sum(word.arg not in ("self", "cls") for word in words)


def lines(node) -> int:
    """Of a function, but for its docstring."""
    first = node.body[0]
    told = first.end_lineno - first.lineno + 1 if ast.get_docstring(node) else 0
    return node.end_lineno - node.lineno + 1 - told


def test_functions_are_short():
    long = {
        f"{path} {node.name}": f"{parameters(node)} parameters, {lines(node)} lines"
        for path, node in nodes(FUNCTION)
        if parameters(node) > MOST_PARAMETERS or lines(node) > MOST_LINES
    }
    assert {name: size for name, size in long.items() if name not in EXCEPTIONS} == {}
    assert EXCEPTIONS.keys() <= long.keys(), "these are short now"


def test_lengths_are_counted():
    """A function of a docstring of two lines, with two parameters beside self, and two lines more."""
    text = 'def f(self, a, *, b):\n    """One.\n    Two."""\n    return a\n'
    (node,) = ast.parse(text).body
    assert (parameters(node), lines(node)) == (2, 2)


def test_no_two_classes_share_a_name():
    count = Counter(node.name for _, node in nodes(ast.ClassDef))
    assert [name for name, number in count.items() if number > 1] == []


def test_docstrings_do_not_list_imports():
    """Such lists were wrong in half of the files: imports tell what a file depends on."""
    lists = re.compile(r"Depends on (bpy|NumPy|SciPy|embreex)( and \w+)?\.")
    told = [path for path, node in nodes(ast.Module) if lists.search(ast.get_docstring(node) or "")]
    assert told == []
