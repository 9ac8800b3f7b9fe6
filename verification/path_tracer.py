"""A plain path tracer: irradiance at points, with its standard error. The solver's oracle.

It shares no code with the solver and none of its ideas: no elements, no clusters, no smoothing, no
light tree; independent random paths, unbiased at every number of them. At each place a path is lit
by one lamp, one emissive triangle and one direction of the sky, and goes on in a cosine-distributed
direction; what both ways can find is weighted by the balance heuristic (Veach 1997, eq. 9.8), which
keeps the variance finite in corners. What narrow spots light is lit by particles that leave them, one
for each place: light that they bring reflected once. Surfaces that transmit reflect, or let the path straight on.
Lengths are scaled to a unit box, powers left as they are; float32 is Embree's alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from radiosity_addon.solver.fields import Constant
from radiosity_addon.solver.scene import Scene
from verification import path_tracer_lamps as lamps
from verification.path_tracer_fields import side_value

OFFSET = 1e-6  # of the scene: rays start so far above a surface, and end so far before one
LAYERS = 64  # surfaces that a shadow ray is followed through
SURVIVAL = 0.95  # at most: a path's chance to go on
BATCH = 16_384  # paths traced together


@dataclass(frozen=True)
class Irradiance:
    """Means over paths and their standard errors, (n, 3) float64 [W/m²] each: ``direct`` reaches
    the point without being reflected, ``indirect`` after reflections."""

    direct: np.ndarray
    direct_error: np.ndarray
    indirect: np.ndarray
    indirect_error: np.ndarray


def irradiance(
    scene: Scene, triangle, uv, paths: int, seed: int = 0, chance_only: bool = False
) -> Irradiance:
    """Irradiance of the fronts of ``triangle`` (n,) at barycentric ``uv`` (n, 2), from ``paths``
    for each point. With ``chance_only`` emissive faces and sky are met by chance alone: slower, and
    simpler still. Raises ValueError for scenes with objects that some rays do not meet."""
    world, random = World(scene), np.random.default_rng(seed)
    if chance_only:
        world.emitter[:], world.sky.sampled = 0, False
    triangle, uv = np.asarray(triangle), np.asarray(uv, float)
    count, done, sums = len(triangle), 0, np.zeros((4, len(triangle), 3))
    while done < paths:
        each = min(paths - done, max(BATCH // count, 1))
        own = np.repeat(np.arange(count), each)
        for k, light in enumerate(_trace(world, triangle[own], uv[own], random)):
            light = light.reshape(count, each, 3)
            sums[2 * k] += light.sum(axis=1)
            sums[2 * k + 1] += (light**2).sum(axis=1)
        done += each
    means = sums / paths
    errors = np.sqrt(np.maximum(means[1::2] - means[::2] ** 2, 0) / max(paths - 1, 1))
    return Irradiance(means[0], errors[0], means[2], errors[1])


class World:
    """The scene in a unit box, Embree's tree, and what may be sampled as a light."""

    def __init__(self, scene: Scene):
        if any(x is not None for x in (scene.casts_shadow, scene.visible, scene.lamp_objects,
                                       scene.lamp_blockers, scene.emission_objects,
                                       scene.emission_blockers)):  # fmt: skip
            raise ValueError(
                "the path tracer's objects meet all rays; leave casts_shadow, visible, "
                "lamp_objects and lamp_blockers of the scene None"
            )
        self.scene = scene
        low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
        self.center, self.scale = (low + high) / 2, np.ptp(scene.vertices, axis=0).max() / 2
        self.corners = ((scene.vertices - self.center) / self.scale)[scene.triangles]
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0],
                         self.corners[:, 2] - self.corners[:, 0])  # fmt: skip
        self.area = np.linalg.norm(cross, axis=1) / 2
        self.normal = cross / np.maximum(2 * self.area, 1e-300)[:, None]
        self.lamps = lamps.placed(scene.lamps, self.center, self.scale)
        self.lamp_chance = lamps.chances(self.lamps)
        self.beam = np.array([lamps.is_beam(lamp) for lamp in self.lamps], bool)
        self.sky = lamps.SkyImage(scene.sky)
        clear = [np.any(getattr(side.transmittance, "value", 1.0)) for m in scene.materials
                 for side in (m, m.back or m)]  # fmt: skip
        self.beam &= not any(clear)
        self.emitter = self._emitter_chances()
        self.embree = EmbreeScene()
        vertices = ((scene.vertices - self.center) / self.scale).astype(np.float32)
        self.mesh = TriangleMesh(self.embree, vertices, scene.triangles.astype(np.int32))

    def _emitter_chances(self) -> np.ndarray:
        """(n_triangles,) the chance to be sampled as a light: by area times radiance, looked at in
        64 places of both sides, and a twentieth by area alone, for what those places missed."""
        count, places = len(self.area), np.random.default_rng(1).random((64, 2))
        places[places.sum(axis=1) > 1] = 1 - places[places.sum(axis=1) > 1]
        every = np.repeat(np.arange(count), 64)
        found = sum(side_value(self.scene, "emission", every, np.tile(places, (count, 1)),
                               np.full(len(every), front)) for front in (True, False))  # fmt: skip
        bright = self.area * found.mean(axis=1).reshape(count, 64).mean(axis=1)
        sides = [[m, m.back or m] for m in self.scene.materials]
        glows = np.array([any(np.any(s.emission.value) if isinstance(s.emission, Constant) else True
                              for s in both) for both in sides])[self.scene.material]  # fmt: skip
        chance = np.where(glows, bright + 0.05 * bright.sum() * self.area / self.area.sum(), 0)
        return chance / (chance.sum() or 1.0)

    def at(self, triangle, uv) -> np.ndarray:
        """(n, 3) places."""
        a, b, c = (self.corners[triangle, k] for k in range(3))
        return a + uv[:, :1] * (b - a) + uv[:, 1:] * (c - a)

    def meet(self, origin, direction):
        """Triangle (n,), -1 for none; uv (n, 2); distance (n,) in lengths of ``direction``."""
        hit = self.embree.run(np.ascontiguousarray(origin, np.float32),
                              np.ascontiguousarray(direction, np.float32), output=True)  # fmt: skip
        uv = np.stack([hit["u"], hit["v"]], 1).astype(float)
        return hit["primID"].astype(int), uv, hit["tfar"].astype(float)

    def transmitted(self, origin, segment) -> np.ndarray:
        """(n, 3) share of light that comes along ``segment`` from its end to ``origin``."""
        share, start, left = np.ones(origin.shape), np.zeros(len(origin)), np.arange(len(origin))
        length = np.linalg.norm(segment, axis=1)
        for _ in range(LAYERS):
            if len(left) == 0:
                return share
            ray = segment[left]
            triangle, uv, step = self.meet(origin[left] + start[left, None] * ray, ray)
            met = np.flatnonzero((triangle >= 0) & (start[left] + step < 1))
            triangle, uv, step, left = triangle[met], uv[met], step[met], left[met]
            front = np.einsum("ni,ni->n", self.normal[triangle], segment[left]) < 0
            share[left] *= side_value(self.scene, "transmittance", triangle, uv, front)
            start[left] += step + 2 * OFFSET / length[left]
            left = left[share[left].max(axis=1) > 0]
        share[left] = 0
        return share


