"""Evaluate fields: reflectance, emission and transmittance at points on the surface."""

from __future__ import annotations

import numpy as np

from ..fields import Constant, CornerColors, Field, Texture, srgb_to_linear
from ..scene import Quantity, Scene


def evaluate_material(
    scene: Scene, quantity: Quantity, triangle: np.ndarray, uv: np.ndarray,
    front: np.ndarray | None = None,
) -> np.ndarray:
    """(n, 3) float64: ``quantity`` at barycentric
    ``uv`` (n, 2) of ``triangle`` (n,), seen from the side that ``front`` (n,) bool tells; None:
    all from the front."""
    materials, material = scene.materials, scene.material[triangle]
    if front is not None and any(m.back for m in materials):
        material = np.where(front, material, material + len(materials))
        materials = materials + tuple(m.back or m for m in materials)
    fields = [getattr(m, quantity) for m in materials]
    constants = np.array(
        [f.value if isinstance(f, Constant) else (0, 0, 0) for f in fields], float
    ).reshape(-1, 3)
    result = constants[material]
    varying = [i for i, f in enumerate(fields) if not isinstance(f, Constant)]
    if varying:
        for i in np.intersect1d(varying, np.unique(material)):
            chosen = np.flatnonzero(material == i)
            result[chosen] = evaluate_field(fields[i], triangle[chosen], uv[chosen])
    return result


def evaluate_field(field: Field, triangle: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(n, 3) float64 values of one field."""
    if isinstance(field, Constant):
        return np.broadcast_to(np.asarray(field.value, float), (len(triangle), 3)).copy()
    weights = np.stack([1 - uv[:, 0] - uv[:, 1], uv[:, 0], uv[:, 1]], 1)
    if isinstance(field, CornerColors):
        return np.einsum("nc,ncd->nd", weights, field.values[triangle].astype(float))
    point = np.einsum("nc,ncd->nd", weights, field.uv[triangle].astype(float))
    found = _lookup(field, point)
    return (srgb_to_linear(found) if field.encoded else found) * field.factor + field.offset


def _lookup(texture: Texture, point: np.ndarray) -> np.ndarray:
    """Nearest or bilinear texels at UV ``point`` (n, 2); texel centers lie at half integers."""
    height, width = texture.pixels.shape[:2]
    x, y = point[:, 0] * width, point[:, 1] * height
    if texture.interpolation == "Closest":
        return texels(texture, np.floor(x).astype(int), np.floor(y).astype(int))
    return bilinear(texture, np.stack([x, y], 1))


def bilinear(texture: Texture, point: np.ndarray) -> np.ndarray:
    """(n, 3) pixels interpolated at ``point`` (n, 2) in texels, as they are encoded."""
    x, y = point.T - 0.5
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - column)[:, None], (y - row)[:, None]
    low = texels(texture, column, row) * (1 - fx) + texels(texture, column + 1, row) * fx
    high = texels(texture, column, row + 1) * (1 - fx) + texels(texture, column + 1, row + 1) * fx
    return low * (1 - fy) + high * fy


def texels(texture: Texture, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """(n, 3) float64 pixels, with the image's extension beyond its edges."""
    height, width = texture.pixels.shape[:2]
    pixels = texture.pixels
    if texture.extension == "REPEAT":
        return pixels[row % height, column % width].astype(float)
    if texture.extension == "MIRROR":
        row, column = mirrored(row, height), mirrored(column, width)
        return pixels[row, column].astype(float)
    values = pixels[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)].astype(float)
    if texture.extension == "CLIP":
        outside = (row < 0) | (row >= height) | (column < 0) | (column >= width)
        values[outside] = 0
    return values


def mirrored(index: np.ndarray, size: int) -> np.ndarray:
    """Indices folded back and forth into ``range(size)``."""
    index = index % (2 * size)
    return np.where(index < size, index, 2 * size - 1 - index)
