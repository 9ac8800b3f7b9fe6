"""Dilation: colors carried from the islands into the margin around them. NumPy and SciPy only."""

from __future__ import annotations

import numpy as np

BAND = 1 << 22  # number [texels] whose distances are found together: they take 50 bytes each


def dilated(
    pixels: np.ndarray, covered: np.ndarray, margin: int, band: int = BAND
) -> tuple[np.ndarray, np.ndarray]:
    """RGBA image (height, width, 4) float32 from ``pixels`` (height, width, 3), and which of its texels have a
    color, (height, width) bool.

    Texels within ``margin`` (Euclidean, in texels) of a covered one take the color of the
    nearest covered texel, so that filtering between texels never mixes in black. Covered texels
    keep their color. Alpha is 1 on ``covered`` (height, width) bool and 0 elsewhere, in the
    margin too: it says which texels belong to a face. Beyond the margin the color is black.
    Distances of about ``band`` texels are found together. Raises ValueError when the shapes differ or
    the margin is negative.
    """
    if pixels.shape != (*covered.shape, 3):
        raise ValueError(f"pixels have shape {pixels.shape}; it must be {(*covered.shape, 3)}")
    if margin < 0:
        raise ValueError(f"margin is {margin}; it must be 0 or more")
    image = np.zeros((*covered.shape, 4), np.float32)
    image[covered, :3] = pixels[covered]
    image[covered, 3] = 1.0
    filled, (height, width) = covered.copy(), covered.shape
    rows = max(band // max(width, 1), margin, 1)
    for start in range(0, height, rows) if margin else ():
        stop = start + rows
        first = max(start - margin, 0)  # no texel looks further than the margin
        near = covered[first : stop + margin]
        if near.any() and not near.all():
            to, source = _nearest(near, margin)
            mine = (to[0] >= start - first) & (to[0] < stop - first)
            (row, column), (from_row, from_column) = (each[:, mine] + [[first], [0]] for each in (to, source))
            image[row, column, :3], filled[row, column] = pixels[from_row, from_column], True
    return image, filled


def _nearest(covered, margin) -> tuple[np.ndarray, np.ndarray]:
    """Texels of the margin, as (rows, columns), and of each its nearest covered texel; (2, n)."""
    from scipy.ndimage import distance_transform_edt

    distance, nearest = distance_transform_edt(~covered, return_indices=True)
    margin_texels = np.array(np.nonzero(~covered & (distance <= margin)))
    return margin_texels, nearest[:, margin_texels[0], margin_texels[1]]
