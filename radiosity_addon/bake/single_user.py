"""Meshes that several objects share: which they are, and copies of them. bpy."""

from __future__ import annotations


def sharing(items) -> list:
    """The objects, by name, that need a mesh of their own: where only ``items`` share one, all but the first of them, else
    all. Those of other files are left out, as they cannot be given another mesh."""
    groups: dict[str, list] = {}
    for item in sorted(items, key=lambda item: item.name):
        if item.type != "MESH" or item.data.users < 2 or item.library or item.data.library:
            continue
        groups.setdefault(item.data.name_full, []).append(item)
    found = [item for group in groups.values() for item in group[0 if _has_others(group) else 1 :]]
    return sorted(found, key=lambda item: item.name)


def _has_others(group: list) -> bool:
    """Whether objects that are not in the group have its mesh, too."""
    mesh = group[0].data
    return mesh.users - mesh.use_fake_user > len(group)


def make_single_user(items) -> int:
    """Give each object a copy of its mesh; how many."""
    for item in items:
        item.data = item.data.copy()
    return len(items)
