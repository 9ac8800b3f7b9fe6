"""Meshes that several objects share: which they are, and copies of them. bpy."""

from __future__ import annotations


def sharing(items) -> list:
    """The objects, by name, whose mesh an earlier one of ``items`` has too. Those of other files
    are left out, as they cannot be given another mesh."""
    first: dict[str, str] = {}
    found = []
    for item in sorted(items, key=lambda item: item.name):
        if item.type != "MESH" or item.data.users < 2 or item.library or item.data.library:
            continue
        if first.setdefault(item.data.name_full, item.name) != item.name:
            found.append(item)
    return found


def make_single_user(items) -> int:
    """Give each object a copy of its mesh; how many."""
    for item in items:
        item.data = item.data.copy()
    return len(items)
