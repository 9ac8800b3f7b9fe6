"""UV maps that a bake made, kept out of the file until the bake is written. Depends on bpy.

While the solver works the user goes on working: what is not written yet must neither be saved nor
become part of another undo step.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np


@dataclass(frozen=True)
class HeldMap:
    """One UV map: the object's session id, its name, and the UV of each loop."""

    identity: int
    name: str
    values: np.ndarray  # (2 n_loops,) float32


def take_maps(made) -> list[HeldMap]:
    """Copy the maps out of the meshes: pairs of object name and map name. Changes nothing."""
    return [_take(bpy.data.objects[name], layer) for name, layer in made]


def _take(item, name: str) -> HeldMap:
    values = np.empty(2 * len(item.data.loops), np.float32)
    item.data.uv_layers[name].uv.foreach_get("vector", values)
    return HeldMap(item.session_uid, name, values)


def give_maps(held: list[HeldMap]) -> None:
    """Put the maps on the meshes again; a mesh that changed or is gone goes without."""
    objects = {item.session_uid: item for item in bpy.data.objects}
    for each in held:
        item = objects.get(each.identity)
        if item is not None and 2 * len(item.data.loops) == len(each.values):
            _give(item.data, each)


def _give(mesh, held: HeldMap) -> None:
    """What is active and what renders stays so."""
    layers = mesh.uv_layers
    active = layers.active.name if layers.active else held.name
    rendered = next((layer.name for layer in layers if layer.active_render), held.name)
    if held.name not in layers:
        layers.new(name=held.name, do_init=False)
    layers[held.name].uv.foreach_set("vector", held.values)
    layers.active = layers[active]
    layers[rendered].active_render = True
