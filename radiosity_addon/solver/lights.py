"""Lights: everything that is sampled explicitly, as one of three shapes.

Depends on ``scene``, ``geometry``, ``lambert``. A light gives, at points: the irradiance that
would arrive without obstacles, and rays that test whether it does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .evaluate import evaluate_material
from .fields import Constant
from .geometry import OFFSET, Geometry
from .lambert import polygon_form_factor
from .scene import AreaLamp, PointLamp, Scene, SunLamp

MAX_EMISSIVE_TRIANGLES = 256  # more than these are left to gathered rays


@dataclass(frozen=True)
class Sample:
    """One sampled point of a light for each of n points.

    ``segment`` (n, 3) float32 runs to the sample, ``length`` limits it (inf: a sun). Where
    ``exact``, ``irradiance`` is the whole light's, without noise, and is to be multiplied by the
    visible share of ``weight`` over an owner's points; else it is this sample's alone.
    """

    irradiance: np.ndarray  # (n,) float64, unoccluded, per unit of the light's colour
    weight: np.ndarray  # (n,) float64, the integrand at the sample
    segment: np.ndarray
    length: float
    exact: bool


@dataclass(frozen=True)
class PolygonLight:
    """A flat light of constant radiance: origin + s·u + t·v as a triangle, rectangle or ellipse."""

    color: np.ndarray  # (3,) radiance
    shape: str  # "triangle", "rectangle" or "ellipse"
    origin: np.ndarray  # (3,) normalised; of an ellipse the corner of its bounding parallelogram
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray  # (3,) unit
    two_sided: bool
    spread: float = np.pi
    objects: np.ndarray | None = None

    def outline(self) -> np.ndarray:
        """(k, 3) convex polygon; an ellipse becomes 48 corners of the same area."""
        if self.shape == "triangle":
            return np.stack([self.origin, self.origin + self.u, self.origin + self.v])
        if self.shape == "rectangle":
            far = self.origin + self.u + self.v
            return np.stack([self.origin, self.origin + self.u, far, self.origin + self.v])
        turn = (np.arange(48) + 0.5) * (2 * np.pi / 48)
        radius = 0.5 * np.sqrt(2 * np.pi / 48 / np.sin(2 * np.pi / 48))
        s, t = 0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)
        return self.origin + s[:, None] * self.u + t[:, None] * self.v

    def sample(self, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample uniformly by area; the weight is the form factor's integrand."""
        s, t = self._place(xi)
        target = self.origin + s[:, None] * self.u + t[:, None] * self.v
        away = position - target
        side = away @ self.normal
        lift = np.where(side >= 0, OFFSET, -OFFSET)[:, None] * self.normal
        segment = target + lift - position
        square = np.einsum("ij,ij->i", segment, segment)
        cosine = np.einsum("ij,ij->i", segment, normal)
        weight = np.maximum(cosine, 0) * np.abs(side) / np.maximum(square, 1e-30) ** 2
        factor = np.pi * polygon_form_factor(position, normal, self.outline())
        if not self.two_sided:
            weight = np.where(side > 0, weight, 0)
            factor = np.where(side > 0, factor, 0)
        if self.spread < np.pi:
            beam = spread_falloff(side / np.sqrt(np.maximum(square, 1e-30)), self.spread)
            area = np.linalg.norm(np.cross(self.u, self.v))
            area *= {"triangle": 0.5, "rectangle": 1.0, "ellipse": np.pi / 4}[self.shape]
            factor = weight * beam * area
            return Sample(factor, (factor > 0) * 1.0, segment.astype(np.float32), 1.0, False)
        weight = np.where(factor > 0, weight, 0)
        return Sample(factor, weight, segment.astype(np.float32), 1.0, True)

    def _place(self, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if self.shape == "rectangle":
            return xi[:, 0], xi[:, 1]
        if self.shape == "triangle":
            fold = xi.sum(axis=1) > 1
            return np.where(fold, 1 - xi[:, 0], xi[:, 0]), np.where(fold, 1 - xi[:, 1], xi[:, 1])
        radius, turn = 0.5 * np.sqrt(xi[:, 0]), 2 * np.pi * xi[:, 1]
        return 0.5 + radius * np.cos(turn), 0.5 + radius * np.sin(turn)


def spread_falloff(cosine: np.ndarray, spread: float) -> np.ndarray:
    """Cycles' beam of an area lamp: linear in the tangent, zero at half the spread, normalised
    so that the lamp's power does not depend on it."""
    half = max(spread, 1e-3) / 2
    tangent = np.tan(half)
    normalise = 1 / (tangent - half) if tangent - half > 1e-9 else 3 / tangent**3
    ray = np.sqrt(np.maximum(1 / np.maximum(cosine, 1e-9) ** 2 - 1, 0))
    return np.maximum((tangent - ray) * normalise, 0)


@dataclass(frozen=True)
class SphereLight:
    """A point or spot lamp: ``color`` radiant intensity [W/sr] in normalised lengths."""

    color: np.ndarray
    position: np.ndarray
    radius: float
    axis: np.ndarray | None
    cone: float
    blend: float
    objects: np.ndarray | None = None

    def sample(self, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample the disc that faces the point; the whole sphere's irradiance is I cosθ / r²."""
        toward = self.position - position
        distance = np.sqrt(np.maximum(np.einsum("ij,ij->i", toward, toward), 1e-30))
        unit = toward / distance[:, None]
        cosine = np.maximum(np.einsum("ij,ij->i", unit, normal), 0)
        irradiance = cosine / distance**2 * self._beam(unit)
        segment = toward
        if self.radius > 0:
            helper = np.where(np.abs(unit[:, :1]) > 0.7, [[0.0, 1, 0]], [[1.0, 0, 0]])
            across = np.cross(unit, helper)
            across /= np.linalg.norm(across, axis=1)[:, None]
            up = np.cross(unit, across)
            radius, turn = self.radius * np.sqrt(xi[:, :1]), 2 * np.pi * xi[:, 1:]
            segment = toward + radius * (np.cos(turn) * across + np.sin(turn) * up)
        return Sample(irradiance, (irradiance > 0) * 1.0, segment.astype(np.float32), 1.0, False)

    def _beam(self, unit: np.ndarray) -> np.ndarray | float:
        """Cycles' spot: a smoothstep between the cone's edge and its blended inside."""
        if self.axis is None:
            return 1.0
        edge = np.cos(self.cone / 2)
        cosine = -(unit @ self.axis)
        smooth = (1 - edge) * self.blend
        t = np.clip((cosine - edge) / max(smooth, 1e-9), 0, 1)
        return t * t * (3 - 2 * t)


@dataclass(frozen=True)
class SunLight:
    """A distant disc: ``color`` its irradiance on a surface that faces it."""

    color: np.ndarray
    toward: np.ndarray  # (3,) unit, to the sun
    radius: float  # tangent of its half angle
    objects: np.ndarray | None = None

    def sample(self, position: np.ndarray, normal: np.ndarray, xi: np.ndarray) -> Sample:
        """Sample a direction in the disc."""
        helper = np.eye(3)[np.argmin(np.abs(self.toward))]
        across = np.cross(self.toward, helper)
        across /= np.linalg.norm(across)
        up = np.cross(self.toward, across)
        radius, turn = self.radius * np.sqrt(xi[:, :1]), 2 * np.pi * xi[:, 1:]
        direction = self.toward + radius * (np.cos(turn) * across + np.sin(turn) * up)
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        cosine = np.maximum(np.einsum("ij,ij->i", direction, normal), 0)
        return Sample(cosine, (cosine > 0) * 1.0, direction.astype(np.float32), np.inf, False)


def emissive_triangles(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Triangles whose emission is a constant above zero, (k,) int and (k, 3) radiance: those to
    sample explicitly. Empty where there are too many; rays then find them by themselves."""
    constant = np.array(
        [isinstance(m.emission, Constant) and np.any(m.emission.value) for m in scene.materials],
        bool,
    )
    chosen = np.flatnonzero(constant[scene.material]) if len(scene.material) else np.zeros(0, int)
    if scene.visible is not None:
        chosen = chosen[scene.visible[scene.object[chosen]]]
    if len(chosen) > MAX_EMISSIVE_TRIANGLES:
        chosen = chosen[:0]
    middle = np.full((len(chosen), 2), 1 / 3)
    return chosen, evaluate_material(scene, "emission", chosen, middle)


def build_lights(scene: Scene, geometry: Geometry) -> list:
    """Every explicit light, in normalised lengths: emissive polygons first, then the lamps."""
    triangles, radiance = emissive_triangles(scene)
    lights = _emissive_polygons(geometry, triangles, radiance)
    linked = scene.lamp_objects or (None,) * len(scene.lamps)
    for lamp, objects in zip(scene.lamps, linked):
        lights.append(_lamp_light(lamp, geometry, objects))
    return [light for light in lights if np.any(light.color > 0)]


def _emissive_polygons(geometry: Geometry, triangles: np.ndarray, radiance: np.ndarray) -> list:
    """Triangles as lights; two that form a parallelogram become one rectangle."""
    lights, used = [], set()
    position = {int(t): i for i, t in enumerate(triangles)}
    for i, t in enumerate(triangles):
        if i in used or geometry.area[t] <= 0:
            continue
        partner = position.get(int(t) + 1)
        corners = geometry.vertices[geometry.triangles[t]]
        joined = None
        if partner is not None and np.array_equal(radiance[i], radiance[partner]):
            joined = _parallelogram(corners, geometry.vertices[geometry.triangles[t + 1]])
        if joined is not None:
            used.add(partner)
        origin, u, v = joined if joined is not None else (
            corners[0], corners[1] - corners[0], corners[2] - corners[0]
        )
        shape = "rectangle" if joined is not None else "triangle"
        lights.append(
            PolygonLight(radiance[i], shape, origin, u, v, geometry.normal[t], two_sided=True)
        )
    return lights


def _parallelogram(first: np.ndarray, second: np.ndarray):
    """(origin, u, v) if two triangles (3, 3) make up a parallelogram, else None."""
    size = np.abs(first - first[0]).max()
    for turn in range(3):
        apex, b, c = np.roll(first, -turn, axis=0)
        far = b + c - apex
        gap = [np.abs(second - corner).max(axis=1).min() for corner in (b, c, far)]
        if max(gap) <= 1e-9 * size:
            return apex, b - apex, c - apex
    return None


def _lamp_light(lamp, geometry: Geometry, objects: np.ndarray | None):
    if isinstance(lamp, SunLamp):
        toward = -np.asarray(lamp.direction, float)
        toward = toward / np.linalg.norm(toward)
        return SunLight(np.asarray(lamp.irradiance, float), toward, np.tan(lamp.angle / 2), objects)
    if isinstance(lamp, PointLamp):
        return SphereLight(
            np.asarray(lamp.intensity, float) / geometry.scale**2,
            geometry.normalised(lamp.position),
            lamp.radius / geometry.scale,
            None if lamp.axis is None else np.asarray(lamp.axis, float),
            lamp.cone,
            lamp.blend,
            objects,
        )
    if isinstance(lamp, AreaLamp):
        u, v = np.asarray(lamp.u, float) / geometry.scale, np.asarray(lamp.v, float) / geometry.scale
        origin = geometry.normalised(lamp.center) - (u + v) / 2
        shape = "ellipse" if lamp.ellipse else "rectangle"
        normal = np.asarray(lamp.normal, float)
        color = np.asarray(lamp.radiance, float)
        return PolygonLight(color, shape, origin, u, v, normal, False, lamp.spread, objects)
    raise TypeError(f"unknown lamp {type(lamp).__name__}")
