"""Shared arrays: work on its way to other processes, with its large arrays in files that all of them map.

Pickled with the work, an array would be copied for each process; mapped, it is in memory once.
"""

from __future__ import annotations

import io
import mmap
import pickle
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .pickled import PROTOCOL, PickleReader

LEAST = 1 << 16  # size [bytes] of an array: below it, it is pickled


class SharedArrays:
    """Arrays in files, each as long as the array itself is there. They must not be changed after that:
    whoever tries gets NumPy's error of arrays that are read only."""

    def __init__(self, folders: Sequence[Path]) -> None:
        """In the first of ``folders`` that has room."""
        self._folders = folders
        self._shared: dict[int, Path] = {}
        self._number = 0

    def shared(self, array: np.ndarray, transposed: bool) -> str:
        """The path of the file that holds the array, its transpose where it is ``transposed``, which is written
        when it is asked for first. Raises OSError where there is no room for it."""
        key = id(array)
        if key not in self._shared:
            array.flags.writeable = False
            path = self._written(np.ascontiguousarray(array.T if transposed else array))
            self._shared[key] = path
            weakref.finalize(array, self._drop, key, path)
        return str(self._shared[key])

    def _written(self, array: np.ndarray) -> Path:
        """Its file, in the first folder that has room."""
        self._number += 1
        for folder in self._folders:
            path = folder / str(self._number)
            try:
                array.tofile(path)
                return path
            except OSError as error:
                remove(path)
                full = error
        raise full

    def _drop(self, key: int, path: Path) -> None:
        self._shared.pop(key, None)
        remove(path)


def remove(path: Path) -> None:
    """Remove a file, unless it is gone or still mapped (Windows): then it goes with its folder."""
    with suppress(OSError):
        path.unlink()


@dataclass(frozen=True)
class PackedWork:
    """Work that was pickled, and the large arrays in it, which others can map as long as this is there."""

    content: bytes
    arrays: tuple[np.ndarray, ...]


def pack_work(work: Any, arrays: SharedArrays, names: Mapping[int, str]) -> PackedWork:
    """The work pickled, with its large arrays among ``arrays``. Of what the other process has
    itself, whose id is in ``names``, the name only. Raises OSError where there is no room."""
    buffer = io.BytesIO()
    packer = _Packer(buffer, arrays, names)
    packer.dump(work)
    return PackedWork(buffer.getvalue(), tuple(packer.shared))


class _Packer(pickle.Pickler):
    def __init__(self, handle: io.BytesIO, arrays: SharedArrays, names: Mapping[int, str]) -> None:
        super().__init__(handle, PROTOCOL)
        self._arrays, self._names = arrays, names
        self.shared: list[np.ndarray] = []

    def persistent_id(self, thing: Any) -> tuple | None:
        name = self._names.get(id(thing))
        if name is not None:
            return "named", name
        if type(thing) is not np.ndarray or thing.dtype.hasobject or thing.nbytes < LEAST:
            return None
        repeated = [step == 0 and length > 1 for step, length in zip(thing.strides, thing.shape)]
        if any(repeated):  # along an axis: once is enough
            once = thing[tuple(slice(0, 1) if each else slice(None) for each in repeated)]
            return "repeated", once, thing.shape
        self.shared.append(thing)
        transposed = thing.flags.f_contiguous and not thing.flags.c_contiguous
        return "array", self._arrays.shared(thing, transposed), thing.dtype, thing.shape, transposed


class MappedArrays:
    """Arrays of another process, mapped, each once."""

    def __init__(self) -> None:
        self._mapped: weakref.WeakValueDictionary[str, np.ndarray] = weakref.WeakValueDictionary()

    def of(self, path: str, dtype: np.dtype) -> np.ndarray:
        """(n,) what the file at ``path`` holds, read only. Raises OSError when it is gone."""
        found = self._mapped.get(path)
        if found is None:
            with open(path, "rb") as handle:
                content = mmap.mmap(handle.fileno(), 0, access=mmap.ACCESS_READ)
            found = self._mapped[path] = np.frombuffer(content, dtype)
        return found


def unpack_work(packed: bytes, arrays: MappedArrays, held: Mapping[str, Any], writer: str) -> Any:
    """What ``pack_work`` made of work, with what this process has itself, ``held``, in its place. ``writer`` is what
    the package is called where it was packed. Raises OSError where an array is gone."""
    return _Unpacker(packed, arrays, held, writer).load()


class _Unpacker(PickleReader):
    def __init__(
        self, packed: bytes, arrays: MappedArrays, held: Mapping[str, Any], writer: str
    ) -> None:
        super().__init__(io.BytesIO(packed), writer)
        self._arrays, self._held = arrays, held

    def persistent_load(self, identity: tuple) -> Any:
        what, *rest = identity
        if what == "named":
            return self._held[rest[0]]
        if what == "repeated":
            return np.broadcast_to(*rest)
        path, dtype, shape, transposed = rest
        flat = self._arrays.of(path, dtype)
        return flat.reshape(shape[::-1]).T if transposed else flat.reshape(shape)