def _trace(world: World, triangle, uv, random) -> np.ndarray:
    """(2, n, 3) direct and indirect irradiance that one path brings to each of n points."""
    scene, light = world.scene, np.zeros((2, len(triangle), 3))
    path, depth = np.arange(len(triangle)), 0 * triangle
    carried = np.full((len(path), 3), np.pi)  # what a ray's radiance counts
    normal = world.normal[triangle]
    position = world.at(triangle, uv) + OFFSET * normal

    def add(some, values):
        light[np.minimum(depth[some], 1), path[some]] += values  # each path occurs once

    add(slice(None), carried / np.pi * _lit(world, position, normal, random, True))
    light[1] += carried / np.pi * _lit_by_beams(world, position, normal, random)
    direction = _cosine(normal, random)
    origin, slope = position, np.einsum("ni,ni->n", normal, direction)  # of where it was reflected
    while len(path):
        triangle, uv, _ = world.meet(position, direction)
        out = np.flatnonzero(triangle < 0)
        if len(out):
            share = _balance(slope[out] / np.pi, world.sky.density(direction[out]))
            add(out, carried[out] * world.sky.radiance(direction[out]) * share[:, None])
        on = np.flatnonzero(triangle >= 0)
        path, depth, carried, triangle, uv = (x[on] for x in (path, depth, carried, triangle, uv))
        origin, slope, direction = origin[on], slope[on], direction[on]
        cosine = np.einsum("ni,ni->n", world.normal[triangle], direction)
        front, met = cosine < 0, world.at(triangle, uv)
        normal = np.where(front[:, None], world.normal[triangle], -world.normal[triangle])
        share = _balance(slope / np.pi, _emitter_density(world, triangle, met - origin, cosine))[:, None]
        add(slice(None), carried * side_value(scene, "emission", triangle, uv, front) * share)
        carried, through, goes = _goes_on(scene, triangle, uv, front, carried, random)
        path, depth, carried, through = path[goes], depth[goes], carried[goes], through[goes]
        normal, met, origin, slope, direction = (x[goes] for x in (normal, met, origin, slope, direction))
        position = met + np.where(through, -OFFSET, OFFSET)[:, None] * normal
        back = np.flatnonzero(~through)
        depth[back] += 1
        arriving = _lit(world, position[back], normal[back], random, False)
        arriving += _lit_by_beams(world, position[back], normal[back], random)
        add(back, carried[back] / np.pi * arriving)
        direction[back], origin[back] = _cosine(normal[back], random), position[back]
        slope[back] = np.einsum("ni,ni->n", normal[back], direction[back])
    return light


