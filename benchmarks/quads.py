"""Quads for the benchmark scenes: rooms, blocks, columns, a wall with a window. NumPy; bpy at the
end. A quad is (4, 3), counter-clockwise as seen from its front."""

from __future__ import annotations

import numpy as np

# Of a box: corner indices (z slowest, x fastest) of each side, counter-clockwise from outside.
SIDES = {
    "-x": (0, 4, 6, 2),
    "+x": (1, 3, 7, 5),
    "-y": (0, 1, 5, 4),
    "+y": (2, 6, 7, 3),
    "-z": (0, 2, 3, 1),
    "+z": (4, 5, 7, 6),
}


def _corners(low, high) -> np.ndarray:
    low, high = np.asarray(low, float), np.asarray(high, float)
    unit = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    return unit * (high - low) + low


def room(low, high, skip: tuple[str, ...] = ()) -> list[tuple[str, np.ndarray]]:
    """(side, quad) of a box seen from inside, without the sides to skip."""
    corners = _corners(low, high)
    return [(side, corners[list(quad[::-1])]) for side, quad in SIDES.items() if side not in skip]


def block(low, high) -> list[np.ndarray]:
    """A box seen from outside; no bottom where it stands on the ground z = 0."""
    corners = _corners(low, high)
    sides = [quad for side, quad in SIDES.items() if side != "-z" or low[2] > 0]
    return [corners[list(quad)] for quad in sides]


def column(center, radius: float, height: float, sides: int) -> list[np.ndarray]:
    """The side of an upright prism from the ground up, seen from outside."""
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    x, y = center[0] + radius * np.cos(angle), center[1] + radius * np.sin(angle)
    return [
        np.array([(x[k], y[k], 0), (x[k + 1], y[k + 1], 0),
                  (x[k + 1], y[k + 1], height), (x[k], y[k], height)])  # fmt: skip
        for k in range(sides)
    ]


def wall_with_window(x, z, y: float, depth: float, hole_x, hole_z) -> list[np.ndarray]:
    """A wall at y facing -y with a rectangular hole, and the hole's reveal of that depth (+y)."""
    xs, zs = (x[0], *hole_x, x[1]), (z[0], *hole_z, z[1])
    quads = []
    for i in range(3):
        for k in range(3):
            if (i, k) != (1, 1):
                a, b, c, d = xs[i], xs[i + 1], zs[k], zs[k + 1]
                quads.append(np.array([(a, y, c), (b, y, c), (b, y, d), (a, y, d)]))
    low, high = (hole_x[0], y, hole_z[0]), (hole_x[1], y + depth, hole_z[1])
    return quads + [quad for _, quad in room(low, high, skip=("-y", "+y"))]


def mesh_object(name: str, faces: list[tuple[np.ndarray, int]], materials: tuple):
    """A linked Blender object of (quad, material slot), equal corners welded."""
    import bpy

    points = np.concatenate([quad for quad, _ in faces])
    vertices, index = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices.tolist(), [], index.reshape(-1, 4).tolist())
    for material in materials:
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [slot for _, slot in faces])
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj
