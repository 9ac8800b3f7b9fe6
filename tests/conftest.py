"""What every test may lean on. Blender is imported only by the fixtures that hand it out."""

from __future__ import annotations

import pytest

from verification.blender_session import blender, pytest_report_header, pytest_sessionfinish

__all__ = ["blender", "pytest_report_header", "pytest_sessionfinish", "room", "yard"]


@pytest.fixture
def room(blender, tmp_path):
    """A saved file in a folder of its own: object ``Box``, an open box lit by the lamp ``Bulb``.

    The box has edges 2 m long, faces pointing inwards, five of six sides, and no UV map.
    """
    corners = [(x, y, z) for z in (0, 2) for y in (-1, 1) for x in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 2, 6, 4), (1, 5, 7, 3), (2, 3, 7, 6)]
    mesh = blender.data.meshes.new("Box")
    mesh.from_pydata(corners, [], sides)
    lamp = blender.data.lights.new("Bulb", "POINT")
    lamp.energy, lamp.shadow_soft_size = 100, 0
    for name, data in (("Box", mesh), ("Bulb", lamp)):
        blender.context.scene.collection.objects.link(blender.data.objects.new(name, data))
    blender.data.objects["Bulb"].location = (0, 0, 1)
    folder = tmp_path / "scene"
    folder.mkdir()
    path = folder / "room.blend"
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture
def yard(blender, tmp_path):
    """The path of a saved file with three objects: see ``atlas_yard.build_yard``."""
    from tests.atlas_yard import build_yard

    return build_yard(blender, tmp_path / "yard.blend")
