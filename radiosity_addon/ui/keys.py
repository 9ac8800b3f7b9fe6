"""Esc cancels a bake, wherever the mouse is and nothing else has a use for the key."""

import bpy

_ours: list[tuple] = []  # (key map, entry)


def add() -> None:
    """Add the entry; users find and change it in the preferences. Without a window there is none."""
    config = bpy.context.window_manager.keyconfigs.addon
    if config is not None:
        keys = config.keymaps.new(name="Window", space_type="EMPTY")
        _ours.append((keys, keys.keymap_items.new("radiosity.cancel", "ESC", "PRESS", head=True)))


def take_away() -> None:
    """Remove the entry."""
    while _ours:
        keys, entry = _ours.pop()
        keys.keymap_items.remove(entry)
