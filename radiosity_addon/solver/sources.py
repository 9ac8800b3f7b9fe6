"""Sources: which of a scene's lights are sampled explicitly, gathered into kinds.

Depends on ``scene``, ``geometry``, ``polygons``, ``spheres``, ``suns``, ``evaluate``. Lamps always are. Emissive faces are
where they are small beside the scene; large ones (a glowing wall, a furnace) are met by enough
rays anyway.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .coincident import exact_copies, overlapping
from .embree import Tracer
from .evaluate import evaluate_material
from .fields import Constant
from .geometry import Geometry
from .polygons import ELLIPSE, RECTANGLE, TRIANGLE, Polygons
from .scene import AreaLamp, Lamp, PointLamp, Scene, SunLamp
from .spheres import Spheres
from .suns import Suns

MAX_EMISSIVE_TRIANGLES = 4096
LARGEST_SHARE = 0.1  # of the scene's area: an object's emissive faces above it are left to rays


@dataclass(frozen=True)
class Sources:
    """All explicit lights, numbered through their kinds."""

    kinds: tuple  # of Polygons, Spheres, Suns
    kind: np.ndarray  # (n,) int: which kind a light belongs to
    place: np.ndarray  # (n,) int: its place in there
    linked: tuple  # (n,) arrays of object numbers it lights, or None for all

    @property
    def count(self) -> int:
        return len(self.kind)

    def scaled(self, factor: float) -> Sources:
        """The same lights, ``factor`` times as bright."""
        return replace(self, kinds=tuple(replace(k, color=k.color * factor) for k in self.kinds))

    def brightest(self) -> float:
        """The largest colour component of any light."""
        return max((float(kind.color.max()) for kind in self.kinds), default=0.0)


def build_sources(
    scene: Scene, geometry: Geometry, tracer: Tracer, suns: list[SunLamp]
) -> tuple[Sources, np.ndarray]:
    """Every light to sample, and (n_triangles,) bool: whose emission that covers."""
    explicit = emissive_triangles(scene, geometry)
    copies = exact_copies(geometry, explicit)
    if overlapping(geometry, tracer, explicit & ~copies).any():
        explicit &= ~overlapping(geometry, tracer, explicit)
    lamps = [lamp for lamp in (*scene.lamps, *suns) if _shines(lamp)]
    linked = {id(l): objects for l, objects in zip(scene.lamps, scene.lamp_objects or ())}
    rows = {Polygons: _emissive_polygons(scene, geometry, np.flatnonzero(explicit & ~copies))}
    objects = {Polygons: [None] * len(rows[Polygons]), Spheres: [], Suns: []}
    for lamp in lamps:
        kind, row = _lamp_row(lamp, geometry)
        rows.setdefault(kind, []).append(row)
        objects[kind].append(linked.get(id(lamp)))
    present = [kind for kind in (Polygons, Spheres, Suns) if rows.get(kind)]
    kinds = tuple(kind(*(np.array(column) for column in zip(*rows[kind]))) for kind in present)
    sizes = [len(rows[kind]) for kind in present]
    sources = Sources(
        kinds,
        np.repeat(np.arange(len(present)), sizes),
        np.concatenate([np.arange(size) for size in sizes] or [np.zeros(0, int)]),
        tuple(entry for kind in present for entry in objects[kind]),
    )
    return sources, explicit


def emissive_triangles(scene: Scene, geometry: Geometry) -> np.ndarray:
    """(n_triangles,) bool: triangles of constant emission to be sampled explicitly."""
    glowing = np.array(
        [isinstance(m.emission, Constant) and np.any(np.asarray(m.emission.value) > 0)
         for m in scene.materials],
        bool,
    )
    chosen = glowing[scene.material] if len(scene.material) else np.zeros(0, bool)
    if scene.visible is not None:
        chosen &= scene.visible[scene.object]
    group = scene.object.astype(np.int64) * len(scene.materials) + scene.material
    _, group = np.unique(group, return_inverse=True)
    group = group.reshape(-1)
    area = np.bincount(group, geometry.area * chosen)
    chosen &= (area <= LARGEST_SHARE * geometry.area.sum())[group] if len(group) else chosen
    return chosen & (chosen.sum() <= MAX_EMISSIVE_TRIANGLES) & (geometry.area > 0)


def _shines(lamp: Lamp) -> bool:
    color = {PointLamp: "intensity", SunLamp: "irradiance", AreaLamp: "radiance"}[type(lamp)]
    return bool(np.any(np.asarray(getattr(lamp, color)) > 0))


def _emissive_polygons(scene: Scene, geometry: Geometry, triangles: np.ndarray) -> list:
    """Rows of Polygons; two triangles that form a parallelogram become one rectangle."""
    radiance = evaluate_material(scene, "emission", triangles, np.full((len(triangles), 2), 1 / 3))
    number = {int(t): i for i, t in enumerate(triangles)}
    rows, used = [], set()
    for i, t in enumerate(triangles):
        if i in used:
            continue
        corners = geometry.vertices[geometry.triangles[t]]
        place, shape = (corners[0], corners[1] - corners[0], corners[2] - corners[0]), TRIANGLE
        partner = number.get(int(t) + 1)
        if partner is not None and np.array_equal(radiance[i], radiance[partner]):
            joined = _parallelogram(corners, geometry.vertices[geometry.triangles[t + 1]])
            if joined is not None:
                place, shape = joined, RECTANGLE
                used.add(partner)
        rows.append((radiance[i], shape, *place, geometry.normal[t], True, np.pi))
    return rows


def _parallelogram(first: np.ndarray, second: np.ndarray):
    """(origin, u, v) if two triangles (3, 3) make up a parallelogram, else None."""
    size = np.abs(first - first[0]).max()
    for turn in range(3):
        apex, b, c = np.roll(first, -turn, axis=0)
        gap = [np.abs(second - corner).max(axis=1).min() for corner in (b, c, b + c - apex)]
        if max(gap) <= 1e-9 * size:
            return apex, b - apex, c - apex
    return None


def _lamp_row(lamp: Lamp, geometry: Geometry):
    """The kind of a lamp and its row in there, in normalised lengths."""
    if isinstance(lamp, SunLamp):
        toward = -np.asarray(lamp.direction, float)
        toward = toward / np.linalg.norm(toward)
        return Suns, (np.asarray(lamp.irradiance, float), toward, np.tan(lamp.angle / 2))
    if isinstance(lamp, PointLamp):
        spot = lamp.axis is not None
        edge = np.cos(min(lamp.cone, 2 * np.pi) / 2) if spot else -2.0
        return Spheres, (
            np.asarray(lamp.intensity, float) / geometry.scale**2,
            geometry.normalised(lamp.position),
            lamp.radius / geometry.scale,
            np.asarray(lamp.axis if spot else (0, 0, -1), float),
            edge,
            (1 - edge) * lamp.blend if spot else 1.0,
        )
    u, v = np.asarray(lamp.u, float) / geometry.scale, np.asarray(lamp.v, float) / geometry.scale
    return Polygons, (
        np.asarray(lamp.radiance, float),
        ELLIPSE if lamp.ellipse else RECTANGLE,
        geometry.normalised(lamp.center) - (u + v) / 2,
        u,
        v,
        np.asarray(lamp.normal, float),
        False,
        min(lamp.spread, np.pi),
    )
