"""Exported object: an object that gets colors, its triangles in the scene and where their colors go.

NumPy only: Blender's own process makes these, and SciPy is imported where a matrix is wanted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .windows import TexelRect


@dataclass(frozen=True)
class CornerMap:
    """The color at each evaluated triangle corner as a weighted sum of the user's loops' colors;
    a corner that came from nowhere has no weight."""

    start: np.ndarray  # (3 n + 1,) int: corner i has the entries from start[i] to start[i + 1]
    loops: np.ndarray  # (m,) int: loops of the user's mesh
    weights: np.ndarray  # (m,) float64
    n_loops: int  # of the user's mesh

    def matrix(self):
        """(3 n, n_loops) scipy.sparse.csr_matrix."""
        from scipy.sparse import csr_matrix

        shape = len(self.start) - 1, self.n_loops
        matrix = csr_matrix((self.weights, self.loops, self.start), shape=shape, copy=True)
        matrix.sum_duplicates()
        matrix.eliminate_zeros()
        return matrix


@dataclass(frozen=True)
class ExportedObject:
    """A receiver object: its triangles in the scene and where their colors go."""

    name: str  # of the Blender object
    start: int  # its triangles are scene.triangles[start:stop]
    stop: int
    uv: np.ndarray | None  # (n, 3, 2) float64, 0 to 1 over its window; None for the vertex target
    corner_map: CornerMap | None  # one-hot without modifiers; None for the image target
    loop_vertex: np.ndarray | None  # (n_loops,) int32: the user's mesh vertex of each loop
    loop_smooth_group: np.ndarray | None  # (n_loops,) int32: loops whose colors are one unknown
    identity: int = 0  # the object's session id, which a new name does not change
    n_loops: int = 0  # of the user's mesh
    modifiers: tuple[str, ...] = ()  # names of those that may change its faces
    normals: np.ndarray | None = None  # (n, 3, 3) float32: how its triangles' corners are shaded
    texel_normals: np.ndarray | None = None  # (height, width, 3) float32: means over texels, of maps
    fades: bool = False  # light that grazes these texels, before maps turn them, fades
    rect: TexelRect | None = None  # where its texels lie; None: an image of its own
