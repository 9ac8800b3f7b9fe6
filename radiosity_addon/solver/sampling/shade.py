"""Shade: how points count light that arrives there, where their normals are not the triangles'.

Rays start at the true surface and are hidden by it; light counts by the cosine to the shading
normal. Two corrections go with that, both for a single direction, as in Cycles: the terminator of a
coarse smooth mesh would show its faces, unless light that grazes them starts from the
rounded surface (Hanika 2021, "Hacking the Shadow Terminator"); and where maps turn a normal
toward light that grazes the surface, it fades out before it is hidden (Conty Estevez, Lecocq and
Stein 2019, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from ..geometry.cell_shading import CellShading

# Cosine [of an angle] to the true normal: below it light starts from the rounded surface.
GRAZING = 0.1


@dataclass(frozen=True)
class Shade:
    """How points (per, R), or (n,) of them flattened, count light."""

    true: np.ndarray  # (per, R, 3) float32 unit: the triangles' normals
    normal: np.ndarray  # (per, R, 3) float32 unit: light counts by the cosine to it,
    level: np.ndarray  # (per, R) float32: times this
    smooth: np.ndarray | None  # (per, R, 3) float32 unit: before maps; None: there are none
    height: np.ndarray  # (per, R) float32: of the rounded surface over the points

    def take(self, some: np.ndarray | slice) -> Shade:
        """The same of some owners, (k,) int or a slice."""
        return self._each(lambda array: array[:, some])

    def rows(self, some: np.ndarray | slice) -> Shade:
        """The same of some of the points (n,), flattened."""
        return self._each(lambda array: array[some])

    def together(self) -> Shade:
        """The same of all points (n,), in the order of (per, R) flattened."""
        return self._each(lambda array: array.reshape(-1, *array.shape[2:]))

    def single(self) -> Shade:
        """(1, n): every point an owner of its own."""
        return self._each(lambda array: array.reshape(1, -1, *array.shape[2:]))

    def share(self, directions: np.ndarray) -> np.ndarray:
        """(...) float32: what counts of light from ``directions`` (..., 3) above the shading
        normal's horizon, beside the cosine. Points and directions broadcast."""
        if self.smooth is None:
            return self.level
        length = np.sqrt(np.maximum(_dot(directions, directions), 1e-30))
        plain = _dot(self.smooth, directions) / length
        return self.level * fading(plain, _dot(self.normal, self.smooth))

    def share_of_rays(self, directions: np.ndarray) -> np.ndarray:
        """(rays · R, 1) the same for rays (rays, R, 3), cosine-distributed about the shading
        normal; 0 of those below the true surface's horizon."""
        per, count = self.level.shape
        split = directions.reshape(per, -1, count, 3)
        mine = self._each(lambda array: array[:, None])
        share = mine.share(split) * (_dot(mine.true, split) > 0)
        return share.reshape(-1, 1)

    def lifted(self, origins: np.ndarray, segments: np.ndarray) -> np.ndarray:
        """(n, 3) float32: ``origins``, or where the ``segments`` (n, 3) graze the true
        surface, places above them on the rounded one."""
        if not self.height.any():
            return origins
        up = self.normal if self.smooth is None else self.smooth
        length = GRAZING * np.sqrt(np.maximum(_dot(segments, segments), 1e-30))
        true, rounded = (_dot(normal, segments) / length for normal in (self.true, up))
        part = np.clip(np.where(rounded < 1, 2 - true - rounded, 1 - true), 0, 1)
        return origins + (part * self.height)[:, None] * up

    def _each(self, change: Callable[[np.ndarray], np.ndarray]) -> Shade:
        values = (getattr(self, field.name) for field in fields(self))
        return Shade(*(None if value is None else change(value) for value in values))


def shade_of_cells(
    shading: CellShading | None, true: np.ndarray, cell: np.ndarray, shape: tuple[int, int]
) -> Shade | None:
    """Of points (per, R) ``shape`` on cells (R,) or (per, R); ``true`` (n_cells, 3) are the
    triangles' normals. None where no cell is turned."""
    if shading is None or not shading.turned[cell].any():
        return None

    def repeated(values: np.ndarray) -> np.ndarray:
        return np.broadcast_to(np.take(values, cell, axis=0), shape + values.shape[1:])

    return Shade(
        repeated(true), repeated(shading.normal), repeated(shading.level),
        None if shading.smooth is None else repeated(shading.smooth), repeated(shading.height),
    )  # fmt: skip


def fading(plain: np.ndarray, between: np.ndarray) -> np.ndarray:
    """(...) share of light under the cosine ``plain`` to a normal before maps, which turn it by an
    angle of the cosine ``between``: Smith's masking 2 / (1 + √(1 + α² tan²θ)) of rough ground with
    α² = tan²d / 8 (Conty Estevez, Lecocq and Stein 2019)."""
    roughness = np.clip(0.125 * _tangent_square(between), 0, 1)
    share = 2 / (1 + np.sqrt(1 + roughness * _tangent_square(plain)))
    return np.where(plain > 0, share, 0).astype(np.float32)


def _tangent_square(cosine: np.ndarray) -> np.ndarray:
    square = np.clip(cosine * cosine, 1e-12, 1)
    return 1 / square - 1


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(...) products of (..., 3) that broadcast."""
    result = a[..., 0] * b[..., 0]
    result = result + a[..., 1] * b[..., 1]
    return result + a[..., 2] * b[..., 2]
