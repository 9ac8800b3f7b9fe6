"""Radiosity: bake diffuse global illumination onto Blender objects, to an error you name."""

from __future__ import annotations

__version__ = "0.1.0"

_commands: list = []  # handles of the command lines registered with Blender


def register() -> None:
    """Add the sidebar tab and ``blender --command radiosity`` to Blender."""
    import bpy

    from . import ui

    ui.register()
    _commands.append(bpy.utils.register_cli_command("radiosity", _run_command))


def unregister() -> None:
    """Take back everything that ``register`` added."""
    import bpy

    from . import ui

    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    ui.unregister()


def glTF2_pre_export_callback(export_settings: dict) -> None:
    """Blender's glTF exporter calls this, by its name, before it exports."""
    from .gltf.blender_export import warn_of_plain_export

    warn_of_plain_export(export_settings["log"])


def _run_command(argv: list[str]) -> int:
    from .command import main

    return main(argv, opened=True, alone=True)
