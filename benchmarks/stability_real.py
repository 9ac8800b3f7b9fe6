"""Furnaces closed around scene files, where they are. Needs bpy."""

from __future__ import annotations

from functools import partial

from benchmarks.scenes import SCENES
from verification.real_meshes import exported, room_around
from verification.stability_cases import Case
from verification.stability_measures import furnace


def real_furnace(name: str, rho: float) -> float:
    """A furnace around all triangles of the study scene ``name``. Raises SceneMissing where its
    file is not here."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    SCENES[name].build()
    return furnace(room_around(*exported()), rho, 0.03)


CASES = tuple(
    Case("furnace", f"{name}, ρ = {rho:g}", "B = 1", limit, partial(real_furnace, name, rho), True)
    for rho, limit in ((0.5, 5e-3), (0.99, 2e-2))
    for name in ("living_room", "room")
)
