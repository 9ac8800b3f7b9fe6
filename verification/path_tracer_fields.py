"""Fields for the path tracer, looked up apart from the solver's own code."""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.fields import Constant, CornerColors, Texture
from radiosity_addon.solver.scene import Scene


def side_value(scene: Scene, name: str, triangle, uv, front) -> np.ndarray:
    """(n, 3) float64: what the material's side that ``front`` (n,) bool tells has for ``name``, at
    barycentric ``uv`` (n, 2)."""
    material, table = scene.material[triangle], np.zeros((len(scene.materials), 2, 3))
    varying = []
    for k, of_front in enumerate(scene.materials):
        for back, side in enumerate((of_front, of_front.back or of_front)):
            if isinstance(getattr(side, name), Constant):
                table[k, back] = getattr(side, name).value
            else:
                varying.append((k, back, getattr(side, name)))
    result = table[material, np.where(front, 0, 1)]
    for k, back, field in varying:
        some = np.flatnonzero((material == k) & (front != bool(back)))
        result[some] = _field(field, triangle[some], uv[some])
    return np.maximum(result, 0) if name == "emission" else np.clip(result, 0, 1)


def _field(field, triangle, uv) -> np.ndarray:
    """(n, 3) values of a field."""
    if isinstance(field, Constant):
        return np.broadcast_to(np.asarray(field.value, float), (len(triangle), 3))
    weight = np.column_stack([1 - uv.sum(axis=1), uv])[:, :, None]
    if isinstance(field, CornerColors):
        return (weight * field.values[triangle]).sum(axis=1)
    s, t = (weight * field.uv[triangle].astype(float)).sum(axis=1).T
    found = _picture(field, s * field.pixels.shape[1], t * field.pixels.shape[0])
    if field.encoded:  # IEC 61966-2-1
        found = np.where(found <= 0.04045, found / 12.92, ((found + 0.055) / 1.055) ** 2.4)
    return found * field.factor + field.offset


def _picture(field: Texture, x, y) -> np.ndarray:
    """(n, 3) pixels at places in units of texels, whose centers lie at half integers."""
    if field.interpolation == "Closest":
        return _texel(field, np.floor(x), np.floor(y))
    column, row = np.floor(x - 0.5), np.floor(y - 0.5)
    a, b = (x - 0.5 - column)[:, None], (y - 0.5 - row)[:, None]
    low = (1 - a) * _texel(field, column, row) + a * _texel(field, column + 1, row)
    high = (1 - a) * _texel(field, column, row + 1) + a * _texel(field, column + 1, row + 1)
    return (1 - b) * low + b * high


def _texel(field: Texture, column, row) -> np.ndarray:
    """(n, 3) float64, beyond the edges as the extension says."""
    height, width = field.pixels.shape[:2]
    outside = (column < 0) | (column >= width) | (row < 0) | (row >= height)
    places = []
    for index, size in ((row, height), (column, width)):
        if field.extension == "REPEAT":
            index = index % size
        elif field.extension == "MIRROR":
            index = np.minimum(index % (2 * size), 2 * size - 1 - index % (2 * size))
        places.append(np.clip(index, 0, size - 1).astype(int))
    values = field.pixels[places[0], places[1]].astype(float)
    return np.where(outside[:, None] & (field.extension == "CLIP"), 0.0, values)
