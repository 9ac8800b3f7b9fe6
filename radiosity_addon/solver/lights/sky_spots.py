"""Sky spots: bright spots of a panorama as lights of their true shape, that is of their pixels.

A direction is drawn in proportion to the radiance there: first a row of the spot, then a pixel in
that row, then a place in the pixel's rectangle of longitude and sine of latitude, in which equal
areas are equal solid angles. Each sample is unbiased by itself, below the horizon as above it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.vectors import dot
from ..sampling.points import Middles
from .light_batch import Sample, Unoccluded
from .sky import pixel_directions, solid_angles
from .suns import Suns

WIDEST = 0.2  # angle [rad] from a spot's middle: wider spots are cut into several lights


@dataclass(frozen=True)
class SkySpots(Suns):
    """``color`` is the irradiance where all of the spot stands above; ``toward`` its middle,
    ``radius`` the tangent of the angle up to which it reaches around it.

    Light k has the rows ``rows[k]:rows[k + 1]``, row r the pixels ``pixels[r]:pixels[r + 1]``.
    """

    shape: tuple[int, int]  # height and width of the panorama
    rows: np.ndarray  # (k + 1,) int
    pixels: np.ndarray  # (n_rows + 1,) int
    row: np.ndarray  # (n_pixels,) int, in the panorama
    column: np.ndarray  # (n_pixels,) int
    tint: np.ndarray | None  # (n_pixels, 3) color over the light's, in proportion; None: all alike
    sums: np.ndarray  # (n_pixels + 1,) float64: flux of the pixels before, mean of the channels

    def sample(
        self, which: int | np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
    ) -> Sample:
        """Sample a direction in the spot."""
        direction, pixel = self.directions(which, xi[:, 0], xi[:, 1])
        cosine = np.maximum(dot(direction, np.asarray(normal, float).T), 0)
        segment = np.ascontiguousarray(direction.T, np.float32)
        tint = None if self.tint is None else self.tint[pixel, : self.color.shape[1]]
        return Sample(cosine, segment, np.inf, None, tint=tint)

    def directions(
        self, which: int | np.ndarray, s: np.ndarray, t: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Unit directions (3, n) in spots ``which``, one or (n,), and the pixels (n,) they are in,
        for places (s, t) (n,) in the unit square."""
        first, last = (np.broadcast_to(self.rows[which + k], s.shape) for k in (0, 1))
        row, s = _drawn(self.sums[self.pixels], first, last, s)
        pixel, t = _drawn(self.sums, self.pixels[row], self.pixels[row + 1], t)
        height, width = self.shape
        low, high = (np.sin(np.pi * ((self.row[pixel] + k) / height - 0.5)) for k in (0, 1))
        z = low + s * (high - low)
        flat = np.sqrt(np.maximum(1 - z * z, 0))
        azimuth = 2 * np.pi * (0.5 - (self.column[pixel] + t) / width)
        return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z]), pixel

    def unoccluded(self, which: int, middles: Middles) -> Unoccluded:
        """Known, to be none, where all of the spot is below the horizon."""
        height = self.toward[which] @ middles.normal
        dark = middles.flat & (height < -np.sin(np.arctan(self.radius[which])))
        return Unoccluded(np.zeros(len(dark)), dark, None, None, np.inf)


def _drawn(
    sums: np.ndarray, first: np.ndarray, last: np.ndarray, xi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One of the entries ``first`` to before ``last`` (n,), in proportion to the steps of ``sums``,
    and what is left of ``xi`` (n,): again uniform in [0, 1)."""
    target = sums[first] + xi * (sums[last] - sums[first])
    found = np.clip(np.searchsorted(sums, target, "right") - 1, first, last - 1)
    step = sums[found + 1] - sums[found]
    rest = (target - sums[found]) / np.where(step > 0, step, 1)
    return found, np.clip(rest, 0, 1)


def sky_spots(shape: tuple[int, int], spots: list[np.ndarray]) -> SkySpots | None:
    """The lights of spots, each the rows, columns and radiance (m, 5) of its pixels; None of
    none."""
    parts = [part for spot in spots for part in _compact(shape, spot)]
    if not parts:
        return None
    color, toward, radius = zip(*(_figures(shape, part) for part in parts))
    every = np.concatenate(parts)
    row, column = every[:, 0].astype(int), every[:, 1].astype(int)
    light = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    begins = (np.diff(row, prepend=-1) != 0) | (np.diff(light, prepend=-1) != 0)
    pixels = np.flatnonzero(begins)
    rows = np.searchsorted(light[pixels], np.arange(len(parts) + 1))
    brightness = every[:, 2:].mean(axis=1)
    sums = np.cumsum(brightness * solid_angles(*shape)[row, 0])
    color = np.array(color)
    tint = every[:, 2:] / brightness[:, None]
    usual = color / color.mean(axis=1, keepdims=True)
    tint = np.divide(tint, usual[light], out=np.zeros_like(tint), where=usual[light] > 0)
    tint = None if np.allclose(tint[usual[light] > 0], 1, rtol=1e-6) else tint
    return SkySpots(
        color, np.array(toward), np.array(radius), shape, rows, np.append(pixels, len(row)), row,
        column, tint, np.concatenate([[0.0], sums]),
    )


def _compact(shape: tuple[int, int], spot: np.ndarray) -> list[np.ndarray]:
    """A spot's pixels (m, 5), in order of rows and columns, in parts none of which reaches too far
    from its middle."""
    spot = spot[spot[:, 2:].max(axis=1) > 0]
    waiting, done = [spot] if len(spot) else [], []
    while waiting:
        part = waiting.pop()
        if len(part) == 1 or _figures(shape, part)[2] <= np.tan(WIDEST):
            done.append(part[np.lexsort((part[:, 1], part[:, 0]))])
            continue
        toward = pixel_directions(*shape)[part[:, 0].astype(int), part[:, 1].astype(int)]
        axis = np.argmax(np.ptp(toward, axis=0))
        order = np.argsort(toward[:, axis], kind="stable")
        waiting += [part[order[: len(part) // 2]], part[order[len(part) // 2 :]]]
    return done


def _figures(shape: tuple[int, int], part: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Irradiance (3,) by pixels (m, 5) if all stood above, the unit direction (3,) of their
    middle, and the tangent of the angle they reach from it."""
    row, column = part[:, 0].astype(int), part[:, 1].astype(int)
    flux = part[:, 2:] * solid_angles(*shape)[row]
    corners = np.concatenate([_corner(shape, row + i, column + j) for i in (0, 1) for j in (0, 1)])
    toward = np.tile(flux.mean(axis=1), 4) @ corners
    toward = toward / max(np.linalg.norm(toward), 1e-300)
    angle = np.arccos(np.clip((corners @ toward).min(), -1, 1))
    return flux.sum(axis=0), toward, np.tan(min(angle, 1.5))


def _corner(shape: tuple[int, int], row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """(n, 3) unit directions of pixels' corners."""
    latitude, azimuth = np.pi * (row / shape[0] - 0.5), 2 * np.pi * (0.5 - column / shape[1])
    flat = np.cos(latitude)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(latitude)], 1)
