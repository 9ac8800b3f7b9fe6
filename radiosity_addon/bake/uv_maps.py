"""UV maps that a bake made: held outside of the file until they are wanted in it.

While a bake runs the user goes on working: what is not written yet must neither be saved nor
become part of another undo step.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from ..settings import Domain
from ..solver.expected import Refused
from .bake_notes import UV_MAP, forget, note, read_made
from .layers import bulk, item_count, write_attribute

FALLBACK = "{} UV"  # where an attribute that is no UV map holds the name already


@dataclass(frozen=True)
class HeldMap:
    """One UV map: whose it is, its name, and the UV of each loop."""

    identity: int  # the object's session id, which a new name does not change
    object: str  # its name when the map was made
    name: str
    values: np.ndarray  # (n_loops, 2) float32
    facts: dict = field(default_factory=dict)  # to be noted with it
    before: HeldMap | None = None  # what a map of this name holds so far

    @property
    def pair(self) -> tuple[str, str]:
        """(object name, map name)."""
        return self.object, self.name


def find_uv_map(mesh, name: str) -> str | None:
    """The UV map called ``name`` or what is made in its place; None without."""
    for candidate in (name, FALLBACK.format(name)):
        if candidate in mesh.uv_layers:
            return candidate
    return None


def free_name(mesh, name: str) -> str:
    """What a new map ``name`` will be called: attributes and UV maps share one set of names."""
    return FALLBACK.format(name) if name in mesh.attributes else name


def held_now(item, name: str) -> HeldMap:
    """A UV map that is there. Raises Refused where Edit Mode holds it."""
    if item.data.is_editmode:
        raise Refused(f"{item.name!r} is in Edit Mode; leave it, so that its map can be laid out")
    values = bulk(item.data.uv_layers[name].data, "uv", np.float32, 2)
    return HeldMap(item.session_uid, item.name, name, values, read_made(item.data).get(name, {}))


def give_maps(held) -> None:
    """Put the maps on their meshes; a mesh that changed or is gone goes without.

    Raises Refused, with none of the new maps left, when a mesh takes no map of that name.
    """
    import bpy

    objects = {item.session_uid: item for item in bpy.data.objects}
    made = []
    try:
        for each in held:
            item = objects.get(each.identity)
            if item is None or item_count(item.data, Domain.CORNER) != len(each.values):
                continue
            if each.name not in item.data.uv_layers:
                made.append((item.name, each.name))
                _add(item.data, each.name)
            write_attribute(item.data, each.name, each.values)
            if each.facts:
                note(item.data, each.name, **each.facts)
    except BaseException:
        remove_uv_maps(made)
        raise


def take_back(held) -> None:
    """Remove the maps, or bring back what they held before."""
    import bpy

    remove_uv_maps([each.pair for each in held if each.before is None])
    before = [each.before for each in held if each.before is not None]
    objects = {item.session_uid: item for item in bpy.data.objects}
    for each in before:
        if each.identity in objects:
            forget(objects[each.identity].data, each.name)
    give_maps(before)


@contextmanager
def given(held):
    """The maps are on their meshes inside; outside all is as it was."""
    give_maps(held)
    try:
        yield
    finally:
        take_back(held)


def remove_uv_maps(made: list[tuple[str, str]]) -> None:
    """Remove UV maps, (object name, map name) each, where they still exist."""
    import bpy

    for object_name, map_name in made:
        item = bpy.data.objects.get(object_name)
        layer = item.data.uv_layers.get(map_name) if item is not None else None
        if layer is not None:
            item.data.uv_layers.remove(layer)
            forget(item.data, map_name)


def _add(mesh, name: str) -> None:
    """Add an empty UV map; what is active and what renders stays so."""
    layers = mesh.uv_layers
    active = layers.active.name if layers.active else None
    rendered = next((layer.name for layer in layers if layer.active_render), None)
    layers.new(name=name, do_init=False)  # which 5.2 makes but does not return in Edit Mode
    if name not in layers:
        raise Refused(f"mesh {mesh.name!r} takes no UV map {name!r}; rename or remove one")
    note(mesh, name, kind=UV_MAP, new=True)
    if active is not None:
        layers.active = layers[active]
    if rendered is not None:
        layers[rendered].active_render = True
