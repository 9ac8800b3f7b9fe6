"""Lamps and sky for the path tracer: one random place of each, and what it brings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from radiosity_addon.solver.scene import AreaLamp, Lamp, PointLamp, Sky, SunLamp

BEAM = np.radians(10)  # cone [rad]: a narrower spot is a beam
FAR = 10.0  # unit boxes: a segment this long has left the scene


def placed(lamps: tuple[Lamp, ...], center, scale) -> list[Lamp]:
    """The lamps that shine, where the scene is moved by ``-center`` and divided by ``scale``."""
    result = []
    for lamp in lamps:
        if isinstance(lamp, PointLamp):
            position, power = (lamp.position - center) / scale, np.asarray(lamp.intensity) / scale**2
            lamp = replace(lamp, position=position, radius=lamp.radius / scale, intensity=power)
        elif isinstance(lamp, AreaLamp):
            lamp = replace(lamp, center=(lamp.center - center) / scale,
                           u=np.asarray(lamp.u) / scale, v=np.asarray(lamp.v) / scale)  # fmt: skip
        result.append(lamp)
    return result


def chances(lamps: list[Lamp]) -> np.ndarray:
    """(n,) how often each is chosen: half of the time by a guess of its power, else evenly."""
    power = np.array([
        np.mean(lamp.irradiance) if isinstance(lamp, SunLamp)
        else np.mean(lamp.intensity) * 4 * np.pi if isinstance(lamp, PointLamp)
        else np.mean(lamp.radiance) * np.linalg.norm(np.cross(lamp.u, lamp.v)) * np.pi
        for lamp in lamps
    ])  # fmt: skip
    return 0.5 * power / (power.sum() or 1.0) + 0.5 / max(len(lamps), 1) if len(lamps) else power


def sample(lamp: Lamp, position, normal, random) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance (n, 3) that a random point of the lamp brings, unoccluded, and the segments (n, 3)
    to it; its mean over points is the lamp's irradiance."""
    s, t = random.random((2, len(position)))
    x, y = np.sqrt(s) * np.cos(2 * np.pi * t), np.sqrt(s) * np.sin(2 * np.pi * t)  # in a disk
    if isinstance(lamp, SunLamp):
        toward = -np.asarray(lamp.direction, float) / np.linalg.norm(lamp.direction)
        one, other = across(toward[None])
        way = toward + np.tan(lamp.angle / 2) * (x[:, None] * one + y[:, None] * other)
        way /= np.linalg.norm(way, axis=1)[:, None]
        return _dot(way, normal)[:, None] * lamp.irradiance, FAR * way
    if isinstance(lamp, AreaLamp):
        s, t = (x / 2, y / 2) if lamp.ellipse else (s - 0.5, t - 0.5)
        segment = lamp.center + s[:, None] * lamp.u + t[:, None] * lamp.v - position
        square = (segment**2).sum(axis=1)
        leaving = np.maximum(-segment @ lamp.normal / np.sqrt(square), 0)
        area = np.linalg.norm(np.cross(lamp.u, lamp.v)) * (np.pi / 4 if lamp.ellipse else 1)
        value = _dot(segment, normal) / np.sqrt(square) * leaving / square * area
        return (value * _spread(leaving, lamp.spread))[:, None] * lamp.radiance, segment
    segment, value = _of_point(lamp, position, normal, s, t, x, y)
    value *= _beam(lamp, segment) * _distribution(lamp, segment)
    return value[:, None] * lamp.intensity, segment


def _of_point(lamp: PointLamp, position, normal, s, t, x, y):
    """Segments to a random point of a point lamp, and irradiance for intensity 1, without beam."""
    toward = lamp.position - position
    square = (toward**2).sum(axis=1)
    unit = toward / np.sqrt(square)[:, None]
    one, other = across(unit)
    if lamp.sphere and lamp.radius > 0:  # directions in the cone under which a sphere is seen
        drop = 1 - np.sqrt(np.maximum(1 - lamp.radius**2 / square, 0))
        z, azimuth = 1 - drop * s, 2 * np.pi * t
        flat = np.sqrt(1 - z * z)
        way = z[:, None] * unit + (flat * np.cos(azimuth))[:, None] * one
        way += (flat * np.sin(azimuth))[:, None] * other
        along = (way * toward).sum(axis=1)
        to_sphere = along - np.sqrt(np.maximum(lamp.radius**2 - square + along**2, 0))
        return way * to_sphere[:, None], _dot(way, normal) * 2 * drop / lamp.radius**2
    segment = toward + lamp.radius * (x[:, None] * one + y[:, None] * other)
    away = (segment**2).sum(axis=1)  # the disk faces the point: its cosine is √(square / away)
    return segment, _dot(segment, normal) * np.sqrt(square) / away**2


def _beam(lamp: PointLamp, segment) -> np.ndarray:
    """Cycles' spot: a smoothstep of the cosine with the axis."""
    if lamp.axis is None:
        return np.ones(len(segment))
    edge = np.cos(min(lamp.cone, 2 * np.pi) / 2)
    cosine = -segment @ np.asarray(lamp.axis) / np.linalg.norm(segment, axis=1)
    step = np.clip((cosine - edge) / max((1 - edge) * lamp.blend, 1e-12), 0, 1)
    return step * step * (3 - 2 * step)


