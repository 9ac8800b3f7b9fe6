"""Emissive faces: which emissive faces are sampled as lights, and the flat lights that they become.

Faces are where they are small beside the scene; large ones (a glowing wall, a furnace) are met by
enough rays anyway. Emission that varies is cut into cells. Where the back of a face emits otherwise
than its front, the two sides are lights of their own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..fields import Constant, is_black, same_field
from ..geometry.triangles import OFFSET, Geometry
from ..materials.emissive_parts import EmissiveParts, cut, undivided
from ..materials.evaluate import evaluate_material
from ..sampling.sobol import cosine_directions, sobol, tangent_frames
from ..sampling.streams import Stream
from ..scene import Scene
from ..tracing.coincident import uncovered
from ..tracing.embree import Tracer
from .flat_shapes import RECTANGLE, TRIANGLE
from .polygons import Polygons

LARGEST_SHARE = 0.1  # share [of the scene's area] of an object's glowing faces: where it is larger, rays find them
BRIGHT = 4.0  # radiance [of the scene's mean]: faces that are less bright are found by rays
MOST = 1 << 20  # number [lights]: where faces would be more, rays find them
PROBES = 1 << 20  # number [rays of all sides] that look where their light goes
MOST_PROBES = 32  # number [rays of a side], at most
HIDDEN = 0.02  # share [of a light's importance] that a side keeps of which every probe met a light


def emissive_faces(
    scene: Scene, geometry: Geometry, tracer: Tracer, most: int = MOST
) -> tuple[Polygons, np.ndarray]:
    """Lights of the emissive triangles to be sampled, and (n_triangles,) bool: which those are. Where they would be
    more than ``most``, only linked ones are sampled."""
    cells, share = _cells_of_sides(scene, geometry)
    glowing = np.flatnonzero(share)
    explicit = np.zeros(len(scene.triangles), bool)
    chosen = _small(scene, geometry, glowing, share[glowing]) & _bright(geometry, cells)[glowing]
    linked = linked_emitters(scene)[scene.object]  # rays know of no links
    explicit[glowing[chosen | linked[glowing]]] = True
    if explicit[cells.triangle].sum() > most:
        explicit &= linked
    cells = cells.take(np.flatnonzero(explicit[cells.triangle]))
    cells, left = uncovered(geometry, tracer, cells)
    explicit &= ~left
    cells = cells.take(np.flatnonzero(explicit[cells.triangle]))
    lights = as_polygons(geometry, cells, scene.object)
    return _with_open_sides(tracer, lights, explicit), explicit


def linked_emitters(scene: Scene) -> np.ndarray:
    """(n_objects,) bool: objects whose emission lights, or is shaded by, only some objects."""
    linked = np.zeros(len(scene.objects), bool)
    for links in (scene.emission_objects, scene.emission_blockers):
        if links is not None:
            linked |= [only is not None for only in links]
    return linked


def from_behind(scene: Scene) -> Scene:
    """The same scene with what its materials show on their backs."""
    return replace(scene, materials=tuple(m.back or m for m in scene.materials))


def emits_by_side(scene: Scene) -> np.ndarray:
    """(n_triangles,) bool: the back emits otherwise than the front."""
    by_side = [m.back is not None and not same_field(m.emission, m.back.emission)
             for m in scene.materials]  # fmt: skip
    return np.array(by_side, bool)[scene.material] if by_side else np.zeros(0, bool)


def _cells_of_sides(scene: Scene, geometry: Geometry) -> tuple[EmissiveParts, np.ndarray]:
    """Cells of all glowing faces; and (n_triangles,) the share of each triangle that glows, on the side where more of
    it does."""
    share, parts = np.zeros(len(scene.triangles)), []
    by_side = emits_by_side(scene)
    fronts, backs = _glowing(scene, geometry), by_side
    if by_side.any():
        backs = by_side & _glowing(from_behind(scene), geometry)
    for side, seen, some in ((1, scene, fronts), (-1, from_behind(scene), backs)):
        some = np.flatnonzero(some)
        cells, found = _cells(seen, geometry, some)
        share[some] = np.maximum(share[some], found)
        parts.append(replace(cells, side=np.where(by_side[cells.triangle], side, 0)))
    return EmissiveParts.join(parts), share


def _glowing(scene: Scene, geometry: Geometry) -> np.ndarray:
    """(n_triangles,) bool: triangles that may emit, and that rays may meet."""
    shining = np.array([not is_black(material.emission) for material in scene.materials], bool)
    chosen = shining[scene.material] if len(scene.material) else np.zeros(0, bool)
    if scene.visible is not None:
        chosen &= scene.visible[scene.object]
    return chosen & (geometry.area > 0)


def _cells(scene: Scene, geometry: Geometry, triangle: np.ndarray) -> tuple[EmissiveParts, np.ndarray]:
    """Cells of triangles (n,), and the share (n,) of each that glows."""
    varying = np.array([not isinstance(m.emission, Constant) for m in scene.materials], bool)
    varies = varying[scene.material[triangle]]
    constant = triangle[~varies]
    middle = np.full((len(constant), 2), 1 / 3)
    radiance = np.maximum(evaluate_material(scene, "emission", constant, middle), 0)
    share = np.ones(len(triangle))
    if not varies.any():
        return undivided(constant, radiance), share
    cells, share[varies] = cut(scene, triangle[varies], geometry.area[triangle[varies]])
    return EmissiveParts.join([undivided(constant, radiance), cells]), share


def _small(scene: Scene, geometry: Geometry, triangle: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(n,) bool: triangles of objects and materials that glow on little of the scene's area."""
    pair = scene.object[triangle].astype(np.int64) * len(scene.materials) + scene.material[triangle]
    _, group = np.unique(pair, return_inverse=True)
    group = group.reshape(-1)
    area = np.bincount(group, geometry.area[triangle] * share)
    return area[group] <= LARGEST_SHARE * geometry.area.sum()


