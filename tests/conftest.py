"""What every test may lean on. Blender is imported only by the fixtures that hand it out."""

from __future__ import annotations

import pytest


@pytest.fixture
def blender():
    """bpy with an empty file: no objects, no world, factory settings."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy
