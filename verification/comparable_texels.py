"""Texels that may be compared with Cycles' bake: where both bake the same quantity."""

from __future__ import annotations

from itertools import product

import numpy as np

from radiosity_addon.bake.clip import doubled_areas
from radiosity_addon.bake.texels import texel_receivers
from radiosity_addon.solver.receivers import Receivers

NEAR = 1e-5  # of an object's size: faces so near lie on one another
PARALLEL = 0.999  # cosine between their normals
COVERED = 0.999  # of a texel
SPREAD = tuple(product(np.linspace(0.02, 0.98, 9), repeat=2))  # places over a texel


def comparable_texels(uv: np.ndarray, resolution: int) -> np.ndarray:
    """Mask (resolution, resolution) of texels whose square lies within a single triangle.

    ``uv`` (n, 3, 2). Cycles samples one triangle per texel; elsewhere it bakes another quantity.
    """
    mask = np.zeros((resolution, resolution), bool)
    grid, _, _ = _covered_texels(uv, resolution)
    mask[grid[:, 1], grid[:, 2]] = True
    return mask


def doubled_texels(obj, resolution: int) -> np.ndarray:
    """Mask (resolution, resolution) of whole texels of a Blender mesh object on which, at one of
    9 × 9 places, another of its faces lies. Which of the two Cycles lights is a matter of rounding,
    and it leaves the other one black."""
    from mathutils.bvhtree import BVHTree

    uv = triangle_uvs(obj)
    triangles = np.array([each.vertices[:] for each in obj.data.loop_triangles])
    position = np.array([vertex.co[:] for vertex in obj.data.vertices])
    near = NEAR * np.ptp(position, axis=0).max()
    tree = BVHTree.FromPolygons(position.tolist(), triangles.tolist())
    grid, triangle, corners = _covered_texels(uv, resolution)
    mask = np.zeros((resolution, resolution), bool)

    def other_face(own: int, normal: np.ndarray, point: np.ndarray, within: float) -> bool:
        """Another face, parallel to this one, lies so near."""
        around = tree.find_nearest_range(point.tolist(), within)
        return any(k != own and abs(np.dot(n, normal)) > PARALLEL for _, n, k, _ in around)

    for (_, row, column), own, (low, right, up) in zip(grid, triangle, corners):
        frame = position[triangles[own, 1:]] - position[triangles[own, 0]]
        normal = np.cross(*frame)
        normal /= np.linalg.norm(normal)
        start, along, across = position[triangles[own, 0]] + low @ frame, *((right, up) - low) @ frame
        extent = np.linalg.norm(along) + np.linalg.norm(across)
        mask[row, column] = other_face(own, normal, start + (along + across) / 2, extent) and any(
            other_face(own, normal, start + x * along + y * across, near) for x, y in SPREAD
        )
    return mask


def _covered_texels(uv: np.ndarray, resolution: int):
    """Of texels within a single triangle: (k, 3) image, row, column; (k,) the triangle; (k, 3, 2)
    where origin, right and upper corner lie in it, barycentric."""
    receivers = texel_receivers(uv, np.arange(len(uv)), resolution)
    texel, triangle, corners = covered_texels(receivers, uv, resolution)
    return receivers.grid[texel], triangle, corners


def covered_texels(
    receivers: Receivers, uv: np.ndarray, resolution: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(k,) int: the ``receivers`` that are whole texels within one triangle of ``uv`` (n, 3, 2); (k,) that triangle; and (k, 3, 2) where
    origin, right and upper corner of the texel lie in it, barycentric."""
    cells = np.bincount(receivers.receiver, minlength=receivers.count)
    alone = np.flatnonzero(cells == 1)
    first = np.searchsorted(receivers.receiver, alone)
    scale = np.abs(doubled_areas(uv * resolution))[receivers.triangle[first]]
    area = np.abs(doubled_areas(receivers.corners[first])) * scale  # of parallelograms [texels]
    covered = receivers.square[first] & (area > COVERED)
    cell = first[covered]
    return alone[covered], receivers.triangle[cell], receivers.corners[cell]


def triangle_uvs(obj, uv_map: str = "Radiosity") -> np.ndarray:
    """(n, 3, 2) float64 UVs of a Blender mesh object's triangles."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[uv_map].data.foreach_get("uv", uv)
    return uv.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(float)
