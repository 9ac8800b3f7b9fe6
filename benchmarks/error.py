"""The relative error of a bake, against the truth or against two noisy references. NumPy only.

docs/theory.md section 8 derives both. Colours are (n, channels); a reference may hold NaN nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from radiosity_addon.bake.texels import texel_receivers

NEAR = 1e-5  # of an object's size: faces so near lie on one another
PARALLEL = 0.999  # cosine between their normals
SPREAD = tuple(product(np.linspace(0.02, 0.98, 9), repeat=2))  # places over a texel


@dataclass(frozen=True)
class Measured:
    """``error``: the relative error; ``uncertainty``: its standard error, from the references'
    noise alone. Where noise makes the squared error negative, ``error`` is 0."""

    error: float
    uncertainty: float

    def __str__(self) -> str:
        return f"{100 * self.error:.2f} % ± {100 * self.uncertainty:.2f}"


def relative_error(x: np.ndarray, a: np.ndarray, b: np.ndarray | None = None) -> Measured:
    """Local relative RMS error of x (n, channels) against the references a and b.

    sqrt(mean((x−a)(x−b) / max(L, L̄)²)), L the mean of a receiver's channels in the references and
    L̄ the mean of L. For an exact solution leave b out. Unbiased but for the noise in L, of second
    order: good references (1 %) make it negligible. Raises ValueError on shapes that differ,
    nothing to compare, values that are not finite, or a black reference.
    """
    b = a if b is None else b
    x, a, b = (np.asarray(array, float) for array in (x, a, b))
    if not x.shape == a.shape == b.shape or x.ndim != 2 or x.size == 0:
        raise ValueError(
            f"shapes {x.shape}, {a.shape}, {b.shape}; give equal (n, channels) with n >= 1"
        )
    for name, array in (("result", x), ("reference a", a), ("reference b", b)):
        if not np.isfinite(array).all():
            raise ValueError(f"{name} has {(~np.isfinite(array)).sum()} values that are not finite")
    light = (a + b).mean(axis=1) / 2
    if not light.mean() > 0:
        raise ValueError("the reference is black; a relative error needs light")
    scale = np.maximum(light, light.mean())[:, None]
    squares = ((x - a) * (x - b) / scale**2).mean(axis=1)
    error = float(np.sqrt(max(squares.mean(), 0.0)))
    noise = 0.0 if a is b else _noise(x, a, b, scale)
    return Measured(error, noise / (2 * error) if error > 0 else float(np.sqrt(noise)))


def _noise(x, a, b, scale) -> float:
    """Standard error of the mean of (x−a)(x−b)/scale² that the references' noise causes.

    With α, β the noises of variance σ² and d = x − t a receiver's term is d² − d(α+β) + αβ, of
    variance 2d²σ² + σ⁴. For Gaussian noise α−β is independent of α+β, so the square of
    (x − (a+b)/2)(a−b) has the mean (d² + σ²/2) 2σ²: the same. Channels of one receiver share their
    noise and are averaged first; receivers are independent.
    """
    product = ((x - (a + b) / 2) * (a - b) / scale**2).mean(axis=1)
    return float(np.sqrt((product**2).sum()) / len(x))


def reference_noise(a: np.ndarray, b: np.ndarray) -> float:
    """The relative error of one of two references of equal quality: ε² = mean((a−b)²) / 2."""
    scale = np.maximum((light := (a + b).mean(axis=1) / 2), light.mean())[:, None]
    return float(np.sqrt((((a - b) / scale) ** 2).mean() / 2))


def comparable_texels(uv: np.ndarray, resolution: int) -> np.ndarray:
    """Mask (resolution, resolution) of texels whose square lies within a single triangle.

    ``uv`` (n, 3, 2). Cycles samples one triangle per texel; elsewhere it bakes another quantity.
    """
    mask = np.zeros((resolution, resolution), bool)
    grid, _, _ = _whole_texels(uv, resolution)
    mask[grid[:, 1], grid[:, 2]] = True
    return mask


def doubled_texels(obj, resolution: int) -> np.ndarray:
    """Mask (resolution, resolution) of whole texels of a Blender mesh object on which, at one of
    9 × 9 places, another of its faces lies. Which of the two Cycles lights is a matter of rounding,
    and it leaves the other one black."""
    from mathutils.bvhtree import BVHTree

    uv = triangle_uvs(obj)
    triangles = np.array([each.vertices[:] for each in obj.data.loop_triangles])
    place = np.array([vertex.co[:] for vertex in obj.data.vertices])
    near = NEAR * np.ptp(place, axis=0).max()
    tree = BVHTree.FromPolygons(place.tolist(), triangles.tolist())
    grid, triangle, corners = _whole_texels(uv, resolution)
    mask = np.zeros((resolution, resolution), bool)

    def other_face(own: int, normal: np.ndarray, point: np.ndarray, within: float) -> bool:
        """Another face, parallel to this one, lies so near."""
        around = tree.find_nearest_range(point.tolist(), within)
        return any(k != own and abs(np.dot(n, normal)) > PARALLEL for _, n, k, _ in around)

    for (_, row, column), own, (low, right, up) in zip(grid, triangle, corners):
        frame = place[triangles[own, 1:]] - place[triangles[own, 0]]
        normal = np.cross(*frame)
        normal /= np.linalg.norm(normal)
        start, along, across = place[triangles[own, 0]] + low @ frame, *((right, up) - low) @ frame
        reach = np.linalg.norm(along) + np.linalg.norm(across)
        mask[row, column] = other_face(own, normal, start + (along + across) / 2, reach) and any(
            other_face(own, normal, start + x * along + y * across, near) for x, y in SPREAD
        )
    return mask


def _whole_texels(uv: np.ndarray, resolution: int):
    """Of texels within a single triangle: (k, 3) image, row, column; (k,) the triangle; (k, 3, 2)
    where origin, right and upper corner lie in it, barycentric."""
    receivers = texel_receivers(uv, np.arange(len(uv)), resolution)
    cells = np.bincount(receivers.receiver, minlength=receivers.count)
    alone = np.flatnonzero(cells == 1)
    first = np.searchsorted(receivers.receiver, alone)
    whole = receivers.square[first]
    cell = first[whole]
    return receivers.grid[alone[whole]], receivers.triangle[cell], receivers.corners[cell]


def triangle_uvs(obj, uv_map: str = "Radiosity") -> np.ndarray:
    """(n, 3, 2) float64 UVs of a Blender mesh object's triangles."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    uv = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[uv_map].data.foreach_get("uv", uv)
    return uv.reshape(-1, 2)[loops].reshape(-1, 3, 2).astype(float)
