"""Exported: what leaves Blender. A Scene for the solver, and the objects in it that get colors."""

from __future__ import annotations

from dataclasses import dataclass

from ..bake.exported_object import ExportedObject
from ..solver.scene import Scene


@dataclass(frozen=True)
class Exported:
    """The scene, the receivers in it, and what was left out and why."""

    scene: Scene
    objects: tuple[ExportedObject, ...]
    skipped: tuple[tuple[str, str], ...]  # (object name, reason)
    warnings: tuple[str, ...]
