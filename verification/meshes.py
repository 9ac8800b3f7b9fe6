"""Scenes with known answers, built without Blender. Fronts face the light (rooms: inwards).

``exitance`` [W/m²] and ``reflectance`` are numbers, colors (3,), or one of either per part.
"""

from __future__ import annotations

import numpy as np

from radiosity_addon.solver.fields import Constant, CornerColors
from radiosity_addon.solver.receivers import Receivers
from radiosity_addon.solver.scene import Material, Scene

CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
# −x, +x, −y, +y, −z, +z: face f is opposite to f ^ 1; counter-clockwise from inside
BOX = np.array([[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]])


def box_polygons(size=(1, 1, 1), origin=(0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """Corners (6, 4, 3) and inward normals (6, 3) of a box's faces."""
    corners = CORNERS[BOX] * np.asarray(size, float) + np.asarray(origin, float)
    normals = np.repeat(np.eye(3), 2, axis=0)
    normals[1::2] *= -1
    return corners, normals


def grid(corners: np.ndarray, divisions: int) -> tuple[np.ndarray, np.ndarray]:
    """A quad (4, 3) cut into divisions² quads of two triangles: vertices (m, 3), triangles."""
    n = divisions + 1
    s, t = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    s, t = s.reshape(-1, 1), t.reshape(-1, 1)
    a, b, c, d = corners
    vertices = a * (1 - s) * (1 - t) + b * s * (1 - t) + c * s * t + d * (1 - s) * t
    first = (np.arange(divisions)[:, None] * n + np.arange(divisions)).ravel()
    lower = np.column_stack([first, first + 1, first + n + 1])
    upper = np.column_stack([first, first + n + 1, first + n])
    return vertices, np.stack([lower, upper], axis=1).reshape(-1, 3)


def polygon(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A convex polygon (n, 3) as a fan of triangles."""
    n = len(corners)
    fan = [(0, i, i + 1) for i in range(1, n - 1)]
    return np.asarray(corners, float), np.array(fan)


def disk(radius: float, z: float, up: bool, sides: int = 96) -> tuple[np.ndarray, np.ndarray]:
    """A regular polygon of the disk's area about the z axis, facing up or down."""
    outer = radius * np.sqrt(2 * np.pi / sides / np.sin(2 * np.pi / sides))
    angle = 2 * np.pi * np.arange(sides) / sides * (1 if up else -1)
    return polygon(np.column_stack([outer * np.cos(angle), outer * np.sin(angle), 0 * angle + z]))


def icosphere(level: int, radius: float = 1.0, inward: bool = False):
    """A subdivided icosahedron with 20 · 4^level triangles and the sphere's area."""
    g = (1 + np.sqrt(5)) / 2
    signs = [(i, j) for i in (-1, 1) for j in (-g, g)]
    vertices = np.array([p for i, j in signs for p in ((0, i, j), (i, j, 0), (j, 0, i))])
    triangles = _hull(vertices)
    for _ in range(level):
        vertices, triangles = subdivide(vertices, triangles)
    vertices = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices = vertices * np.sqrt(4 * np.pi / areas(vertices, triangles).sum()) * radius
    return vertices, triangles[:, ::-1] if inward else triangles


def _hull(vertices: np.ndarray) -> np.ndarray:
    """Triangles of the convex hull of points about the origin, facing outwards."""
    from scipy.spatial import ConvexHull

    triangles = ConvexHull(vertices).simplices
    volume = np.linalg.det(vertices[triangles])
    return np.where(volume[:, None] < 0, triangles[:, ::-1], triangles)


def subdivide(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Every triangle cut into four at its edges' middles, neighbors staying joined."""
    pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, index = np.unique(pairs, axis=0, return_inverse=True)
    middle = index.reshape(-1, 3) + len(vertices)
    a, b, c = triangles.T
    ab, bc, ca = middle.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return (
        np.concatenate([vertices, vertices[edges].mean(axis=1)]),
        np.concatenate([np.column_stack(part) for part in parts]),
    )


def areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(n,) of the triangles."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def blob(level: int = 4, radius: float = 0.3, center=(0.5, 0.5, 0.5)):
    """A closed bumpy head of a thing: dents and ears that see each other, like Suzanne."""
    vertices, triangles = icosphere(level)
    x, y, z = vertices.T
    bumps = 1 + 0.35 * np.sin(5 * x + 1) * np.sin(4 * y) * np.cos(3 * z)
    bumps += 0.15 * np.sin(9 * z + 2 * x)
    return vertices * (radius * bumps)[:, None] + center, triangles


def scene(parts, reflectance=0.5, exitance=0.0) -> Scene:
    """Parts (vertices, triangles) joined; each one object with one material of its own.

    Vertices at the very same place become one, so that walls of a room share their edges.
    """
    reflectances, exitances = _per_part(reflectance, len(parts)), _per_part(exitance, len(parts))
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    materials = tuple(
        Material(f"part {i}", Constant(rho), Constant(q / np.pi))
        for i, (rho, q) in enumerate(zip(reflectances, exitances))
    )
    joined = np.concatenate([t + o for (_, t), o in zip(parts, offsets)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    vertices, index = np.unique(vertices, axis=0, return_inverse=True)
    owner = np.repeat(np.arange(len(parts)), [len(t) for _, t in parts]).astype(np.int32)
    return Scene(
        vertices=vertices,
        triangles=index.ravel()[joined].astype(np.int32),
        material=owner,
        object=owner.copy(),
        materials=materials,
        objects=tuple(f"part {i}" for i in range(len(parts))),
    )


def _per_part(value, count: int) -> np.ndarray:
    """(count, 3) from a number, a color (3,), or one of either per part as (count, 1 or 3)."""
    return np.broadcast_to(np.asarray(value, float), (count, 3)).copy()


def box_scene(size=(1, 1, 1), divisions=1, reflectance=0.5, exitance=0.0) -> Scene:
    """A closed box, one part for each face in the order of BOX; values (6, 1) or (6, 3) or one."""
    corners, _ = box_polygons(size)
    return scene([grid(face, divisions) for face in corners], reflectance, exitance)


def furnace_scene(reflectance: float, level: int = 4, divisions: int = 1) -> Scene:
    """A blob in a closed unit box, everything emitting 1 − rho: B = 1 everywhere."""
    corners, _ = box_polygons()
    parts = [grid(face, divisions) for face in corners] + [blob(level)]
    return scene(parts, reflectance, 1.0 - reflectance)


def sphere_scene(level: int, reflectance=0.5, exitance=0.5) -> Scene:
    """The inside of a closed unit sphere; every octant one part, for values that differ."""
    vertices, triangles = icosphere(level, inward=True)
    middle = vertices[triangles].mean(axis=1)
    octant = (middle > 0) @ np.array([1, 2, 4])
    parts = [(vertices, triangles[octant == k]) for k in range(8)]
    return scene(parts, reflectance, exitance)


def concentric_scene(level: int, r1: float, r2: float, reflectance, exitance) -> Scene:
    """A sphere of radius r1, outside, within the inside of one of radius r2."""
    parts = [icosphere(level, r1), icosphere(level, r2, inward=True)]
    return scene(parts, np.reshape(reflectance, (-1, 1)), np.reshape(exitance, (-1, 1)))


def strips_scene(rho: float, length: float = 200.0, divisions: int = 1) -> Scene:
    """Two facing strips of width 1, gap 1, long in y, emitting 1: Sparrow's; open at the sides."""
    lower = np.array([[-0.5, 0, 0], [0.5, 0, 0], [0.5, 1, 0], [-0.5, 1, 0]], float)
    lower[:, 1] = (lower[:, 1] - 0.5) * length
    upper = lower[[0, 3, 2, 1]] + np.array([0.0, 0.0, 1.0])
    return scene([grid(lower, divisions), grid(upper, divisions)], rho, 1.0)


def wedge_scene(angle: float, length: float = 200.0, reflectance=0.5, exitance=1.0) -> Scene:
    """Two strips 1 wide that share an edge along y under ``angle``, their fronts facing."""
    y = length / 2
    far = np.array([np.cos(angle), 0, np.sin(angle)])
    lower = np.array([[0, -y, 0], [1, -y, 0], [1, y, 0], [0, y, 0]], float)
    upper = np.array([[0, -y, 0], [0, y, 0], far + [0, y, 0], far - [0, y, 0]])
    return scene([grid(lower, 1), grid(upper, 1)], reflectance, exitance)


def disks_scene(r1: float, r2: float, h: float, reflectance=0.5, exitance=1.0) -> Scene:
    """Coaxial disks facing each other: the first at z = 0 facing up, the second at z = h."""
    return scene([disk(r1, 0.0, True), disk(r2, h, False)], reflectance, exitance)


def manufactured_cube(radiosity, rho, divisions: int = 16) -> Scene:
    """A unit cube whose exact radiosity is constant on each face (6,): emission varies, is given
    at corners and linear between; that errs by O(divisions⁻²)."""
    from verification.exact import manufactured_emission

    corners, normals = box_polygons()
    base = box_scene(divisions=divisions, reflectance=np.reshape(rho, (-1, 1)))
    points = base.vertices[base.triangles].reshape(-1, 3)
    own = np.repeat(base.object, 3)
    inner = points + 1e-9 * (corners[own].mean(axis=1) - points)  # off the edges, in the face
    emission = manufactured_emission(inner, normals[own], own, np.asarray(radiosity),
                                     np.asarray(rho), corners)  # fmt: skip
    values = np.repeat(emission[:, None] / np.pi, 3, axis=1).reshape(-1, 3, 3).astype(np.float32)
    field = CornerColors(values)
    materials = tuple(Material(m.name, m.reflectance, field) for m in base.materials)
    return Scene(base.vertices, base.triangles, base.material, base.object, materials, base.objects)


def triangle_receivers(scene: Scene, divisions: int = 1) -> Receivers:
    """Every triangle cut into divisions² equal ones, one receiver each, in the triangles' order."""
    vertices, cells = np.array([[0, 0], [1, 0], [0, 1]], float), np.array([[0, 1, 2]])
    for _ in range(int(np.log2(divisions))):
        flat, cells = subdivide(np.column_stack([vertices, 0 * vertices[:, 0]]), cells)
        vertices = flat[:, :2]
    corners = vertices[cells]  # of the cells, (divisions², 3, 2)
    count = len(scene.triangles) * len(corners)
    return Receivers(
        count=count,
        receiver=np.arange(count, dtype=np.int32),
        triangle=np.repeat(np.arange(len(scene.triangles), dtype=np.int32), len(corners)),
        corners=np.tile(corners, (len(scene.triangles), 1, 1)),
        square=np.zeros(count, bool),
    )
