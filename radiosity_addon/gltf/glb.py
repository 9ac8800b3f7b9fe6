"""GLB files: the JSON document and its one binary buffer (glTF 2.0, 4.4). Imports no bpy."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

MAGIC, VERSION = 0x46546C67, 2  # codes [glTF]: "glTF", and the version
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942  # codes [glTF] of chunks
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
FLOAT, ARRAY_BUFFER = 5126, 34962  # codes [OpenGL] of a number and of a buffer
NUMBERS = {5121: ("<u1", 255), 5123: ("<u2", 65535), FLOAT: ("<f4", 1)}  # by code [OpenGL]: type and what 1 is


class Glb:
    """A document and its buffer, to which data are added."""

    def __init__(self, document: dict, binary: bytes) -> None:
        self.document, self.binary = document, bytearray(binary)

    def add_view(self, data: bytes, target: int | None = None) -> int:
        """Append ``data`` as a buffer view, aligned to 4 bytes; returns its number."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self.binary += data
        return self.append("bufferViews", view)

    def append(self, section: str, entry: dict) -> int:
        """Add an entry to one of the document's lists; returns its number."""
        entries = self.document.setdefault(section, [])
        entries.append(entry)
        return len(entries) - 1

    def floats(self, accessor: int) -> np.ndarray:
        """(count, components) float32 of an accessor of floats or normalized numbers, without stride."""
        entry = self.document["accessors"][accessor]
        view = self.document["bufferViews"][entry["bufferView"]]
        width = COMPONENTS[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        dtype, one = NUMBERS[entry["componentType"]]
        flat = np.frombuffer(bytes(self.binary), dtype, entry["count"] * width, start)
        return (flat / np.float32(one)).reshape(-1, width)

    def add_floats(self, values: np.ndarray) -> int:
        """A new float accessor of ``values`` (count, 2 to 4); returns its number."""
        view = self.add_view(np.ascontiguousarray(values, "<f4").tobytes(), ARRAY_BUFFER)
        return self.append("accessors", {
            "bufferView": view, "componentType": FLOAT, "count": len(values),
            "type": f"VEC{values.shape[1]}",
        })  # fmt: skip

    def use(self, extension: str) -> None:
        """Say that the document uses an optional extension."""
        used = self.document.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)


def read_glb(path: str | Path) -> Glb:
    """Read a GLB file. Raises ValueError when it is none."""
    data = Path(path).read_bytes()
    if len(data) < 20 or struct.unpack_from("<II", data) != (MAGIC, VERSION):
        raise ValueError(f"{path} is no GLB file of version 2; export it again")
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    return Glb(document, data[20 + size + 8 :])


def write_glb(glb: Glb, path: str | Path) -> None:
    """Write the document and its buffer as one file."""
    binary = bytes(glb.binary) + b"\0" * (-len(glb.binary) % 4)
    glb.document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(glb.document, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    with open(path, "wb") as handle:
        handle.write(struct.pack("<III", MAGIC, VERSION, total))
        handle.write(struct.pack("<II", len(text), JSON_CHUNK) + text)
        handle.write(struct.pack("<II", len(binary), BINARY_CHUNK) + binary)
