"""Skylight: radiance from infinitely far. Its small bright spots become lights.

Cosine-distributed rays that escape bring the sky's radiance. A spot much smaller than the sky and
much brighter than the rest (the sun in a photograph) would be met by few of them, so it is cut out
and sampled explicitly, pixel by pixel (``sky_spots``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.triangles import SURROUND
from ..scene import Sky
from .light_batch import Leaving
from .suns import through_the_scene

BRIGHT = 16.0  # radiance [of the mean]: brighter regions are spots
LARGEST = 0.2  # solid angle [sr]: larger bright regions are gathered like the rest
MOST_SPOTS = 16  # number [spots of a sky] that become lights, at most


@dataclass(frozen=True)
class Skylight:
    """``pixels`` (height, width, channels) float32 radiosity π·radiance."""

    pixels: np.ndarray

    @property
    def constant(self) -> bool:
        """The same radiance everywhere."""
        return self.pixels.shape[:2] == (1, 1)

    @property
    def color(self) -> np.ndarray:
        """(n_pixels, channels): irradiance by each pixel on a surface that faces it."""
        height, width, channels = self.pixels.shape
        return (self.pixels / np.pi * solid_angles(height, width)[:, None]).reshape(-1, channels)

    @property
    def power(self) -> np.ndarray:
        """(n_pixels, channels): what passes the scene, in normalized lengths."""
        return np.pi * SURROUND**2 * self.color

    def leave(self, which: np.ndarray, xi: np.ndarray) -> Leaving:
        """Particles from the middles of pixels ``which`` (n,); of a constant sky from anywhere. See
        ``LightBatch``."""
        toward = pixel_directions(*self.pixels.shape[:2]).reshape(-1, 3)[which]
        if self.constant:
            z, azimuth = 2 * xi[:, 0] - 1, 2 * np.pi * xi[:, 1]
            flat = np.sqrt(1 - z**2)
            toward = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], 1)
        return through_the_scene(toward, xi)

    def __call__(self, directions: np.ndarray) -> np.ndarray:
        """(n, channels) float32 radiosity from unit ``directions`` (n, 3), nearest pixel."""
        height, width = self.pixels.shape[:2]
        if self.constant:
            return np.broadcast_to(self.pixels[0, 0], (len(directions), self.pixels.shape[2]))
        x, y, z = directions.T
        u = 0.5 - np.arctan2(y, x) * np.float32(0.5 / np.pi)
        v = 0.5 + np.arctan2(z, np.hypot(x, y)) * np.float32(1 / np.pi)
        column = np.minimum((u * width).astype(np.int32), width - 1)
        row = np.minimum((v * height).astype(np.int32), height - 1)
        return self.pixels[row, column]


def pixel_directions(height: int, width: int) -> np.ndarray:
    """(height, width, 3) unit directions of the pixels' centers (see ``scene.Sky``)."""
    v = (np.arange(height) + 0.5) / height
    u = (np.arange(width) + 0.5) / width
    theta, phi = np.pi * (v - 0.5)[:, None], 2 * np.pi * (0.5 - u)[None]
    z = np.broadcast_to(np.sin(theta), (height, width))
    return np.stack([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), z], 2)


def solid_angles(height: int, width: int) -> np.ndarray:
    """(height, 1) steradians of one pixel in each row; they add up to 4π over the image."""
    edge = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    return (np.diff(edge) * 2 * np.pi / width)[:, None]


def split_sky(sky: Sky) -> tuple[np.ndarray, list[np.ndarray]]:
    """(height, width, 3) radiance without its bright spots, and what was taken out of it: for each
    spot the pixels' rows, columns, and radiance, (m, 5)."""
    from scipy import ndimage

    pixels = np.asarray(sky.pixels, np.float64)
    height, width = pixels.shape[:2]
    if height * width < 64:
        return pixels, []
    angle = np.broadcast_to(solid_angles(height, width), (height, width))
    brightness = pixels.mean(axis=2)
    typical = np.median(brightness[brightness > 0]) if np.any(brightness > 0) else 0.0
    mean = (brightness * angle).sum() / (4 * np.pi)
    limit = BRIGHT * min(mean, max(typical, mean / 64))
    labels, count = ndimage.label(brightness > max(limit, 1e-300))
    if count == 0:
        return pixels, []
    numbers = np.arange(1, count + 1)
    sizes = ndimage.sum_labels(angle, labels, numbers)
    power = ndimage.sum_labels(brightness * angle, labels, numbers)
    spots = [k for k in np.argsort(-power)[:MOST_SPOTS] if sizes[k] <= LARGEST]
    rest, found = pixels.copy(), []
    for k in spots:
        row, column = np.nonzero(labels == numbers[k])
        base = np.minimum(pixels[row, column], limit)
        found.append(np.column_stack([row, column, pixels[row, column] - base]))
        rest[row, column] = base
    return rest, found
