"""The demo scene: what it holds, and that unknown names are refused."""

from __future__ import annotations

import numpy as np
import pytest

from radiosity_addon.export.demo import LAMP_GAP, build_demo


def test_cornell(blender, export):
    assert build_demo("cornell").name == "Cornell"
    exported = export()
    scene = exported.scene
    # Five walls, two blocks of five faces, one lamp, two triangles each.
    assert len(scene.triangles) == 2 * (5 + 2 * 5 + 1)
    assert not exported.warnings and not exported.skipped and scene.sky is None
    np.testing.assert_allclose(np.ptp(scene.vertices, axis=0), 2.0)
    lamp = [m.name for m in scene.materials].index("Lamp")
    corners = scene.vertices[scene.triangles[scene.material == lamp]]
    np.testing.assert_allclose(corners[..., 2], 2.0 - LAMP_GAP, atol=1e-6)
    normal = np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])
    assert normal[2] < 0
    assert sum(np.any(m.emission.value) for m in scene.materials) == 1


def test_walls_face_inwards_and_blocks_outwards(blender, export):
    build_demo("cornell")
    scene = export().scene
    corners = scene.vertices[scene.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = corners.mean(axis=1)
    wall = np.zeros(len(corners), bool)
    for axis, low, high in ((0, -1, 1), (1, -1, 1), (2, 0, 2)):
        flat = np.ptp(corners[..., axis], axis=1) < 1e-6
        wall |= flat & (np.isclose(middle[:, axis], low) | np.isclose(middle[:, axis], high))
    assert wall.sum() == 10
    assert np.all(np.einsum("ij,ij->i", normal, (0, 0, 1) - middle)[wall] > 0)


def test_unknown_demo(blender):
    with pytest.raises(ValueError, match="'sponza'.*cornell"):
        build_demo("sponza")
