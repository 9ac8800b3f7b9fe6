"""Random numbers: no two parts of the solver draw the same ones, and none draws them again."""

from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import replace

import numpy as np

from radiosity_addon.settings import Settings
from radiosity_addon.solver import sequence
from radiosity_addon.solver.adaptive.replicate import PathsFor
from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.sampling import points
from radiosity_addon.solver.sampling import sobol as sobol_module
from radiosity_addon.solver.scene import PointLamp, Sky, SunLamp
from verification import meshes

DOWN = np.array([0, 0, -1.0])
ALIKE = {"_lesson"}  # tells where rays that were shot before went: the same numbers
# What draws again by intent: one set of points for all chunks of receivers, whose own random shifts
# tell them apart; and signs for differences, in every round, by which no light is sampled.
AGAIN = {"footprint_points", "_signs"}


def recorded(monkeypatch) -> dict[tuple, list]:
    """[(function, key)] of all draws of numbers from now on, by what these numbers are made from."""
    drawn = defaultdict(list)

    def recording(draw):
        def record(amount, *arguments):
            # Keys of few words and with zeros at their end are one to NumPy: states tell them apart.
            key = arguments[1:] if draw.__name__ == "sobol" else arguments
            state = tuple(np.random.SeedSequence(key).generate_state(4))
            function = sys._getframe(1).f_code.co_name
            if function not in ALIKE:
                drawn[state].append((function, key))
            return draw(amount, *arguments)

        return record

    for name in ("sobol", "uniform"):
        draw = getattr(sobol_module, name)
        record = recording(draw)
        record.__name__ = name
        for module in [m for n, m in sys.modules.items() if n.startswith("radiosity_addon.solver")]:
            if getattr(module, name, None) is draw:
                monkeypatch.setattr(module, name, record)
    return drawn


def shared(drawn: dict[tuple, list]) -> list[list]:
    """What draws the same numbers as something else, or draws them twice."""
    twice = [sites for sites in drawn.values() if len(sites) > 1]
    return [sites for sites in twice if len(set(sites)) > 1 or sites[0][0] not in AGAIN]


def crowded():
    """A room without a ceiling and with a block, of panes, under many lamps, a beam, sun and sky."""
    walls, _ = meshes.box_polygons()
    block, _ = meshes.box_polygons((0.3, 0.2, 0.4), (0.5, 0.5, 0))
    parts = [*(meshes.grid(wall, 1) for wall in walls[:5]), *(meshes.grid(s[::-1], 1) for s in block)]
    scene = meshes.scene(parts, reflectance=0.5)
    lamps = [PointLamp(f"{k}", np.array([0.1 + 0.08 * k, 0.3, 0.9]), np.ones(3), 0.05) for k in range(10)]
    beam = PointLamp("Beam", np.array([0.5, 0.5, 0.9]), np.ones(3), 0.001, axis=DOWN, cone=0.03)
    panes = (replace(m, transmittance=Constant(np.full(3, 0.3))) for m in scene.materials)
    return replace(scene, lamps=(*lamps, beam, SunLamp("Sun", DOWN, np.ones(3))), materials=tuple(panes),
                   sky=Sky(np.ones((4, 8, 3), np.float32)))  # fmt: skip


def test_no_numbers_are_drawn_twice(monkeypatch):
    """Errors of parts that share numbers would agree, and the replicates' difference not show them."""
    drawn = recorded(monkeypatch)
    scene = crowded()
    sequence.solve(scene, meshes.triangle_receivers(scene, 4), Settings(error=0.05, threads=1))
    assert len(drawn) > 300
    paths = {key[2] for sites in drawn.values() for function, key in sites if function == "follow_residual"}
    assert paths == set(PathsFor), "paths for the correction and for dividing elements were followed"
    assert shared(drawn) == []


def test_shared_numbers_are_found(monkeypatch):
    """Two of the keys are one to NumPy; another is used twice."""
    drawn = recorded(monkeypatch)
    for key in ((7, 2), (7, 2, 0), (7, 3), (7, 4), (7, 4)):
        points.sobol(4, 2, *key)
    assert len(drawn) == 3 and len(shared(drawn)) == 2