def _emitter_density(world: World, triangle, segment, cosine) -> np.ndarray:
    """(n,) by solid angle, with which emissive triangles are sampled where ``segment`` (n, 3) ends."""
    density = world.emitter[triangle] / world.area[triangle]
    return density * ((segment**2).sum(axis=1) / np.maximum(np.abs(cosine), 1e-12))


def _goes_on(scene: Scene, triangle, uv, front, carried, random):
    """What paths carry (n, 3) when they go on from where they met the surface, by chance in proportion to
    what it reflects and lets through; (n,) bool: through it; and the numbers (k,) of those that go on."""
    rho, tau = (side_value(scene, name, triangle, uv, front) for name in ("reflectance", "transmittance"))
    both = rho.max(axis=1) + tau.max(axis=1)
    through = random.random(len(triangle)) * both < tau.max(axis=1)
    kept = np.where(through[:, None], tau, rho)
    chance = kept.max(axis=1) / np.maximum(both, 1e-300)
    survival = np.minimum(both, SURVIVAL)
    carried = carried * kept / np.maximum(chance * survival, 1e-300)[:, None]
    return carried, through, np.flatnonzero(random.random(len(triangle)) < survival)


def _lit(world: World, position, normal, random, beams: bool) -> np.ndarray:
    """(n, 3) irradiance of one lamp, one emissive triangle and one direction of the sky; with
    ``beams`` narrow spots are lamps, too."""
    total = np.zeros(position.shape)
    if world.lamps:
        chosen = random.choice(len(world.lamps), len(position), p=world.lamp_chance)
        for k in np.unique(chosen):
            some = np.flatnonzero(chosen == k)
            if world.beam[k] and not beams:
                continue
            value, segment = lamps.sample(world.lamps[k], position[some], normal[some], random)
            seen = value.max(axis=1) > 0
            value[seen] *= world.transmitted(position[some[seen]], segment[seen])
            total[some] += value / world.lamp_chance[k]
    if world.emitter.any():
        total += _lit_by_faces(world, position, normal, random)
    if world.sky.sampled:
        direction, density = world.sky.sample(len(position), random)
        slope = np.einsum("ni,ni->n", normal, direction)
        some = np.flatnonzero(slope > 0)
        share = slope[some] * _balance(density[some], slope[some] / np.pi) / density[some]
        seen = world.transmitted(position[some], lamps.FAR * direction[some])
        total[some] += world.sky.radiance(direction[some]) * seen * share[:, None]
    return total


