"""Border samples: points on seams where what both sides show is asked for. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..solver.array_struct import ArrayStruct
from ..solver.geometry.planar import doubled_areas
from ..solver.geometry.segments import Segments
from ..solver.ragged import ragged_ranges
from .continuations import Parts, Seams, face_normals_of, into_faces
from .faces import triangle_areas
from .islands import Charted, Edges
from .shown import Sheets, Stencils

SPACING = 0.5  # distance [texels] of two samples along a border, at most
MOST = 1 << 14  # number [samples of one edge], at most
ASIDE = 1.0  # distance [texels] from a seam to where a segment over it begins
DEEP = 0.5  # distance [of a triangle's height over the seam]: such a segment begins no farther


@dataclass(frozen=True)
class SeamSamples(ArrayStruct):
    """Points (k,) on seams, as the picture shows them from both sides; ``weight`` is the length [texels] of the seam
    that each stands for."""

    one: Stencils
    other: Stencils
    weight: np.ndarray  # (k,) float64
    across: Segments  # (k,) from a little to one side to a little to the other
    triangle: np.ndarray  # (k, 2) int: of one side and of the other


def sample_seams(charted: Charted, edges: Edges, seams: Seams, sheets: Sheets) -> SeamSamples:
    """Points along the ``seams`` between border ``edges``."""
    sides = seams.one, seams.other
    lengths = np.stack([_texels_along(charted, edges, part) for part in sides])
    owner, fraction, weight = _spread_evenly(lengths.max(0))
    stencils, beside, up, triangle = [], [], [], []
    for part in sides:
        own = edges.take(part.edge[owner])
        along = part.along[owner]
        along = (along[:, 0] + fraction * (along[:, 1] - along[:, 0]))[:, None]
        start, end = own.ends(charted.uv)
        stencils.append(sheets.stencils(charted.sheet[own.triangle], start + along * (end - start)))
        start, end = own.ends(charted.vertices[charted.triangles])
        beside.append(start + along * (end - start) + _aside(charted, own))
        up.append(face_normals_of(charted, own.triangle))
        triangle.append(own.triangle)
    across = Segments(beside[0], up[0], beside[1], up[1])
    return SeamSamples(*stencils, weight, across, np.stack(triangle, 1))


def _spread_evenly(length: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(owner, fraction, weight): points along lines of so many texels (k,), in the middles of equal
    parts."""
    count = np.clip(np.ceil(length / SPACING), 1, MOST).astype(int)
    owner, number = ragged_ranges(count)
    return owner, (number + 0.5) / count[owner], length[owner] / count[owner]


def _texels_along(charted: Charted, edges: Edges, part: Parts) -> np.ndarray:
    start, end = edges.take(part.edge).ends(charted.uv)
    return np.linalg.norm(end - start, axis=1) * np.abs(part.along[:, 1] - part.along[:, 0])


def _aside(charted: Charted, edges: Edges) -> np.ndarray:
    """(m, 3) steps from the edges into their faces, ASIDE texels long."""
    area = 2 * triangle_areas(charted.vertices, charted.triangles[edges.triangle])
    texels = np.abs(doubled_areas(charted.uv[edges.triangle]))
    start, end = edges.ends(charted.vertices[charted.triangles])
    height = area / np.maximum(np.linalg.norm(end - start, axis=1), 1e-300)
    far = np.minimum(ASIDE * np.sqrt(area / np.maximum(texels, 1e-300)), DEEP * height)
    return far[:, None] * into_faces(charted, edges)
