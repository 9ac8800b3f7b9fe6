"""What the code of the add-on keeps to, so that it can be read: short functions, one word for one
thing."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "radiosity_addon"
MOST_PARAMETERS, MOST_LINES = 7, 40
# Functions that need more, by file and name, and why. Take out what no longer does.
EXCEPTIONS: dict[str, str] = {}
MOST_LINES_OF_A_FILE = 300
FUNCTION = (ast.FunctionDef, ast.AsyncFunctionDef)
ROOT = PACKAGE.parent
NOUN_AND_UNIT = re.compile(r"# [^\W\d_][^\[:]* \[[^\]]+\]")
VAGUE = set(
    "place turn told gone twin unseen apart parted reach kind kinds ways here whole solved needs"
    " passage veil pick meter janitor scratch".split()
)
PUBLIC = {"kinds"}  # a keyword of Remove Bake, which scripts use
PLACES = ("radiosity_addon", "tests", "verification", "benchmarks", "tools", "docs")
BRITISH = re.compile(
    r"""colour | neighbour | behaviour | favour | honour | labour | flavour | harbour
    | grey | centre | (?<!para)(?<!dia)(?<!peri)metre(?![a-z]) | fibre(?![a-z]) | artefact
    | (normal|summar|random|minim|maxim|initial|discret|optim|organ|recogn|real|general|linear
       |quant|serial|parametr|visual|util|special|local|categor|emphas|priorit)is(e[ds]?|ing|ation)\b
    | (mode|labe|leve|beve|trave)ll(ed|ing) | (?-i:[Cc]ancelled|[Cc]ancelling) | analys(ed|ing) | learnt\b | spelt\b | burnt\b
    | licence | defence | catalogue | sizeable | judgement | anti-?clockwise
    | \b(toward|afterward|backward|forward)[s]\b | whilst | amongst | per\ cent\b
    | (?<![A-Za-z])(?<!sun_)discs?(?![a-z]) | (?-i:Discs?(?![a-z]))""",
    re.IGNORECASE | re.VERBOSE,
)


def nodes(kinds):
    """(path, node) of each such node of the add-on."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, kinds):
                yield path.relative_to(PACKAGE).as_posix(), node


def parameters(node) -> int:
    """Of a function, but for ``self`` and ``cls``."""
    words = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    several = [node.args.vararg, node.args.kwarg]
    return sum(word.arg not in ("self", "cls") for word in words) + sum(word is not None for word in several)


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


def test_functions_beside_the_add_on_are_short():
    """Those of tests, verification, benchmarks and tools."""
    long = [
        f"{path.relative_to(ROOT)} {node.name}"
        for place in ("tests", "verification", "benchmarks", "tools")
        for path in sorted((ROOT / place).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, FUNCTION) and (parameters(node) > MOST_PARAMETERS or lines(node) > MOST_LINES)
    ]
    assert long == []


def test_files_are_of_one_thing():
    """A file of many lines is of several things: split it by what they are."""
    long = {
        path.relative_to(ROOT).as_posix(): count
        for place in PLACES
        for path in (ROOT / place).rglob("*.py")
        if (count := path.read_text(encoding="utf-8").count("\n")) > MOST_LINES_OF_A_FILE
    }
    assert long == {}


def test_lengths_are_counted():
    """A function of a docstring of two lines, with three parameters beside self, and two lines more."""
    text = 'def f(self, a, *c, b):\n    """One.\n    Two."""\n    return a\n'
    (node,) = ast.parse(text).body
    assert (parameters(node), lines(node)) == (3, 2)