def _lit_by_beams(world: World, position, normal, random) -> np.ndarray:
    """(n, 3) irradiance by one place that a narrow spot lights and that reflects its light."""
    total, numbers = np.zeros(position.shape), np.flatnonzero(world.beam)
    if len(numbers) == 0:
        return total
    chosen = numbers[random.integers(len(numbers), size=len(position))]
    for k in numbers:
        some, lamp = np.flatnonzero(chosen == k), world.lamps[k]
        way, power = lamps.leave(lamp, len(some), random)
        triangle, uv, _ = world.meet(np.repeat(lamp.position[None], len(some), axis=0), way)
        met = triangle >= 0
        some, way, power, triangle, uv = (x[met] for x in (some, way, power, triangle, uv))
        front = np.einsum("ni,ni->n", world.normal[triangle], way) < 0
        up = np.where(front[:, None], 1, -1) * world.normal[triangle]
        power = power * side_value(world.scene, "reflectance", triangle, uv, front)
        segment = world.at(triangle, uv) + 2 * OFFSET * up - position[some]
        square = np.maximum((segment**2).sum(axis=1), 1e-12)
        slope = np.maximum(np.einsum("ni,ni->n", normal[some], segment), 0)
        leaving = np.maximum(-np.einsum("ni,ni->n", up, segment), 0)
        value = power * (slope * leaving / square**2 / np.pi)[:, None]
        seen = value.max(axis=1) > 0
        value[seen] *= world.transmitted(position[some[seen]], segment[seen])
        total[some] += value * len(numbers)
    return total


def _lit_by_faces(world: World, position, normal, random) -> np.ndarray:
    """(n, 3) irradiance of a point of one emissive triangle."""
    chosen = random.choice(len(world.area), len(position), p=world.emitter)
    uv = random.random((len(position), 2))
    uv[uv.sum(axis=1) > 1] = 1 - uv[uv.sum(axis=1) > 1]
    segment = world.at(chosen, uv) - position
    square = np.maximum((segment**2).sum(axis=1), 1e-30)
    slope = np.einsum("ni,ni->n", normal, segment) / np.sqrt(square)
    leaving = -np.einsum("ni,ni->n", world.normal[chosen], segment) / np.sqrt(square)
    glow = side_value(world.scene, "emission", chosen, uv, leaving > 0)
    some = np.flatnonzero((slope > 0) & (np.abs(leaving) > 1e-9) & (glow.max(axis=1) > 0))
    side = np.where(leaving[some] > 0, 2 * OFFSET, -2 * OFFSET)[:, None]
    seen = world.transmitted(position[some], segment[some] + side * world.normal[chosen[some]])
    density = (world.emitter[chosen] / world.area[chosen])[some]
    density = density * square[some] / np.abs(leaving[some])
    share = slope[some] * _balance(density, slope[some] / np.pi) / density
    total = np.zeros(position.shape)
    total[some] = glow[some] * seen * share[:, None]
    return total


def _balance(used, other) -> np.ndarray:
    """The balance heuristic's weight of a sample drawn with density ``used``."""
    return used / np.maximum(used + other, 1e-300)


def _cosine(normal, random) -> np.ndarray:
    """(n, 3) unit directions, cosine-distributed about normals: a point on the sphere that stands
    on the surface."""
    z, azimuth = 2 * random.random(len(normal)) - 1, 2 * np.pi * random.random(len(normal))
    flat = np.sqrt(1 - z * z)
    direction = normal * (1 + 1e-9) + np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], 1)
    return direction / np.maximum(np.linalg.norm(direction, axis=1), 1e-12)[:, None]
