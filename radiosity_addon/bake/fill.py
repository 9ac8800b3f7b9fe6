"""Fill: texels that nobody sees take the colors of those beside them. NumPy and SciPy only."""

from __future__ import annotations

import numpy as np


def fill_texels(pixels: np.ndarray, known: np.ndarray, wanted: np.ndarray) -> None:
    """Give the texels ``wanted`` of ``pixels`` (height, width, 3) the color of the nearest one
    that is ``known``, (height, width) bool both, of the same island; islands of which nothing is
    known stay as they are. Texels of an island touch, by a corner at least."""
    from scipy.ndimage import find_objects, label

    if not wanted.any():
        return
    island, _ = label(known | wanted, np.ones((3, 3), int))
    for number, box in enumerate(find_objects(island), 1):
        own = island[box] == number
        unknown = own & wanted[box]
        if unknown.any() and (own & known[box]).any():
            row, column = _nearest(own & known[box])
            filled = pixels[box]
            filled[unknown] = filled[row[unknown], column[unknown]]


def _nearest(known: np.ndarray) -> np.ndarray:
    """(2, height, width) rows and columns of the nearest texels that are ``known``."""
    from scipy.ndimage import distance_transform_edt

    return distance_transform_edt(~known, return_distances=False, return_indices=True)
