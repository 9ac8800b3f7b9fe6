"""A yard of three objects without UV maps for tests of atlases, and what is looked at in one."""

from __future__ import annotations

import numpy as np

from radiosity_addon.bake.texels import coverage, texel_receivers
from tests.export.scene_building import add_object
from tests.one_core import FAST, main

SIDES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def build_yard(blender, path):
    """A saved file: the square ``Floor``, 4 m × 4 m, with the boxes ``Low``, 1 m × 1 m × 1 m, and
    ``High``, 1 m × 1 m × 2 m, over it, below a lamp. 16, 6 and 10 m², no UV maps."""
    add(blender, "Floor", np.array(SQUARE) * 2, [(0, 1, 2, 3)], (0, 0, 0))
    for name, height, x in (("Low", 1, -1), ("High", 2, 1)):
        points = [(i - 0.5, j - 0.5, height * k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
        add(blender, name, points, SIDES, (x, 0, 0.5))
    lamp = blender.data.lights.new("Bulb", "POINT")
    lamp.energy, lamp.shadow_soft_size = 500, 0.2
    add_object(blender, "Bulb", lamp, location=(0, -2, 4))
    return save(blender, path)


def add(blender, name, points, faces, location=(0, 0, 0)):
    mesh = blender.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, point)) for point in points], [], faces)
    mesh.materials.append(blender.data.materials.get("Gray") or blender.data.materials.new("Gray"))
    return add_object(blender, name, mesh, location=location)


def save(blender, path):
    blender.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def bake(scene, output, *options) -> int:
    return main([str(scene), "--target", "image", *FAST, "--output", str(output),
                 *map(str, options)])  # fmt: skip


def pixels_of(blender, name) -> np.ndarray:
    """(height, width, 4) of an image."""
    image = blender.data.images[name]
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


def triangles(item, uv_map="Radiosity"):
    """UVs (n, 3, 2) and corners in the world (n, 3, 3) of a mesh's triangles."""
    mesh = item.data
    mesh.calc_loop_triangles()
    loops = np.array([tuple(each.loops) for each in mesh.loop_triangles])
    corner = np.array([tuple(each.vertices) for each in mesh.loop_triangles])
    uv = np.array([tuple(each.vector) for each in mesh.uv_layers[uv_map].uv], float)
    points = np.array([tuple(item.matrix_world @ vertex.co) for vertex in mesh.vertices])
    return uv[loops], points[corner]


def texels(item, size, uv_map="Radiosity"):
    """{(row, column): covered share} of an object's texels in an image of this size."""
    uv, _ = triangles(item, uv_map)
    found = texel_receivers(uv, np.arange(len(uv)), size)
    return dict(zip(map(tuple, found.grid[:, 1:].tolist()), coverage(found, uv, 0, size)))


def density(item, size) -> float:
    """Texels per meter: the root of texels over square meters."""
    uv, points = triangles(item)
    (a, b), (u, v) = ((part[:, 1] - part[:, 0], part[:, 2] - part[:, 0]) for part in (uv, points))
    taken = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2 * size[0] * size[1]
    return float(np.sqrt(taken / (np.linalg.norm(np.cross(u, v), axis=1).sum() / 2)))


def gaps(items, size) -> float:
    """The least distance of a texel of one object to another's, between their middles."""
    from scipy.spatial import cKDTree

    trees = [cKDTree(np.array(list(texels(item, size)))) for item in items]
    pairs = [(a, b) for i, a in enumerate(trees) for b in trees[:i]]
    return min(float(a.query(b.data)[0].min()) for a, b in pairs)


def meshes(blender):
    return [blender.data.objects[name] for name in ("Floor", "Low", "High")]
