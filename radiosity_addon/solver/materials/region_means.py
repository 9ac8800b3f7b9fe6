"""Region means: the mean of a field over a part of a triangle, and how much it varies there.

What a light's cell sends out, what an element glows with and what a receiver reflects are such
means: exact ones, so that nothing in a picture falls between places that are looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..fields import Constant, CornerColors, Field, is_rescaled
from ..geometry.footprints import Footprints
from ..scene import Quantity, Scene
from .evaluate import evaluate_field
from .texture_integrals import THIN, TextureSums, sum_texture

SEEN = 2.0  # size [texels] of a region: the deviation in a smaller one is that of interpolated values at three corners
EVEN = 1e-4  # deviation [of the mean]: a smaller one counts as 0
SAME = 1e-6  # difference [of the mean] between an integral and the value in the middle: a smaller one is rounding


@dataclass(frozen=True)
class Regions:
    """n parts of triangles: places origin + s u + t v, barycentric, of all s and t in [0, 1] where
    ``square``, else of those with s + t <= 1."""

    triangle: np.ndarray  # (n,) int
    origin: np.ndarray  # (n, 2) float64
    u: np.ndarray  # (n, 2)
    v: np.ndarray  # (n, 2)
    square: bool

    def take(self, chosen: np.ndarray) -> Regions:
        """Some of them."""
        arrays = (self.triangle, self.origin, self.u, self.v)
        return Regions(*(array[chosen] for array in arrays), self.square)

    def middle(self) -> np.ndarray:
        """(n, 2) barycentric middles."""
        return self.origin + (self.u + self.v) / (2 if self.square else 3)


def triangle_regions(triangle: np.ndarray, corners: np.ndarray) -> Regions:
    """Triangles within triangles (n,), from their barycentric corners (n, 3, 2)."""
    corners = np.asarray(corners, float)
    first = corners[:, 0]
    return Regions(triangle, first, corners[:, 1] - first, corners[:, 2] - first, False)


def footprint_regions(footprints: Footprints, cells: np.ndarray, square: bool) -> Regions:
    """The regions that ``cells`` (n,) int of footprints are, all of them ``square`` or none."""
    corners = np.moveaxis(footprints.corners[cells].astype(float), 1, 0)
    return Regions(footprints.triangle[cells], *corners, square)


def footprint_means(mean_of: Callable[[Regions], np.ndarray], footprints: Footprints) -> np.ndarray:
    """(count, channels) means over footprints; ``mean_of(regions)`` gives those of their cells."""
    parts = []
    for square in (False, True):
        some = np.flatnonzero(footprints.square == square)
        parts.append((some, mean_of(footprint_regions(footprints, some, square))))
    cells = np.empty((len(footprints.triangle), parts[0][1].shape[1]))
    for some, means in parts:
        cells[some] = means
    return footprints.mean_of_cells(cells)


@dataclass(frozen=True)
class FieldMeans:
    """The means of one field."""

    field: Field

    @cached_property
    def _sums(self) -> TextureSums:
        return sum_texture(self.field)

    def __call__(self, regions: Regions) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) means, not below 0, over regions, and (n,) root mean square deviations from them,
        over the channels, too: of interpolated texels roughly, of others exactly."""
        if isinstance(self.field, Constant) or len(regions.triangle) == 0:
            return self._at(regions, regions.middle()), np.zeros(len(regions.triangle))
        if isinstance(self.field, CornerColors):
            return self._at(regions, regions.middle()), self._deviation(regions)
        return self._of_picture(regions)

    def _of_picture(self, regions: Regions) -> tuple[np.ndarray, np.ndarray]:
        """The means and deviations of a picture, by integrals where a region is wider than THIN texels."""
        corners = self.field.uv[regions.triangle].astype(float)
        first, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
        point = first + np.einsum("nc,ncd->nd", regions.origin, edges)
        u, v = (np.einsum("nc,ncd->nd", step, edges) for step in (regions.u, regions.v))
        texels = np.array(self.field.pixels.shape[1::-1])
        extent = np.maximum(np.abs(u * texels), np.abs(v * texels)).max(axis=1)
        found, deviation = self._at(regions, regions.middle()), np.zeros(len(u))
        some = np.flatnonzero(extent >= THIN)  # the others are points
        mean, square = np.split(
            self._sums.means(point[some], u[some], v[some], regions.square), [3], axis=1
        )
        deviation[some] = np.sqrt(np.maximum(square[:, 0] - (mean**2).mean(axis=1), 0))
        mean += self.field.offset
        if self.field.interpolation != "Closest":
            small = some[extent[some] < SEEN]
            deviation[small] = self._deviation(regions.take(small))
        deviation[deviation < EVEN * found.mean(axis=1)] = 0
        rounded = np.abs(mean - found[some]).max(axis=1) <= SAME * found[some].mean(axis=1)
        kept = some[(deviation[some] > 0) | ~rounded]
        found[kept] = np.maximum(mean, 0)[(deviation[some] > 0) | ~rounded]
        return found, deviation

    def _at(self, regions: Regions, point: np.ndarray) -> np.ndarray:
        return np.maximum(evaluate_field(self.field, regions.triangle, point), 0)

    def _deviation(self, regions: Regions) -> np.ndarray:
        """(n,) deviation of what is nearly linear, from the values at three corners, or of
        parallelograms from its two differences: variances (Σf² − (Σf)²/3) / 12, (a² + b²) / 12."""
        o, u, v = regions.origin, regions.u, regions.v
        a, b, c = (self._at(regions, point) for point in (o, o + u, o + v))
        if regions.square:
            variance = ((b - a) ** 2 + (c - a) ** 2) / 12
        else:
            variance = (a * a + b * b + c * c - (a + b + c) ** 2 / 3) / 12
        return np.sqrt(np.maximum(variance.mean(axis=1), 0))


def material_means(
    scene: Scene, quantity: Quantity, regions: Regions, front: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) means and (n,) deviations, as of ``FieldMeans``, of a quantity of the triangles' materials: on all
    fronts, or on all backs where not ``front``."""
    fields = [getattr(m if front else m.back or m, quantity) for m in scene.materials]
    constants = [f.value if isinstance(f, Constant) else (0, 0, 0) for f in fields]
    material, deviation = scene.material[regions.triangle], np.zeros(len(regions.triangle))
    mean = np.maximum(np.array(constants, float).reshape(-1, 3)[material], 0)
    varying = [i for i, f in enumerate(fields) if not isinstance(f, Constant)]
    for number in np.intersect1d(varying, np.unique(material)) if varying else ():
        some = np.flatnonzero(material == number)
        mean[some], deviation[some] = FieldMeans(fields[number])(regions.take(some))
    return mean, deviation


def reflectance_means(scene: Scene, regions: Regions, diffuse: np.ndarray) -> np.ndarray:
    """(n, 3) means of the reflectance over regions of fronts, given those of the ``diffuse`` reflectance (n, 3):
    where one picture gives both, it is integrated once."""
    mean, material = diffuse.copy(), scene.material[regions.triangle]
    glossy = [number for number, m in enumerate(scene.materials) if m.diffuse is not None]
    for number in np.intersect1d(glossy, np.unique(material)) if glossy else ():
        some = np.flatnonzero(material == number)
        shown, sent = scene.materials[number].diffuse, scene.materials[number].reflectance
        if is_rescaled(shown, sent):
            mean[some] = (diffuse[some] - shown.offset) / shown.factor * sent.factor + sent.offset
        else:
            mean[some], _ = FieldMeans(sent)(regions.take(some))
    return mean