def names(tree):
    """Every identifier that a syntax tree gives to something."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, (*FUNCTION, ast.ClassDef)):
            yield node.name


def words(name: str) -> set[str]:
    """Of an identifier, in lower case; equations of the second kind are called so."""
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
    return set(name.replace("second_kind", "second-kind").split("_"))


def test_code_uses_the_words_of_the_glossary():
    """Words that have stood for several things; docs/architecture.md has better ones."""
    found = [
        f"{path}: {name}"
        for path, tree in nodes(ast.Module)
        for name in names(tree)
        if words(name) & VAGUE and name not in PUBLIC
    ]
    assert found == []


def test_words_of_identifiers_are_told_apart():
    (tree,) = (
        ast.parse("class TurnTable:\n    def f(self, my_turn, of_second_kind):\n        turn, b = self.turned"),
    )  # fmt: skip
    assert [name for name in names(tree) if words(name) & VAGUE] == ["TurnTable", "my_turn", "turn"]


def is_number(value: ast.expr) -> bool:
    """Whether an expression is a number, a tuple of them, or made from some by NumPy."""
    if isinstance(value, ast.Constant):
        return isinstance(value.value, (int, float)) and not isinstance(value.value, bool)
    if isinstance(value, ast.UnaryOp):
        return is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return is_number(value.left) or is_number(value.right)
    if isinstance(value, ast.Call):
        return ast.unparse(value.func).startswith(("np.", "math.")) and all(
            map(is_number, value.args)
        )
    return isinstance(value, ast.Tuple) and bool(value.elts) and all(map(is_number, value.elts))


def numbers_without_units(text: str) -> list[str]:
    """Names of constants of a module that are numbers and have no comment such as ``# edge [texels]``,
    behind or above them."""
    lines, bare = text.splitlines(), []
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign) or not is_number(node.value):
            continue
        (target,) = node.targets
        names = [ast.unparse(each) for each in getattr(target, "elts", [target])]
        first = node.lineno - 1
        while first and lines[first - 1].startswith("#"):
            first -= 1
        above, behind = lines[first : node.lineno - 1], lines[node.end_lineno - 1].partition("#")
        comments = [" ".join(above), "".join(behind[1:])]
        if all(name.isupper() for name in names) and not any(map(NOUN_AND_UNIT.match, comments)):
            bare.append(", ".join(names))
    return bare


def test_constants_have_a_noun_and_a_unit():
    """ "noun [unit]: effect": what a number counts or measures, in what, and what it does."""
    bare = {path.relative_to(PACKAGE).as_posix(): numbers_without_units(path.read_text(encoding="utf-8"))
            for path in sorted(PACKAGE.rglob("*.py"))}  # fmt: skip
    assert {path: names for path, names in bare.items() if names} == {}


def test_bare_numbers_are_found():
    text = (
        "A = 1  # of all\nB, C = 2, -3.0\nD = 4  # edge [texels]: at most\n# Edge [m] of\n# it.\n"
        "E = np.cos(1)\nF = 'text'\nG = 2 * (1 << 3)  # number: [none]\n"
    )
    assert numbers_without_units(text) == ["A", "B, C", "G"]


def test_no_two_classes_share_a_name():
    count = Counter(node.name for _, node in nodes(ast.ClassDef))
    assert [name for name, number in count.items() if number > 1] == []


def test_docstrings_do_not_list_imports():
    """Such lists were wrong in half of the files: imports tell what a file depends on."""
    lists = [path for path, node in nodes(ast.Module) if "Depends on" in (ast.get_docstring(node) or "")]
    assert lists == []


def test_spelling_is_american():
    """As in Blender's interface, in code, docs and what users read."""
    written = [
        *ROOT.glob("*.*"),
        *(path for place in PLACES for path in (ROOT / place).rglob("*.*")),
    ]
    written = [path for path in written if path.suffix in (".py", ".md", ".toml")]
    written.remove(Path(__file__).resolve())
    british = [
        f"{path.relative_to(ROOT)}:{number} {found[0]}"
        for path in written
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if (found := BRITISH.search(line))
    ]
    assert len(written) > 400
    assert british == []


@pytest.mark.parametrize("word", ["colours", "normalised", "learnt", "Grey", "FacingDiscs", "Cancelled"])
def test_british_spelling_is_found(word):
    assert BRITISH.search(f"a {word} b")


@pytest.mark.parametrize(
    "word", ["colors", "noise", "parameter", "raised", "discontinuity", "sun_disc", "CANCELLED"]
)
def test_american_spelling_is_let_be(word):
    assert not BRITISH.search(f"a {word} b")


def left_out(version: str) -> list[str]:
    """What .ci/run leaves out with a module of Blender's: words of pytest."""
    gate = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    function = re.search(r"^left_out\(\) \{.*?^\}$", gate, re.MULTILINE | re.DOTALL)[0]
    code = f"NEWEST=5.3 OLDEST=4.5\n{function}\nleft_out {version}"
    return subprocess.check_output(["bash", "-c", code], text=True).split()


@pytest.mark.skipif(not shutil.which("bash"), reason="no bash")
@pytest.mark.parametrize("version", ["4.5", "5.2"])
def test_what_the_gate_leaves_out_is_there(version):
    """A file or a test that was renamed would run again, and take its time, without a word."""
    words = left_out(version)
    assert len(words) > 20 and left_out("5.3") == ["--ignore=tests/solver"]  # which run by themselves
    for word in words:
        path, *names = re.split(r"::|\[|\]", word.partition("=")[2])
        assert (ROOT / path).exists(), path
        text = (ROOT / path).read_text(encoding="utf-8") if names else ""
        assert all(name in text for name in names), word
