"""Geometry: the triangles centered and scaled to a unit box, with normals and areas.

Everything after this works in normalized lengths; radiosity does not depend on the unit of length,
and lamp intensities are rescaled where they enter (``lights``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..expected import Refused
from ..scene import Scene
from .thin_triangles import edge_shrink

# Height [unit box] of rays' origins over the surface. Embree's own self-hits stop between 1e-7 and 5e-7;
# float32 cannot show narrower gaps anyway.
OFFSET = 5e-7
SURROUND = 0.9  # radius [unit box] of a sphere around everything
SMALLEST, LARGEST = 1e-100, 1e100  # extents [scene's length]: powers of them must be numbers, too
# Edge [unit box] of a face: rays of a smaller one start too far off it, by OFFSET, for its size.
SMALL = 8 * OFFSET
# Extent [unit box] of an object: rays of a smaller one start more than a thirtieth of its size off it.
SMALL_OBJECT = 32 * OFFSET
NAMED = 3  # number [objects] that a warning names, at most
ROUGH = 1e-4  # step [of a scene's extent] between 32-bit vertices: where it is larger, the scene's shape is lost


@dataclass(frozen=True)
class Geometry:
    """Triangles p0 + u·e1 + v·e2 in the unit box. ``scale`` takes lengths back to the scene's."""

    vertices: np.ndarray  # (n_vertices, 3) float64 within [-0.5, 0.5]
    triangles: np.ndarray  # (n, 3) int32
    p0: np.ndarray  # (n, 3) float64
    e1: np.ndarray  # (n, 3)
    e2: np.ndarray  # (n, 3)
    normal: np.ndarray  # (n, 3) unit; zero where the area is
    area: np.ndarray  # (n,) normalized
    shrink: np.ndarray  # (n,) share of it that points keep away from its edges
    scale: float  # scene length of one normalized unit
    center: np.ndarray  # (3,) scene position of the normalized origin

    def normalized(self, positions: np.ndarray) -> np.ndarray:
        """Scene positions (..., 3) in normalized coordinates."""
        return (np.asarray(positions, float) - self.center) / self.scale

    def at(self, triangle: np.ndarray, uv: np.ndarray) -> np.ndarray:
        """Positions of barycentric ``uv`` (..., 2) on ``triangle`` (...)."""
        return (
            self.p0[triangle]
            + uv[..., :1] * self.e1[triangle]
            + uv[..., 1:] * self.e2[triangle]
        )


def build_geometry(vertices: np.ndarray, triangles: np.ndarray) -> Geometry:
    """Normalize. Raises Refused for a scene too small or too large for its numbers, ValueError for
    vertices that are not finite and triangles out of range: no caller may give them."""
    vertices = np.asarray(vertices, np.float64).reshape(-1, 3)
    triangles = np.asarray(triangles, np.int32).reshape(-1, 3)
    if len(triangles) and not (0 <= triangles.min() <= triangles.max() < len(vertices)):
        raise ValueError("triangles name vertices that do not exist")
    used = vertices[np.unique(triangles)] if len(triangles) else np.zeros((1, 3))
    if not np.isfinite(used).all():
        raise ValueError("a vertex is not finite; leave such faces out of the scene")
    low, high = used.min(axis=0), used.max(axis=0)
    center = low / 2 + high / 2
    scale = float(max((high / 2 - low / 2).max() * 2, np.finfo(float).tiny * 1e16))
    if len(triangles) and not SMALLEST < scale < LARGEST:
        raise Refused(
            f"the scene is {scale:.3g} units across; that must lie between {SMALLEST:g} and "
            f"{LARGEST:g}: apply a scale"
        )
    inside = np.zeros(len(vertices), bool)
    inside[triangles.ravel()] = True
    unit = np.where(inside[:, None], (vertices - center) / scale, 0.0)
    p0, p1, p2 = (unit[triangles[:, k]] for k in range(3))
    e1, e2 = p1 - p0, p2 - p0
    cross = np.cross(e1, e2)
    length = np.linalg.norm(cross, axis=1)
    normal = cross / np.where(length > 0, length, 1)[:, None]
    shrink = edge_shrink(triangles, p0, e1, e2, OFFSET)
    return Geometry(unit, triangles, p0, e1, e2, normal, length / 2, shrink, scale, center)


def rounding_warning(scene: Scene, geometry: Geometry) -> str | None:
    """A warning where rounding may lose the scene's shape: its vertices are 32-bit numbers too far from the origin for
    its size, or half of its faces, or some of its objects, are too small for its size. Else None."""
    return (
        _far_from_origin(scene.vertices, geometry)
        or _small_faces(geometry)
        or _small_objects(scene, geometry)
    )


def _far_from_origin(vertices: np.ndarray, geometry: Geometry) -> str | None:
    used = np.asarray(vertices, np.float64)[np.unique(geometry.triangles)]
    with np.errstate(over="ignore", under="ignore"):
        single = used.astype(np.float32)
    if len(used) == 0 or not np.array_equal(single, used):
        return None
    step = float(np.spacing(np.abs(single).max()))
    if step <= ROUGH * geometry.scale:
        return None
    return (
        f"the scene is {geometry.scale:.3g} units across and lies {np.abs(used).max():.3g} from "
        f"the origin, where 32-bit vertices are rounded to {step:.2g}: its shape may be lost; "
        "model it at the origin"
    )


def _small_faces(geometry: Geometry) -> str | None:
    edges = np.maximum((geometry.e1**2).sum(axis=1), (geometry.e2**2).sum(axis=1))
    middle = float(np.sqrt(np.median(edges))) if len(edges) else 1.0
    if middle >= SMALL:
        return None
    return (
        f"the scene is {geometry.scale:.3g} units across and half of its faces are smaller than "
        f"{middle * geometry.scale:.2g}: the light near faces that small is not accurate; bake what lies far "
        "apart separately"
    )


def _small_objects(scene: Scene, geometry: Geometry) -> str | None:
    low = np.full((len(scene.objects), 3), np.inf)
    high = -low
    corners = geometry.vertices[geometry.triangles]
    np.minimum.at(low, scene.object, corners.min(axis=1))
    np.maximum.at(high, scene.object, corners.max(axis=1))
    extent = (high - low).max(axis=1)  # -inf of objects without a face
    some = np.flatnonzero((extent > 0) & (extent < SMALL_OBJECT))
    if len(some) == 0:
        return None
    names = ", ".join(f'"{scene.objects[i]}"' for i in some[:NAMED])
    more = f" and {len(some) - NAMED} more" if len(some) > NAMED else ""
    return (
        f"the scene is {geometry.scale:.3g} units across, and {names}{more} less than "
        f"{SMALL_OBJECT * geometry.scale:.2g}: the light near objects that small is not accurate; bring what lies "
        "far away nearer (a dome for the sky can be much smaller), or bake without it"
    )
