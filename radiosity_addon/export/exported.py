"""Exported: what leaves Blender. A Scene for the solver, and how its triangles map back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..solver.scene import Scene

if TYPE_CHECKING:  # SciPy is imported where a matrix is first made
    from scipy.sparse import csr_matrix


@dataclass(frozen=True)
class ExportedObject:
    """A receiver object: its triangles in the scene and where their colours go."""

    name: str  # of the Blender object
    start: int  # its triangles are scene.triangles[start:stop]
    stop: int
    uv: np.ndarray | None  # (n, 3, 2) float64 of the map baked to; None for the vertex target
    # (3 n, n_loops): the colour at each evaluated triangle corner as a weighted sum of the colours
    # of the user's own mesh's loops (one-hot without modifiers). None for the image target.
    corner_map: csr_matrix | None
    loop_vertex: np.ndarray | None  # (n_loops,) int32: the user's mesh vertex of each loop
    loop_smooth_group: np.ndarray | None  # (n_loops,) int32: loops whose colours are one unknown
    identity: int = 0  # the object's session id, which a new name does not change
    n_loops: int = 0  # of the user's mesh
    modifiers: tuple[str, ...] = ()  # names of those that may change its faces


@dataclass(frozen=True)
class Exported:
    """The scene, the receivers in it, and what was left out and why."""

    scene: Scene
    objects: tuple[ExportedObject, ...]
    skipped: tuple[tuple[str, str], ...]  # (object name, reason)
    warnings: tuple[str, ...]