def is_beam(lamp: Lamp) -> bool:
    """A hard spot so narrow that paths which end on what it lights by chance are too rare."""
    spot = isinstance(lamp, PointLamp) and lamp.axis is not None and lamp.radius == 0
    return spot and lamp.cone < BEAM


def leave(lamp: PointLamp, count: int, random) -> tuple[np.ndarray, np.ndarray]:
    """Unit directions (count, 3), uniform in a spot's cone, and the power (count, 3) that each of
    them stands for: its mean is the lamp's."""
    edge = np.cos(lamp.cone / 2)
    z, azimuth = 1 - (1 - edge) * random.random(count), 2 * np.pi * random.random(count)
    flat, axis = np.sqrt(1 - z * z), np.asarray(lamp.axis, float)[None]
    one, other = across(axis)
    way = z[:, None] * axis + (flat * np.cos(azimuth))[:, None] * one
    way += (flat * np.sin(azimuth))[:, None] * other
    power = 2 * np.pi * (1 - edge) * _beam(lamp, -way) * _distribution(lamp, -way)
    return way, power[:, None] * lamp.intensity


def _distribution(lamp: PointLamp, segment) -> np.ndarray:
    """The share of its intensity with which the lamp shines against the segments: the picture's
    columns go round the sphere, its rows stop at the poles."""
    if lamp.distribution is None:
        return np.ones(len(segment))
    x, y, z = (-segment / np.linalg.norm(segment, axis=1)[:, None]).T
    height, width = lamp.distribution.shape
    around = np.pad(np.pad(lamp.distribution, ((0, 0), (1, 1)), "wrap"), ((1, 1), (0, 0)), "edge")
    latitude = height * (0.5 + np.arctan2(z, np.hypot(x, y)) / np.pi) + 0.5
    longitude = width * (np.pi - np.arctan2(y, x)) / (2 * np.pi) + 0.5
    return map_coordinates(around.astype(float), [latitude, longitude], order=1)


def _spread(cosine, spread: float) -> np.ndarray:
    """Cycles' area lamps: linear in the tangent, 0 at half the spread h. The same power as without:
    ∫ (tan h − tan θ) 2 sin θ cos θ dθ from 0 to h is tan h − h."""
    if spread >= np.pi:
        return np.ones(len(cosine))
    half = max(spread, 1e-3) / 2
    tangent = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.maximum(np.tan(half) - tangent, 0) / (np.tan(half) - half)


def across(unit) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (n, 3) across each of ``unit`` (n, 3) and one another."""
    helper = np.where(np.abs(unit[:, :1]) > 0.8, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    one = np.cross(unit, helper)
    one /= np.linalg.norm(one, axis=1)[:, None]
    return one, np.cross(unit, one)


def _dot(a, b) -> np.ndarray:
    """(n,) products of vectors, 0 where they are negative."""
    return np.maximum((a * b).sum(axis=1), 0)


class SkyImage:
    """The sky's pixels as they are; ``sampled`` where it is worth choosing pixels by brightness."""

    def __init__(self, sky: Sky | None):
        self.pixels = np.zeros((1, 1, 3)) if sky is None else np.asarray(sky.pixels, float)
        height, width = self.pixels.shape[:2]
        self.edge = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
        self.angle = np.repeat(np.diff(self.edge) * 2 * np.pi / width, width)
        power = self.pixels.mean(axis=2).ravel() * self.angle
        self.sampled = self.pixels.size > 3 and power.any()
        self.chance = power / (power.sum() or 1.0)

    def _index(self, way) -> np.ndarray:
        """(n,) the pixel that unit directions (n, 3) lie in."""
        height, width = self.pixels.shape[:2]
        u = 0.5 - np.arctan2(way[:, 1], way[:, 0]) / (2 * np.pi)
        v = 0.5 + np.arcsin(np.clip(way[:, 2], -1, 1)) / np.pi
        column = np.clip((u * width).astype(int), 0, width - 1)
        return np.clip((v * height).astype(int), 0, height - 1) * width + column

    def radiance(self, way) -> np.ndarray:
        """(n, 3)."""
        return self.pixels.reshape(-1, 3)[self._index(way)]

    def density(self, way) -> np.ndarray:
        """(n,) per steradian with which ``sample`` draws a direction; 0 where it is not used."""
        index = self._index(way)
        return self.chance[index] / self.angle[index] if self.sampled else np.zeros(len(way))

    def sample(self, count: int, random) -> tuple[np.ndarray, np.ndarray]:
        """Unit directions (count, 3), uniform within pixels chosen by power, and densities."""
        index = random.choice(len(self.chance), count, p=self.chance)
        row, column = np.divmod(index, self.pixels.shape[1])
        s, t = random.random((2, count))
        z = self.edge[row] + s * (self.edge[row + 1] - self.edge[row])
        phi, flat = 2 * np.pi * (0.5 - (column + t) / self.pixels.shape[1]), np.sqrt(1 - z * z)
        way = np.stack([flat * np.cos(phi), flat * np.sin(phi), z], 1)
        return way, self.chance[index] / self.angle[index]
