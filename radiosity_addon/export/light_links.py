"""Light links: which objects a lamp, or what emits, lights, and which shade its light."""

from __future__ import annotations

import numpy as np

from .light_objects import Light


def lit_objects(lights: list[Light], parts) -> tuple[np.ndarray | None, ...] | None:
    """For each lamp the indices (k,) int of the parts it lights, None for all; None when no lamp is linked.
    """
    return _each_or_none([_linked_parts(light, "receiver_collection", parts) for light in lights])


def shading_objects(lights: list[Light], parts) -> tuple[np.ndarray | None, ...] | None:
    """The same of the parts that cast a shadow in the lamp's light."""
    none = np.zeros(0, np.int32)
    return _each_or_none([
        _linked_parts(light, "blocker_collection", parts) if light.shaded else none
        for light in lights
    ])  # fmt: skip


def _each_or_none(entries: list) -> tuple | None:
    return None if all(entry is None for entry in entries) else tuple(entries)


def _linked_parts(light: Light, which: str, parts) -> np.ndarray | None:
    """Indices of the parts in a light linking collection of the lamp; None where it has none."""
    return _chosen(_collection(light.object, which) if light.object else None, parts)


def _chosen(collection, parts) -> np.ndarray | None:
    """Indices of the parts that a light linking collection lists; None without one.

    As in Cycles: when the collection includes anything, only that; else all but what it excludes.
    """
    if collection is None:
        return None
    include, exclude = _linked(collection)
    chosen = [bool(include & p.owners) if include else not exclude & p.owners for p in parts]
    return np.flatnonzero(chosen).astype(np.int32)


def emission_links(parts, palette) -> tuple[tuple | None, tuple | None]:
    """For each part the parts that its emission lights, and those that shade it, None for all; None
    where no emitting part is linked."""
    glowing = [palette.glows(index, part) for index, part in enumerate(parts)]
    return tuple(
        _each_or_none([
            _chosen(_owners_link(part, which) if glows else None, parts)
            for part, glows in zip(parts, glowing)
        ])
        for which in ("receiver_collection", "blocker_collection")
    )  # fmt: skip


def _owners_link(part, which: str):
    """The light linking collection of a part's object or of what instances it; None: none."""
    found = (_collection(owner, which) for owner in sorted(part.owners))
    return next((collection for collection in found if collection is not None), None)


def _collection(name: str, which: str):
    import bpy

    linking = getattr(bpy.data.objects.get(name), "light_linking", None)
    return getattr(linking, which, None)


def _linked(collection) -> tuple[set[str], set[str]]:
    """Names of the objects that a light linking collection includes and excludes."""
    sets = {"INCLUDE": set(), "EXCLUDE": set()}
    for child, entry in zip(collection.children, collection.collection_children):
        sets[entry.light_linking.link_state] |= {item.name for item in child.all_objects}
    for item, entry in zip(collection.objects, collection.collection_objects):
        sets[entry.light_linking.link_state].add(item.name)
    return sets["INCLUDE"], sets["EXCLUDE"]
