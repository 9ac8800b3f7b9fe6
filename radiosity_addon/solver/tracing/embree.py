"""Embree: the one file that knows embreex. Rays in, hits out, float32.

Embreex checks no shapes and prints its device's errors to a log, so both are checked here.
The vertices must already be centered and scaled to a unit box (``geometry``): float32 needs it.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from functools import cache
from threading import Lock

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from ..array_struct import ArrayStruct


class _DeviceErrors(logging.Handler):
    """Keeps what Embree's device says, so that it is raised and not only logged."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.messages.append(record.getMessage())

    def raise_any(self) -> None:
        """Raise MemoryError or RuntimeError with what was said since the last time."""
        if self.messages:
            said, self.messages = "; ".join(self.messages), []
            error = MemoryError if "memory" in said.lower() else RuntimeError
            raise error(f"Embree failed: {said}; free some memory or simplify the scene")


_DEVICE = _DeviceErrors()
_LOG = logging.getLogger("embreex")
_LOG.addHandler(_DEVICE)
_LOG.setLevel(logging.ERROR)  # whatever the application shows


@cache
def _device() -> EmbreeDevice:
    """The one device of all scenes. With a device each, as embreex makes them, a process ends by a
    segmentation fault at about the thousandth scene."""
    return EmbreeDevice()


@dataclass(frozen=True)
class Hits(ArrayStruct):
    """What each of n rays met first. ``triangle`` is -1 where it met nothing; ``u``, ``v`` and
    ``front`` are 0 there."""

    triangle: np.ndarray  # (n,) int32
    u: np.ndarray  # (n,) float32 barycentric
    v: np.ndarray  # (n,) float32
    distance: np.ndarray  # (n,) float32, in units of the direction's length
    front: np.ndarray  # (n,) bool: the ray met the front of the triangle


class Tracer:
    """An Embree scene of one triangle mesh. Counts its rays and the seconds Embree spent."""

    def __init__(
        self, vertices: np.ndarray, triangles: np.ndarray, chosen: np.ndarray | None = None
    ) -> None:
        """``vertices`` (n, 3) within [-1, 1]; ``triangles`` (m, 3) indices into them, m >= 0.

        Only the triangles ``chosen`` (k,) int are there to be met, all where it is None; hits
        still number them among the m. Raises ValueError for arrays that are anything else,
        RuntimeError where Embree cannot build its tree.
        """
        triangles = np.asarray(triangles)
        self._chosen = None if chosen is None else np.append(chosen, -1).astype(np.int32)
        if chosen is not None:
            triangles = triangles[chosen]
        vertices, triangles = _checked_mesh(np.asarray(vertices), triangles)
        self.rays = 0
        self.seconds = 0.0
        self._lock = Lock()
        self._empty = len(triangles) == 0
        if self._empty:
            return
        self._scene = EmbreeScene(_device())
        self._mesh = TriangleMesh(self._scene, vertices, triangles)
        # The first call commits the scene (builds the tree); it must not happen on two threads.
        one = np.zeros((1, 3), np.float32)
        self._scene.run(one, one + 1)
        _DEVICE.raise_any()

    def intersect(self, origins: np.ndarray, directions: np.ndarray) -> Hits:
        """First hits of rays (n, 3), (n, 3) float32."""
        n = _check(origins, directions)
        if self._empty or n == 0:
            zero = np.zeros(n, np.float32)
            return Hits(np.full(n, -1, np.int32), zero, zero, zero, np.zeros(n, bool))
        start = time.perf_counter()
        found = self._scene.run(origins, directions, output=True)
        self._count(n, start)
        _DEVICE.raise_any()
        triangle, normal, u, v = (found[name] for name in ("primID", "Ng", "u", "v"))
        # Embree writes nothing where a ray meets nothing: what stands there may be any number.
        missed = triangle < 0
        u[missed] = v[missed] = normal[missed] = 0
        front = np.einsum("ij,ij->i", normal, directions) < 0
        if self._chosen is not None:
            triangle = self._chosen[triangle]
        return Hits(triangle, u, v, found["tfar"], front)

    def clear(
        self, origins: np.ndarray, segments: np.ndarray, lengths: float | np.ndarray | None = None
    ) -> np.ndarray:
        """(n,) bool: nothing lies on ``origin + t·segment``, 0 < t < ``lengths`` (default 1).

        ``lengths`` may be np.inf for rays that leave the scene.
        """
        n = _check(origins, segments)
        if self._empty or n == 0:
            return np.ones(n, bool)
        limits = np.full(n, 1.0 if lengths is None else lengths, np.float32)
        if np.isnan(limits).any():
            raise ValueError("lengths are not numbers; a ray without end has the length inf")
        start = time.perf_counter()
        blocked = self._scene.run(origins, segments, limits, query="OCCLUDED")
        self._count(n, start)
        _DEVICE.raise_any()
        return blocked != 0

    def _count(self, n: int, start: float) -> None:
        seconds = time.perf_counter() - start
        with self._lock:
            self.rays += n
            self.seconds += seconds


def _checked_mesh(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What Embree takes: (n, 3) float32, (m, 3) int32, contiguous. ValueError for anything else."""
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices have the shape {vertices.shape}; it must be (n, 3)")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
        raise ValueError(
            f"triangles are {triangles.dtype} {triangles.shape}; they must be integers (m, 3)"
        )
    if not np.isfinite(vertices).all() or (len(vertices) and np.abs(vertices).max() > 1.001):
        raise ValueError("vertices must be finite and within [-1, 1]; normalize them first")
    if len(triangles) and not (0 <= triangles.min() <= triangles.max() < len(vertices)):
        raise ValueError("triangles name vertices that do not exist")
    return np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(triangles, np.int32)


@np.errstate(over="ignore", invalid="ignore")
def _check(origins: np.ndarray, directions: np.ndarray) -> int:
    for name, array in (("origins", origins), ("directions", directions)):
        if array.dtype != np.float32 or array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name} are {array.dtype} {array.shape}; they must be float32 (n, 3)")
        if not array.flags.c_contiguous:
            raise ValueError(f"{name} are not contiguous; Embree would read the wrong numbers")
        if not _finite(array):
            raise ValueError(f"{name} are not finite; check what they were made from")
    if len(origins) != len(directions):
        raise ValueError(f"{len(origins)} origins but {len(directions)} directions")
    return len(origins)


def _finite(array: np.ndarray) -> bool:
    """Whether all numbers are: seen from their sum's square, at a tenth of looking at each."""
    flat = array.reshape(-1)
    return bool(np.isfinite(np.dot(flat, flat)) or np.isfinite(flat).all())
