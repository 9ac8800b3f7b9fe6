"""What has to know of a type of lamp: docs/architecture.md tells how to add one."""

from __future__ import annotations

import ast
import inspect
import re
from pathlib import Path

import numpy as np
import pytest

from radiosity_addon.solver import scene
from radiosity_addon.solver.geometry.triangles import build_geometry
from radiosity_addon.solver.lights.sources import BATCHES
from radiosity_addon.solver.scene import AreaLamp, PointLamp, SunLamp

PACKAGE = Path(inspect.getfile(scene)).parents[1]
LAMPS = [thing for thing in vars(scene).values()
         if inspect.isclass(thing) and "color_field" in vars(thing)]  # fmt: skip
DOWN, ONE = np.array([0, 0, -1.0]), np.ones(3)
EXAMPLES = (
    PointLamp("Hard", DOWN, ONE), PointLamp("Sphere", DOWN, ONE, 0.1, sphere=True),
    PointLamp("Spot", DOWN, ONE, 0.1, axis=DOWN, cone=1.0), SunLamp("Sun", DOWN, ONE),
    AreaLamp("Panel", DOWN, ONE * [1, 0, 0], ONE * [0, 1, 0], DOWN, ONE),
)  # fmt: skip


def test_lamps_are_found():
    assert {lamp.__name__ for lamp in LAMPS} == {"PointLamp", "SunLamp", "AreaLamp"}


@pytest.mark.parametrize("lamp", LAMPS)
def test_a_lamp_is_named_where_it_is_made_and_in_its_batch_only(lamp):
    """The exporter, the scene, the batches of lights and their registry."""
    named = [path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py")
             if re.search(rf"\b{lamp.__name__}\b", path.read_text(encoding="utf-8"))]  # fmt: skip
    outside = [name for name in named if not name.startswith(("export/", "solver/lights/"))]
    assert outside == ["solver/scene.py"]
    assert "solver/lights/sources.py" in named


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
    batches = {"Polygons", "FacingDisks", "SphereLights", "Suns", "SkySpots"}
    asked = []
    for path in (PACKAGE / "solver").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
                asked += batches & {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
    assert asked == []
