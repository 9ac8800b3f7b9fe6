"""Bake notes: what bakes made on a mesh, noted on it as JSON in a custom property, so it can be taken back.

Entries are known by the attribute's name: whether a bake made it, as a color attribute or as a UV
map, and which passes it holds. The empty name stands for a material slot.
"""

from __future__ import annotations

import json

MADE = "radiosity_made"  # custom property on meshes
PASSES = "radiosity_passes"  # custom property on images: the passes they hold, comma between
SCALE = "{}_scale"  # custom property of meshes and images: by what encoded colors were divided
OWNER = "radiosity_object"  # custom property on images: whom they were baked for, one a line
ATLAS = "radiosity_atlas"  # custom property on images that objects share: the atlas' full name
COLOR, UV_MAP, SLOT = "color", "uv", "slot"  # types of entries


def read_made(mesh) -> dict[str, dict]:
    """{name: {"kind", "new", "passes"}}; nothing where the note is missing or unreadable."""
    try:
        found = json.loads(mesh.get(MADE, "{}"))
    except (TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def note(mesh, name: str, **facts) -> None:
    """Add facts to the entry ``name``; a linked mesh, which nothing can be made on, has none."""
    if mesh.library is None:
        found = read_made(mesh)
        found[name] = {**found.get(name, {}), **facts}
        mesh[MADE] = json.dumps(found)


def forget(mesh, name: str) -> None:
    """Drop an entry, and the whole note with the last one."""
    found = read_made(mesh)
    if found.pop(name, None) is None:
        return
    if found:
        mesh[MADE] = json.dumps(found)
    else:
        del mesh[MADE]


def names_made(mesh, entry_type: str) -> list[str]:
    """The attributes or UV maps that bakes added to the mesh and that nobody renamed since."""
    there = mesh.uv_layers if entry_type == UV_MAP else mesh.color_attributes
    entries = read_made(mesh).items()
    return [name for name, e in entries if e.get("kind") == entry_type and e.get("new") and name in there]


def passes_of(mesh, name: str) -> tuple[str, ...]:
    """The passes that the color attribute ``name`` holds; empty where a bake did not note them."""
    return tuple(read_made(mesh).get(name, {}).get("passes", ()))
