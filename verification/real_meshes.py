"""Real meshes for the furnace. Needs bpy."""

from __future__ import annotations

import numpy as np

from radiosity_addon.export import export_scene
from radiosity_addon.settings import Settings
from verification import meshes


def suzanne(levels: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of Suzanne, subdivided so often."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_monkey_add()
    if levels:
        bpy.context.object.modifiers.new("Subdivision", "SUBSURF").render_levels = levels
    return exported()


def room_around(vertices: np.ndarray, triangles: np.ndarray) -> list:
    """The triangles, and a closed box around them: parts for ``meshes.scene``."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    margin = 0.05 * (high - low).max()
    box, _ = meshes.box_polygons(high - low + 2 * margin, low - margin)
    return [*(meshes.grid(face, 1) for face in box), (vertices, triangles)]


def exported() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of the open file."""
    import bpy

    bpy.context.view_layer.update()
    scene = export_scene(bpy.context, Settings(), lambda fraction: None).scene
    return scene.vertices, scene.triangles
