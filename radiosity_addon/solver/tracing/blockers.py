"""Blockers: what stands in the way of light. For some lamps that is not every object."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import Geometry
from ..scene import Scene
from .coincident import copied_often
from .embree import Tracer


@dataclass(frozen=True)
class Blockers:
    """``shadow`` blocks light altogether; ``transmitting`` lets some through, None: nothing does."""

    shadow: Tracer
    transmitting: Tracer | None


def trace_visible(scene: Scene, geometry: Geometry) -> Tracer:
    """What diffuse rays meet."""
    return _tracer(geometry, _of_objects(scene, scene.visible))


def build_blockers(
    scene: Scene, geometry: Geometry, transmits: np.ndarray, seen: Tracer, blocking: np.ndarray
) -> tuple[Blockers, ...]:
    """Those of each row of ``blocking`` (m, n_objects) bool; ``transmits`` (n_triangles,) bool.

    ``seen`` is what diffuse rays meet: its tree is used again for shadows of the same triangles.
    """
    met, casting = _of_objects(scene, scene.visible), _of_objects(scene, scene.casts_shadow)
    result = []
    for objects in blocking:
        blocks = casting & _of_objects(scene, objects)
        opaque, clear = blocks & ~transmits, blocks & transmits
        shadow = seen if np.array_equal(met, opaque) else _tracer(geometry, opaque)
        result.append(Blockers(shadow, _tracer(geometry, clear) if clear.any() else None))
    return tuple(result)


def _of_objects(scene: Scene, objects: np.ndarray | None) -> np.ndarray:
    """(n_triangles,) bool: triangles of ``objects`` (n_objects,) bool, of all for None."""
    return np.ones(len(scene.object), bool) if objects is None else objects[scene.object]


def _tracer(geometry: Geometry, keep: np.ndarray) -> Tracer:
    keep = keep & ~copied_often(geometry, keep)
    chosen = None if keep.all() else np.flatnonzero(keep)
    return Tracer(geometry.vertices, geometry.triangles, chosen)
