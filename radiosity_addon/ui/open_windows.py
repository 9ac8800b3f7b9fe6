"""Windows, found again by their addresses: a timer may hold nothing of Blender's."""

import bpy


def find_window(address: int | None):
    """The window at this address, or another if that was closed."""
    windows = list(bpy.context.window_manager.windows)
    return next((each for each in windows if each.as_pointer() == address), windows[0])
