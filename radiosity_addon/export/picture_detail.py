"""Picture detail: how much of what a material shows is lost between the texels that Cycles baked of it."""

from __future__ import annotations

import numpy as np

from ..solver.adaptive.relative_error import FLOOR

SMALL = 4  # edge [texels] of the largest square whose triangle spans one texel or two
# Share [of what neighboring texels differ by] that an interpolated picture is off: of a second difference, as
# beside an edge, as measured; and of a first one, where a triangle has no more texels.
BEND, STEP = 0.4, 0.5


def detail_lost(pixels: np.ndarray, texels: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Error of a picture (height, width, 3), about, at places between its ``texels`` (see
    ``squares.texels_in``): local as that of light, root mean square; 0 of a black one."""
    mean = float(np.mean([pixels[some].mean() for some in texels]))
    if mean <= 0:
        return 0.0
    squares = weight = 0.0
    for rows, columns in texels:
        if rows.ndim == 1:
            off, size = STEP * _first_differences(pixels, rows, columns), SMALL
        else:
            off, size = BEND * _second_differences(pixels, rows, columns), 1
        level = np.maximum(pixels[rows, columns].mean(axis=-1, keepdims=True), FLOOR * mean)
        squares += size * float(((off / level) ** 2).sum())
        weight += size * off.size / 2
    return float(np.sqrt(squares / weight))


def _first_differences(pixels: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """(2, n, 3) from texels to those beside and above them."""
    middle = pixels[rows, columns]
    return np.stack([pixels[rows, columns + 1] - middle, pixels[rows + 1, columns] - middle])


def _second_differences(pixels: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """(2, n, k, 3) of texels and the two on either side of them, along both axes."""
    twice = 2 * pixels[rows, columns]
    return np.stack([
        pixels[rows, columns - 1] + pixels[rows, columns + 1] - twice,
        pixels[rows - 1, columns] + pixels[rows + 1, columns] - twice,
    ])  # fmt: skip
