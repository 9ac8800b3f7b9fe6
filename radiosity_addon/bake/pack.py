"""Packing: the charts of several meshes laid out side by side in one image, by Blender. bpy.

Blender packs what is in one mesh, so the meshes are joined for it. Lengths are in heights of the
image: it is 1 high and width / height wide. A speck in the image's upper right corner tells Blender
its proportions, as it packs into the box around all charts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .seams import face_areas
from .uv_edit import Shape, edit_uvs

SPECK = 1e-5  # edge [heights] of the speck
ROUNDING = 1e-5  # distance [heights] by which Blender's numbers may lie outside
SHAPE = "AABB"  # what of a chart keeps others out; by outlines Blender takes minutes, for no gain


@dataclass(frozen=True)
class Chart:
    """The charts of one mesh, of any size and place."""

    shape: Shape
    uv: np.ndarray  # (n_loops, 2)
    factor: float = 1.0  # of the texel density


@dataclass(frozen=True)
class Packed:
    """Where the charts lie."""

    uvs: list[np.ndarray]  # (n_loops, 2) float32 of each mesh
    extent: tuple[float, float]  # width and height [texels] that they take
    density: float  # texels per meter, where the factor is 1


def pack(
    charts: list[Chart], size: tuple[int, int], gap: float, density: float | None = None
) -> Packed:
    """Lay charts out ``gap`` texels apart in an image of this width and height, all with the same
    texels per meter times their factors: ``density``, by which they may not fit, or as many as fit.
    """
    width, height = size
    shape, uv = _joined(charts)
    uv = edit_uvs(shape, uv, _even)[0]
    uv = uv - uv.min(0)
    if density is None:
        uv /= 2 * max(float(uv[:, 0].max()) * height / width, float(uv[:, 1].max()), 1e-30)
        box = 1.0
    else:
        uv *= density / (height * max(_density(shape, uv), 1e-30))
        box = max(1.0, float(uv[:, 0].max()) * height / width, float(uv[:, 1].max()))
    corner = np.array([width / height, 1.0]) * box
    speck = corner - SPECK * np.array([(0, 0), (1, 0), (0, 1)])
    margin = gap / 2 / height
    uv = edit_uvs(
        _with_speck(shape), np.concatenate([uv, speck]), lambda: _pack(margin, density is None)
    )[0][:-3]
    reached = _density(shape, uv) * height
    used = (uv.max(0) + margin) * height
    uv = (uv * np.array([height / width, 1.0])).astype(np.float32)
    if used[0] <= width + ROUNDING * height and used[1] <= height + ROUNDING * height:
        uv = np.clip(uv, 0.0, 1.0)
    stops = np.cumsum([len(chart.uv) for chart in charts])[:-1]
    return Packed(np.split(uv, stops), (float(used[0]), float(used[1])), reached)


def area_of(chart: Chart) -> float:
    """The surface [m²] of the mesh, times the square of its factor: its share of an image."""
    return float(face_areas(chart.shape.points, chart.shape.corner, chart.shape.start).sum()) * (
        chart.factor**2
    )


def _joined(charts: list[Chart]) -> tuple[Shape, np.ndarray]:
    """One mesh of all, each as large as its factor says."""
    vertices = np.cumsum([0, *(len(chart.shape.points) for chart in charts)])
    loops = np.cumsum([0, *(len(chart.shape.corner) for chart in charts)])
    shapes = [chart.shape for chart in charts]
    shape = Shape(
        np.concatenate([chart.shape.points * chart.factor for chart in charts]),
        np.concatenate([part.corner + first for part, first in zip(shapes, vertices)]),
        np.concatenate([part.start + first for part, first in zip(shapes, loops)]),
    )
    return shape, np.concatenate([chart.uv for chart in charts]).astype(np.float32)


def _with_speck(shape: Shape) -> Shape:
    points, loops = len(shape.points), len(shape.corner)
    return Shape(
        np.concatenate([shape.points, np.eye(3)]),
        np.concatenate([shape.corner, points + np.arange(3)]),
        np.append(shape.start, loops),
    )


def _density(shape: Shape, uv: np.ndarray) -> float:
    """Lengths in UVs per meter, in the mean over the surface."""
    flat = np.concatenate([uv, np.zeros((len(uv), 1))], 1)
    surface = face_areas(shape.points, shape.corner, shape.start).sum()
    taken = face_areas(flat, np.arange(len(uv)), shape.start).sum()
    return float(np.sqrt(taken / surface)) if surface > 0 else 0.0


def _even() -> None:
    import bpy

    bpy.ops.uv.average_islands_scale()


def _pack(margin: float, fill: bool) -> None:
    import bpy

    bpy.ops.uv.pack_islands(
        udim_source="ORIGINAL_AABB", rotate=True, rotate_method="CARDINAL", scale=fill,
        merge_overlap=False, margin_method="FRACTION" if fill else "ADD", margin=margin,
        shape_method=SHAPE,
    )  # fmt: skip
