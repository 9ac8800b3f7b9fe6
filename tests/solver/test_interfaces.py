"""The declared interfaces: each of their kinds has all that is asked for, by the same words."""

from __future__ import annotations

import inspect
import pickle
from dataclasses import is_dataclass

import numpy as np
import pytest

from radiosity_addon.helper_processes import HelperProcesses
from radiosity_addon.replicate_process import ReplicateProcess
from radiosity_addon.settings import Settings
from radiosity_addon.solver.adaptive import requests
from radiosity_addon.solver.adaptive.plan import Plan
from radiosity_addon.solver.adaptive.processes import OpenHelpers
from radiosity_addon.solver.adaptive.requirements import SolverSettings
from radiosity_addon.solver.adaptive.second_replicate import (
    LocalReplicate,
    RemoteReplicate,
    SecondReplicate,
)
from radiosity_addon.solver.filtering.graph import Graph
from radiosity_addon.solver.filtering.lattice import Lattice
from radiosity_addon.solver.filtering.neighborhood import Neighborhood
from radiosity_addon.solver.lights.facing_disks import FacingDisks
from radiosity_addon.solver.lights.light_batch import LightBatch
from radiosity_addon.solver.lights.polygons import Polygons
from radiosity_addon.solver.lights.sky_spots import SkySpots
from radiosity_addon.solver.lights.spheres import SphereLights
from radiosity_addon.solver.lights.suns import Suns
from radiosity_addon.solver.sampling.guide import PlainRays, start_learning, sums_by_bin
from radiosity_addon.solver.scene import AreaLamp, Lamp, PointLamp, SunLamp
from radiosity_addon.solver.transport.solve_patches import SolvePlan
from radiosity_addon.solver.workers.parallel import Helpers

KINDS = [
    *((Lamp, kind) for kind in (PointLamp, SunLamp, AreaLamp)),
    *((LightBatch, kind) for kind in (Polygons, FacingDisks, SphereLights, Suns, SkySpots)),
    (Neighborhood, Lattice), (Neighborhood, Graph),
    (SecondReplicate, LocalReplicate), (RemoteReplicate, ReplicateProcess),
    (Helpers, HelperProcesses), (OpenHelpers, HelperProcesses),
    (SolvePlan, Plan), (SolverSettings, Settings),
]  # fmt: skip
NAMES = [f"{kind.__name__} as {protocol.__name__}" for protocol, kind in KINDS]


def members(protocol) -> list[str]:
    """What an interface asks for."""
    own = {name for each in protocol.__mro__ if getattr(each, "_is_protocol", False)
           for name in vars(each)}  # fmt: skip
    return sorted(name for name in own if not name.startswith("_"))


def has(kind, name: str) -> bool:
    """Whether instances have it: a method, a property, or a field; or what __init__ sets."""
    fields = getattr(kind, "__dataclass_fields__", {})
    sources = [inspect.getsource(each) for each in kind.__mro__ if each is not object]
    return hasattr(kind, name) or name in fields or any(f"self.{name}" in text for text in sources)


@pytest.mark.parametrize("protocol, kind", KINDS, ids=NAMES)
def test_each_kind_has_what_its_interface_asks_for(protocol, kind):
    assert [name for name in members(protocol) if not has(kind, name)] == []
    for name in members(protocol):
        asked = inspect.getattr_static(protocol, name)
        if inspect.isfunction(asked):
            found = inspect.signature(getattr(kind, name)).parameters.values()
            wanted = inspect.signature(asked).parameters.values()
            assert [(p.name, p.kind, p.default) for p in found] == [
                (p.name, p.kind, p.default) for p in wanted
            ], name


def test_requests_are_data():
    """All that ``requests`` defines, the interface aside, is a frozen dataclass, so that it can be
    pickled and read again by another process."""
    own = [thing for thing in vars(requests).values()
           if inspect.isclass(thing) and thing.__module__ == requests.__name__]  # fmt: skip
    data = [thing for thing in own if thing is not requests.Request]
    assert len(data) > 5
    assert all(is_dataclass(thing) and thing.__dataclass_params__.frozen for thing in data)
    asked = requests.FollowMorePaths(2.5)
    assert pickle.loads(pickle.dumps(asked)) == asked


def test_rays_that_nobody_aimed_teach_what_their_cells_do():
    """A lesson is data: its cells are looked up when it is learned, and after a pickle alike."""
    random = np.random.default_rng(5)
    xi, turn, light = random.random((64, 2)), random.random(3), random.random(64 * 3)
    owners = np.array([2, 0, 1])
    rays = PlainRays(xi, turn, owners, light.astype(np.float32))
    late, early = (start_learning(np.array([0, 1, 1])) for _ in range(2))
    late.add(pickle.loads(pickle.dumps(rays)))
    early.add(sums_by_bin(early.bins(xi, turn, owners), rays.light))
    for name in ("number", "light", "square"):
        assert np.array_equal(getattr(late, name), getattr(early, name))
    assert late.number.sum() == light.size
