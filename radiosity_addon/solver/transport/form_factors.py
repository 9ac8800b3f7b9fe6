"""Form factors between patches, each with its standard error: for teaching, research and tests.

The solver itself does not need it: its elements make rows of their own (``rows``).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import OFFSET, Geometry, build_geometry
from ..sampling.sobol import cosine_directions, tangent_frames
from ..sampling.sobol_set import BITS, SobolSet
from ..sampling.streams import Stream
from ..scene import Scene
from ..tracing.embree import Tracer
from ..workers.parallel import map_chunks

BLOCK = 1 << 16  # number [rays] at a time
SHRINK = 1e-4  # share [of a triangle] that points leave out at its edges, so that they do not start beyond a wall there
DIMENSIONS = 5  # number [random numbers of a ray]: which triangle, where in it (2), direction (2)


@dataclass(frozen=True)
class _Patch:
    """The triangles of one patch, to be chosen by area."""

    triangles: np.ndarray  # (k,) int
    cumulative: np.ndarray  # (k,) share of the area up to and with each; the last is 1


def patch_form_factors(
    scene: Scene, patch: np.ndarray, rays: int, replicates: int = 8, seed: int = 0, threads: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """F and its standard error, (n_patches, n_patches) float64 each, between patches.

    ``patch`` (n_triangles,) int: the patch of each triangle, from 0 on. F_ij = 1/A_i ∫_i ∫_j K V
    is the share of the cosine-distributed rays from the fronts of patch i that meet patch j first,
    on either side; what is missing to a row's sum of 1 leaves the scene. Every triangle blocks.

    ``rays`` (a power of two) leave every patch in each of ``replicates`` independently scrambled
    Sobol sets (Owen 1995) of five dimensions; the replicates' scatter is the standard error.
    Raises ValueError for labels that do not fit, patches without area, and numbers out of range.

    From a square to the one a unit above it it is 0.19982 (Howell's catalog, C-11).

    >>> from radiosity_addon.solver.scene import WHITE, Material
    >>> square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    >>> corners = np.concatenate([square, square[::-1] + (0, 0, 1)])  # they face each other
    >>> triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.int32)
    >>> patch, none = np.array([0, 0, 1, 1]), np.zeros(4, np.int32)
    >>> scene = Scene(corners, triangles, none, none, (Material("White", WHITE),), ("Squares",))
    >>> factors, deviation = patch_form_factors(scene, patch, 4096, threads=1)
    >>> off = np.abs(factors - [[0, 0.19982], [0.19982, 0]])
    >>> bool((off <= 4 * deviation).all()), bool(deviation.max() < 2e-3)
    (True, True)
    """
    patch = np.asarray(patch)
    _check(scene, patch, rays, replicates)
    geometry = build_geometry(scene.vertices, scene.triangles)
    tracer = Tracer(geometry.vertices, geometry.triangles)
    patches = [_patch(geometry, patch, number) for number in range(int(patch.max()) + 1)]
    count = len(patches)
    labels = np.append(patch, count)  # a miss has the triangle -1

    def work(chunk: tuple[int, int]) -> np.ndarray:
        number, replicate = chunk
        found = np.zeros(count + 1)
        for xi in _blocks(rays, (seed, Stream.FORM_FACTORS, number, replicate)):
            met = _first_met(geometry, tracer, patches[number], xi)
            found += np.bincount(labels[met], minlength=count + 1)
        return found[:count] / rays

    chunks = [(number, replicate) for number in range(count) for replicate in range(replicates)]
    rows = map_chunks(work, chunks, threads)
    every = np.array(rows).reshape(count, replicates, count)
    return every.mean(axis=1), every.std(axis=1, ddof=1) / np.sqrt(replicates)


def _check(scene: Scene, patch: np.ndarray, rays: int, replicates: int) -> None:
    if patch.shape != (len(scene.triangles),) or not np.issubdtype(patch.dtype, np.integer):
        raise ValueError(
            f"patch is {patch.dtype} {patch.shape}; give one integer for each of the scene's "
            f"{len(scene.triangles)} triangles"
        )
    if len(patch) == 0 or patch.min() < 0:
        raise ValueError("patch labels start at 0 and there must be one; give every triangle one")
    if rays < 1 or rays & (rays - 1):
        raise ValueError(f"rays is {rays}; it must be a power of two, as Sobol sets want")
    if replicates < 2:
        raise ValueError(f"replicates is {replicates}; at least 2 are needed to tell the error")


def _patch(geometry: Geometry, patch: np.ndarray, number: int) -> _Patch:
    triangles = np.flatnonzero((patch == number) & (geometry.area > 0))
    cumulative = np.cumsum(geometry.area[triangles])
    if len(triangles) == 0 or not cumulative[-1] > 0:
        raise ValueError(f"patch {number} has no area; number the patches without gaps from 0")
    return _Patch(triangles, cumulative / cumulative[-1])


def _blocks(rays: int, key: tuple[int, ...]) -> Iterator[np.ndarray]:
    """Yield the scrambled Sobol set of this key, (n, 5) float64 in [0, 1), n <= BLOCK at a time."""
    generator = np.random.default_rng(np.random.SeedSequence(key))
    points = SobolSet(DIMENSIONS, generator)
    for first in range(0, rays, BLOCK):
        yield points.points(first, min(rays, BLOCK)) * 2.0**-BITS


def _first_met(geometry: Geometry, tracer: Tracer, patch: _Patch, xi: np.ndarray) -> np.ndarray:
    """(n,) int: the triangles that rays from the front of a patch meet first, -1 for none."""
    triangle, surface = _places(geometry, patch, xi)
    normal = geometry.normal[triangle]
    lifted = surface + OFFSET * normal
    origins = lifted.astype(np.float32)
    local = cosine_directions(xi[:, 3:])
    directions = np.einsum("nk,nkc->nc", local, tangent_frames(normal))
    met = tracer.intersect(origins, np.ascontiguousarray(directions, np.float32)).triangle
    below = tracer.intersect(origins, (-normal).astype(np.float32))
    near = (below.triangle >= 0) & (below.triangle != triangle) & (below.distance < 2 * OFFSET)
    crossed = near & _between(geometry, below.triangle, surface, lifted)
    return np.where(crossed, below.triangle, met)


def _between(
    geometry: Geometry, other: np.ndarray, surface: np.ndarray, lifted: np.ndarray
) -> np.ndarray:
    """(n,) bool: the plane of triangle ``other`` passes between the surface and where its ray
    starts, above it: in a narrow wedge or gap that triangle is all the point sees."""
    normal, corner = geometry.normal[other], geometry.p0[other]
    height = np.einsum("nc,nc->n", surface - corner, normal)
    return (np.abs(height) > 1e-12) & (height * np.einsum("nc,nc->n", lifted - corner, normal) < 0)


def _places(geometry: Geometry, patch: _Patch, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (n,) int and positions (n, 3) float64 uniform over a patch."""
    index = np.searchsorted(patch.cumulative, xi[:, 0], "right")
    triangle = patch.triangles[np.minimum(index, len(patch.triangles) - 1)]
    root = np.sqrt(xi[:, 1])  # uniform in a triangle: Turk 1990, Generating Random Points
    uv = np.stack([root * (1 - xi[:, 2]), root * xi[:, 2]], 1) * (1 - SHRINK) + SHRINK / 3
    return triangle, geometry.at(triangle, uv)
