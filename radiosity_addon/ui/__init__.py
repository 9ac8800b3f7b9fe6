"""The interface: properties, operators, panels. Draws and orchestrates; solves nothing.

Importing it is cheap; ``register`` imports bpy's parts, and SciPy and embreex wait for the first
bake.
"""

from __future__ import annotations


def register() -> None:
    """Add every class and property to Blender."""
    import bpy

    from . import bake_operators, keys, keywords, lifetime, menus, presets, progress_bar, properties

    for cls in _classes():
        if cls is bake_operators.RADIOSITY_OT_bake:
            cls.__annotations__ = keywords.annotations()  # of the settings, registered by now
        bpy.utils.register_class(cls)
    properties.register_properties()
    bpy.types.STATUSBAR_HT_header.append(progress_bar.draw_status)
    menus.add()
    keys.add()
    for moment, handler in lifetime.HANDLERS:
        getattr(bpy.app.handlers, moment).append(handler)
    bpy.utils.register_preset_path(presets.SHIPPED)


def unregister() -> None:
    """End a bake that runs, and take back everything ``register`` added."""
    import bpy

    from . import keys, lifetime, menus, preflight, presets, progress_bar, properties, session, view

    session.forget()
    view.forget()
    preflight.forget()
    bpy.utils.unregister_preset_path(presets.SHIPPED)
    for moment, handler in lifetime.HANDLERS:
        getattr(bpy.app.handlers, moment).remove(handler)
    bpy.types.STATUSBAR_HT_header.remove(progress_bar.draw_status)
    keys.take_away()
    menus.take_away()
    properties.unregister_properties()
    for cls in reversed(_classes()):
        bpy.utils.unregister_class(cls)


def _classes() -> tuple:
    """Every class, in the order in which they are registered and the panels are shown."""
    from . import (
        bake_operators,
        export_button,
        panels,
        presets,
        preview,
        properties,
        remove,
        report_panel,
        shared_meshes,  # fmt: skip
        view,
    )

    modules = (bake_operators, view, preview, remove, shared_meshes, export_button, presets, panels, report_panel)
    return (properties.RadiositySettings, *(cls for module in modules for cls in module.CLASSES))
