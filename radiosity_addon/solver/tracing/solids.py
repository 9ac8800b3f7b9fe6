"""Solids: closed meshes that are seen from outside; what lies inside them nobody sees.

A mesh that holds light, as a room modeled as one box does, is no solid; neither is a room in a
shell, as in a house whose walls have a thickness.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..fields import is_black
from ..geometry.triangles import Geometry
from ..scene import Scene
from ..workers.parallel import map_chunks
from .closed_meshes import ClosedMesh, closed_meshes

MOST = 1 << 12  # number [closed meshes] that may be solids, at most: the largest


@dataclass(frozen=True)
class Solid:
    """What ``shell`` surrounds but not one of its ``rooms``."""

    shell: ClosedMesh
    rooms: tuple[ClosedMesh, ...]

    def contains(self, position: np.ndarray) -> np.ndarray:
        """(k,) bool: places (k, 3) lie inside."""
        inside = self.shell.surrounds(position)
        for room in self.rooms:
            inside &= ~room.surrounds(position)
        return inside


@dataclass(frozen=True)
class Solids:
    """All solids of a scene."""

    solids: tuple[Solid, ...]
    threads: int

    def contain(self, position: np.ndarray) -> np.ndarray:
        """(k,) bool: places (k, 3) lie inside some solid."""
        order = np.argsort(position[:, 0], kind="stable")
        ordered = position[order]
        line = ordered[:, 0]

        def inside(solid: Solid) -> np.ndarray:
            some = slice(*np.searchsorted(line, (solid.shell.low[0], solid.shell.high[0])))
            return order[some][solid.contains(ordered[some])]

        result = np.zeros(len(position), bool)
        for found in map_chunks(inside, self.solids, self.threads):
            result[found] = True
        return result


def find_solids(scene: Scene, geometry: Geometry, opaque: np.ndarray, threads: int) -> Solids:
    """Of the triangles that are ``opaque`` (n_triangles,) bool."""
    meshes = closed_meshes(scene, geometry, opaque)[:MOST]
    lights = _Lights(_lamps(scene, geometry), _glowing(scene), geometry)
    shells = [mesh for mesh in meshes if mesh.outward and not lights.shine_in(mesh)]
    hollow = [mesh for mesh in meshes if not mesh.outward]
    rooms = [tuple(room for room in hollow if _is_inside(room, shell)) for shell in shells]
    return Solids(tuple(map(Solid, shells, rooms)), threads)


@dataclass(frozen=True)
class _Lights:
    """Positions (k, 3) of lamps, but for suns, and (n_triangles,) bool: triangles that glow."""

    lamps: np.ndarray
    glowing: np.ndarray
    geometry: Geometry

    def shine_in(self, mesh: ClosedMesh) -> bool:
        """Whether light falls inside: from a lamp or from faces that glow there, or from the mesh
        itself upon something that lies wholly inside."""
        return (
            bool(mesh.surrounds(self.lamps).any())
            or len(_within(mesh, self.glowing)) > 0
            or (bool(self.glowing[mesh.triangles].any()) and self._has_content(mesh))
        )

    def _has_content(self, mesh: ClosedMesh) -> bool:
        triangle = _within(mesh, np.ones_like(self.glowing))
        corners = self.geometry.vertices[self.geometry.triangles[triangle]]
        inside = mesh.surrounds(corners.reshape(-1, 3)).reshape(-1, 3)
        return bool(inside.all(axis=1).any())


def _within(mesh: ClosedMesh, chosen: np.ndarray) -> np.ndarray:
    """(k,) int: triangles ``chosen`` (n_triangles,) bool, not its own, whose middles it surrounds.
    """
    others = chosen.copy()
    others[mesh.triangles] = False
    triangle = np.flatnonzero(others)
    return triangle[mesh.surrounds(_middles(mesh.geometry, triangle))]


def _glowing(scene: Scene) -> np.ndarray:
    """(n_triangles,) bool."""
    glows = [not is_black(material.emission) for material in scene.materials]
    return np.array(glows, bool)[scene.material]


def _lamps(scene: Scene, geometry: Geometry) -> np.ndarray:
    middles = [lamp.middle for lamp in scene.lamps if lamp.middle is not None]
    return np.reshape([geometry.normalized(middle) for middle in middles], (-1, 3))


def _is_inside(room: ClosedMesh, shell: ClosedMesh) -> bool:
    if (room.low < shell.low).any() or (room.high > shell.high).any():
        return False
    return bool(shell.surrounds(_middles(room.geometry, room.triangles[:1]))[0])


def _middles(geometry: Geometry, triangle: np.ndarray) -> np.ndarray:
    """(k, 3) of triangles (k,)."""
    return geometry.p0[triangle] + (geometry.e1[triangle] + geometry.e2[triangle]) / 3
