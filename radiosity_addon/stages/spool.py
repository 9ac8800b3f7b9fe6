"""Spool: images that are done wait in a temporary file, where there are many. No bpy."""

from __future__ import annotations

import mmap
import tempfile

import numpy as np


class Spool:
    """Images that are done, in a temporary file where they take ``most`` bytes or more together."""

    def __init__(self, total: int, most: int):
        """``total`` bytes are to come. Raises OSError where there is no temporary file."""
        self._file = tempfile.TemporaryFile(prefix="radiosity-") if total >= most else None

    def keep(self, image: np.ndarray) -> np.ndarray:
        """The ``image`` (height, width, 4) float32 as an array in a file, to be read only. Raises OSError when the disk is full."""
        if self._file is None:
            return image
        start = self._file.seek(0, 2)
        try:
            self._file.write(memoryview(np.ascontiguousarray(image)).cast("B"))
            self._file.flush()
        except OSError as error:
            raise OSError(
                f"{tempfile.gettempdir()} takes no image of {image.nbytes / 2**20:.0f} MB "
                f"({error.strerror or error}); free some space there, or set TMPDIR to another disk"
            ) from error
        return np.memmap(self._file, image.dtype, "r+", start, image.shape)


def drop_pages(array: np.ndarray) -> None:
    """Give the memory back that holds what was read of an ``array`` in a file; it is read again when
    looked at. Nothing for other arrays, and where the system cannot."""
    mapped = getattr(array, "_mmap", None)
    if mapped is not None and hasattr(mmap, "MADV_DONTNEED"):
        mapped.madvise(mmap.MADV_DONTNEED)