def _bright(geometry: Geometry, cells: EmissiveParts) -> np.ndarray:
    """(n_triangles,) bool: triangles much brighter than the scene on average. Where everything
    glows alike (a furnace), rays find the light without noise, and choosing lights has some."""
    area = geometry.area[cells.triangle] * cells.share
    light = np.bincount(cells.triangle, area * cells.radiance.mean(axis=1), len(geometry.area))
    glowing = np.bincount(cells.triangle, area, len(geometry.area))
    return light * geometry.area.sum() > BRIGHT * light.sum() * glowing


def as_polygons(geometry: Geometry, cells: EmissiveParts, owner: np.ndarray) -> Polygons:
    """Lights, of both sides or of one, of triangles of objects ``owner`` (n_triangles,) int; two
    triangles of one object that form a parallelogram become one rectangle. A back's light is that
    of a face turned around."""
    t = cells.triangle
    corners = np.stack([geometry.at(t, cells.corners[:, k]) for k in range(3)], 1)
    first, rotation = _pairs(cells, corners, owner[t])
    corners[first] = corners[first[:, None], (rotation[:, None] + np.arange(3)) % 3]
    shape = np.full(len(t), TRIANGLE)
    shape[first] = RECTANGLE
    kept = np.setdiff1d(np.arange(len(t)), first + 1)
    t, corners, side, n = t[kept], corners[kept], cells.side[kept], len(kept)
    turned = side < 0
    corners[turned] = corners[turned][:, [0, 2, 1]]
    normal = np.where(turned[:, None], -geometry.normal[t], geometry.normal[t])
    varied = (cells.deviation[kept] > 0) & ~turned  # a picture on a back is known by its cells
    return Polygons(
        cells.radiance[kept], shape[kept], corners[:, 0], corners[:, 1] - corners[:, 0],
        corners[:, 2] - corners[:, 0], normal, side == 0, np.full(n, np.pi), np.ones(n),
        (side == 0) * 1.0, np.where(varied, t, -1), cells.corners[kept], owner[t],
    )  # fmt: skip


def _pairs(cells: EmissiveParts, corners: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cells that form a parallelogram with the next one, and at which of their corners (n, 3, 3)
    lies the angle opposite the shared edge."""
    even = cells.deviation == 0
    follows = np.isin(np.diff(cells.triangle), (0, 1)) & (np.diff(cells.side) == 0)
    follows &= np.diff(owner) == 0
    follows &= even[1:] & even[:-1]
    follows &= np.isclose(cells.radiance[1:], cells.radiance[:-1], rtol=1e-6, atol=0).all(axis=1)
    size = np.abs(corners - corners[:, :1]).max(axis=(1, 2))
    rotations = np.full(len(follows), -1)
    for rotation in range(3):
        apex, b, c = (corners[:-1, (rotation + k) % 3] for k in range(3))
        gap = [np.abs(corners[1:] - corner[:, None]).max(axis=2).min(axis=1)
               for corner in (b, c, b + c - apex)]  # fmt: skip
        rotations[follows & (np.max(gap, axis=0) <= 1e-9 * size[:-1])] = rotation
    able = np.flatnonzero(rotations >= 0)
    # Of a run in which each could be joined with the next, every other one is.
    start = np.concatenate([[True], np.diff(able) > 1])[: len(able)]
    rank = np.arange(len(able)) - np.maximum.accumulate(np.where(start, np.arange(len(able)), 0))
    first = able[rank % 2 == 0]
    return first, rotations[first]


def _with_open_sides(tracer: Tracer, lights: Polygons, explicit: np.ndarray) -> Polygons:
    """The lights, with ``front`` and ``back`` lowered for sides whose light meets only other lights, such as
    the inside of a glowing tube.

    Rays estimate that, and only the sampling of lights depends on it: the best probability of a light
    that is seen with probability V is in proportion to √V.
    """
    count = len(lights.color)
    rays = int(min(PROBES // max(2 * count, 1), MOST_PROBES))
    if rays < 2:
        return lights
    xi = np.tile(sobol(rays, 4, Stream.EMISSIVE_FACES), (count, 1))
    which = np.repeat(np.arange(count), rays)
    s, t = lights.coordinates(which, xi[:, 0], xi[:, 1])
    target = lights.origin[which] + s[:, None] * lights.u[which] + t[:, None] * lights.v[which]
    local = cosine_directions(xi[:, 2:])
    shares = []
    for side in (1, -1):
        normal = side * lights.normal[which]
        direction = np.einsum("ni,nij->nj", local, tangent_frames(normal))
        hits = tracer.intersect((target + 2 * OFFSET * normal).astype(np.float32),
                                np.ascontiguousarray(direction, np.float32))  # fmt: skip
        out = (hits.triangle < 0) | ~explicit[hits.triangle]
        shares.append(np.maximum(np.sqrt(out.reshape(count, rays).mean(axis=1)), HIDDEN))
    return replace(lights, front=shares[0], back=shares[1] * lights.two_sided)
