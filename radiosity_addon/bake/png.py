"""PNG files from numbers, without Blender: 8 or 16 bits a channel, exactly the codes given."""

from __future__ import annotations

import struct
import zlib

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOR_TYPE = {3: 2, 4: 6}  # channels: PNG's number for RGB and RGBA


def png_bytes(codes: np.ndarray, srgb: bool) -> bytes:
    """A PNG file of ``codes`` (height, width, 3 or 4) uint8 or uint16, row 0 at the bottom.

    ``srgb``: the codes follow the sRGB curve, which the file then says (PNG 1.2, 4.2.2.3).
    Otherwise it says nothing, so that no reader converts codes that are numbers.
    """
    height, width, channels = codes.shape
    bits = 8 * codes.dtype.itemsize
    header = struct.pack(">IIBBBBB", width, height, bits, COLOR_TYPE[channels], 0, 0, 0)
    rows = codes[::-1].astype(codes.dtype.newbyteorder(">")).reshape(height, -1)
    raw = np.zeros((height, 1 + rows.nbytes // height), np.uint8)  # filter 0 before each row
    raw[:, 1:] = np.ascontiguousarray(rows).view(np.uint8).reshape(height, -1)
    curve = _chunk(b"sRGB", b"\0") if srgb else b""
    return b"".join((
        SIGNATURE, _chunk(b"IHDR", header), curve,
        _chunk(b"IDAT", zlib.compress(raw.tobytes(), 6)), _chunk(b"IEND", b""),
    ))  # fmt: skip


def _chunk(chunk_type: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + chunk_type + data + struct.pack(">I", zlib.crc32(chunk_type + data))
