"""What has to know of a type of lamp: docs/architecture.md tells how to add one."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.solver import scene
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.lights.context import build_context
from radiosity_addon.solver.lights.light_batch import LightBatch
from radiosity_addon.solver.lights.sources import BATCHES
from radiosity_addon.solver.progress import silent
from radiosity_addon.solver.scene import WHITE, AreaLamp, Material, PointLamp, Scene, SunLamp

PACKAGE = Path(inspect.getfile(scene)).parents[1]
LAMPS = [thing for thing in vars(scene).values()
         if inspect.isclass(thing) and "color_field" in vars(thing)]  # fmt: skip
DOWN, ONE = np.array([0, 0, -1.0]), np.ones(3)
EXAMPLES = (
    PointLamp("Hard", DOWN, ONE), PointLamp("Sphere", DOWN, ONE, 0.1, sphere=True),
    PointLamp("Spot", DOWN, ONE, 0.1, axis=DOWN, cone=1.0), SunLamp("Sun", DOWN, ONE),
    AreaLamp("Panel", DOWN, ONE * [1, 0, 0], ONE * [0, 1, 0], DOWN, ONE),
)  # fmt: skip


def test_there_is_an_example_of_each_type():
    assert {type(lamp) for lamp in EXAMPLES} == set(LAMPS)


def test_each_type_has_the_fields_that_it_says_it_has():
    """What multiplies its light, and shapes it."""
    for lamp in LAMPS:
        names = {field.name for field in fields(lamp)}
        assert lamp.color_field in names
        assert lamp.takes_distribution == ("distribution" in names)


def asked_for(names: set[str], text: str) -> list[str]:
    """Code that asks for a type of these ``names``: by ``isinstance``, or comparing, but for what
    says what types are there."""
    found = []
    for node in ast.walk(ast.parse(text)):
        called = isinstance(node, ast.Call) and ast.unparse(node.func) == "isinstance"
        if called or isinstance(node, (ast.Compare, ast.Match)):
            if names & {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}:
                found.append(ast.unparse(node))
    return found


def asking(names: set[str]) -> list[str]:
    """Files of the add-on that ask for a type of these."""
    return [path.relative_to(PACKAGE).as_posix() for path in sorted(PACKAGE.rglob("*.py"))
            if asked_for(names, path.read_text(encoding="utf-8"))]  # fmt: skip


def test_types_of_lamps_are_asked_for_in_their_registry_only():
    assert asking({lamp.__name__ for lamp in LAMPS}) == ["solver/lights/sources.py"]


def test_types_that_are_asked_for_are_found():
    text = "a = isinstance(b, (A, B))\nc = type(b) == A\nd = isinstance(b, C)\ne = A(b)\n"
    assert asked_for({"A", "B"}, text) == ["isinstance(b, (A, B))", "type(b) == A"]


@pytest.mark.parametrize("lamp", LAMPS)
def test_a_lamp_is_named_where_it_is_made_and_in_its_batch_only(lamp):
    """The four steps, and the reader of the sky, whose disk is a sun."""
    steps = ("solver/scene.py", "export/lamps.py", "solver/lights/")
    named = [path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py")
             if re.search(rf"\b{lamp.__name__}\b", path.read_text(encoding="utf-8"))]  # fmt: skip
    assert set(name for name in named if not name.startswith(steps)) <= {"export/world.py"}
    assert {"solver/scene.py", "export/lamps.py", "solver/lights/sources.py"} <= set(named)


@pytest.mark.parametrize("lamp", EXAMPLES, ids=lambda lamp: lamp.name)
def test_each_lamp_has_one_line_of_the_registry(lamp):
    geometry = build_geometry(np.eye(3), np.array([[0, 1, 2]]))
    (make,) = [make for belongs, make in BATCHES if belongs(lamp)]
    batch = make([lamp, lamp], geometry)
    assert len(batch.color) == len(batch.power) == 2
    left = batch.leave(np.zeros(4096, int), np.random.default_rng(0).random((4096, 4)))
    assert left.power.mean() * batch.color[0] == pytest.approx(batch.power[0], rel=0.02)
    assert np.linalg.norm(left.direction, axis=1) == pytest.approx(1.0, abs=1e-6)


def test_nobody_asks_for_the_type_of_a_batch():
    """What batches differ in they tell by what ``LightBatch`` asks for."""
    asked = {name for name, _ in inspect.getmembers(LightBatch) if not name.startswith("_")}
    batches = {
        name
        for module in sys.modules.copy().values()
        if getattr(module, "__name__", "").startswith("radiosity_addon.solver.lights")
        for name, thing in inspect.getmembers(module, inspect.isclass)
        if thing is not LightBatch and asked <= {*dir(thing), *getattr(thing, "__dataclass_fields__", ())}
    }
    assert len(batches) > len(BATCHES), "those of lamps, and the sky's"
    assert asking(batches) == []


def test_faces_and_lamps_of_one_type_are_one_batch():
    """A glowing triangle, two panels and a sun: the faces and the panels in one batch, in this order."""
    glow = Material("Glow", WHITE, Constant(ONE))
    triangles = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
    vertices = np.concatenate([np.eye(3) / 10, 9 * np.eye(3)])
    number = np.arange(2, dtype=np.int32)
    panel, sun = EXAMPLES[-1], EXAMPLES[-2]
    found = Scene(vertices, triangles, number, 0 * number, (glow, Material("Gray")), ("A",), (sun, panel, panel))
    sources = build_context(found, 0, 1, silent).sources
    assert [len(batch.color) for batch in sources.batches] == [3, 1]
    assert sources.batches[0].object.tolist() == [0, -1, -1]
