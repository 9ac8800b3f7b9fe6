"""Which texels can be compared with Cycles'."""

import numpy as np

from verification.comparable_texels import comparable_texels, doubled_texels, triangle_uvs


def test_texels_on_which_another_face_lies(blender):
    """A square, and one in the same plane on it from x = 0.55 on: eight texels across, the first
    four of them alone."""
    blender.ops.wm.read_factory_settings(use_empty=True)
    mesh = blender.data.meshes.new("Two")
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    half = np.maximum(square, [0.55, 0, 0])
    mesh.from_pydata(np.vstack([square, half]).tolist(), [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    uv = np.vstack([square[:, :2] / 2, square[:, :2] / 2 + 0.5])
    mesh.uv_layers.new(name="Radiosity").uv.foreach_set("vector", uv.ravel().astype(np.float32))
    mask = doubled_texels(blender.data.objects.new("Two", mesh), 16)
    whole = comparable_texels(triangle_uvs(blender.data.objects["Two"]), 16)
    assert not mask[:8, :4].any()
    assert (mask[:8, 4:8] == whole[:8, 4:8]).all() and (mask[8:, 8:] == whole[8:, 8:]).all()
    assert mask.sum() > 60


def test_comparable_texels_of_a_split_square():
    """Two triangles fill [0, ½]² of a 8² image: of its 16 texels the 4 on the diagonal are shared,
    12 lie in one triangle."""
    uv = np.array([[[0, 0], [0.5, 0], [0.5, 0.5]], [[0, 0], [0.5, 0.5], [0, 0.5]]])
    mask = comparable_texels(uv, 8)
    assert mask.sum() == 12 and mask[:4, :4].sum() == 12
    assert not mask[np.arange(4), np.arange(4)].any()


def test_texels_beyond_a_border_are_not_compared():
    """A square from 1.5 to 6.5 texels of 8: of the texels at its border only a half lies in a triangle,
    of those at its corners a quarter; 4 × 4 are whole, less the 4 on the diagonal."""
    low, high = 1.5 / 8, 6.5 / 8
    a, b, c, d = (low, low), (high, low), (high, high), (low, high)
    mask = comparable_texels(np.array([[a, b, c], [a, c, d]]), 8)
    assert mask.sum() == 12 and mask[2:6, 2:6].sum() == 12
