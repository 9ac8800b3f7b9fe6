"""Open Image Denoise's lightmap filter, where the package ``pyoidn`` is installed: the rival's
rival."""

from __future__ import annotations

import importlib.util
import time

import numpy as np

PACKAGE = "pyoidn"


def available() -> bool:
    """Whether images can be denoised here."""
    return importlib.util.find_spec(PACKAGE) is not None


def denoise(pixels: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, float] | None:
    """(size, size, 3) radiance denoised, and the seconds it took; None without the package.

    Texels outside the mask are filled from the nearest inside first (not timed), so that the
    filter sees no black borders.
    """
    if not available():
        return None
    from pyoidn import OIDN_FILTER_TYPE_RT_LIGHTMAP
    from pyoidn.denoise import denoise as run
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(~mask, return_distances=False, return_indices=True)
    color = np.ascontiguousarray(pixels[tuple(nearest)], np.float32)
    run(color[:8, :8], filter_type=OIDN_FILTER_TYPE_RT_LIGHTMAP)  # load its weights
    start = time.perf_counter()
    result = run(color, filter_type=OIDN_FILTER_TYPE_RT_LIGHTMAP)
    return np.asarray(result, float), time.perf_counter() - start
