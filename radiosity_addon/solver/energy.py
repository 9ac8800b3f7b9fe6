"""Energy: where the light of a scene ends, followed from its lights.

Particles start at the lights in proportion to their power and are reflected until nearly nothing is
left (Shirley, Wade, Hubbard, Zareski, Walter, Greenberg 1995, Global illumination via density
estimation).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .geometry.triangles import OFFSET
from .lights.context import Context
from .lights.emissive_faces import as_polygons, emits_by_side
from .lights.facing_disks import FacingDisks
from .lights.flat_shapes import spread_falloff
from .lights.polygons import Polygons
from .lights.sky import pixel_directions, solid_angles
from .lights.suns import Suns
from .materials.emissive_parts import UNIT_TRIANGLE, join_parts, undivided
from .materials.region_means import triangle_regions
from .sampling.points import points_on
from .sampling.sobol import cosine_directions, sobol, tangent_frames, uniform
from .sampling.streams import Stream
from .tracing.embree import Hits

PARTICLES = 2048
MAX_BOUNCES = 64
FAINT = 0.01  # share [of all light] under way: less is shared out as the rest was
RADIUS = 0.9  # radius [unit box] of a sphere around everything


@dataclass(frozen=True)
class Particles:
    """n particles of light on their way. ``weight`` is power in normalized lengths."""

    origin: np.ndarray  # (n, 3) float32
    direction: np.ndarray  # (n, 3) float32 unit
    weight: np.ndarray  # (n, channels) float64

    def take(self, chosen: np.ndarray) -> Particles:
        """Some of them."""
        return Particles(self.origin[chosen], self.direction[chosen], self.weight[chosen])


def energy_balance(context: Context) -> dict:
    """Power [W], mean of the channels: ``emitted`` by lamps and emissive faces (exact) and brought
    onto surfaces by suns and sky; ``absorbed`` by surfaces; ``escaped``. The first is the sum of
    the others, which are uncertain by about 1/√PARTICLES of it. Lamps' links to objects and
    surfaces that cast no shadow are not looked at."""
    inside = _from_lights(context)
    outside = _from_afar(context)
    met = context.tracer.intersect(outside.origin, outside.direction).triangle >= 0
    particles = _join([inside, outside.take(np.flatnonzero(met))], context.channels)
    emitted = particles.weight.sum(axis=0)
    absorbed, escaped = _follow(context, particles)
    ended = absorbed + escaped
    watts = context.unit * context.geometry.scale**2 / context.channels
    share = np.divide(escaped, ended, out=np.zeros(len(ended)), where=ended > 0)
    lost = float(watts * (emitted * share).sum())
    total = float(watts * emitted.sum())
    return {"emitted": total, "absorbed": total - lost, "escaped": lost}


def _follow(context: Context, particles: Particles) -> tuple[np.ndarray, np.ndarray]:
    """(channels,) power absorbed and escaped. The little still under way at the end is in
    neither."""
    absorbed, escaped = np.zeros((2, context.channels))
    everything = particles.weight.sum()
    for bounce in range(MAX_BOUNCES):
        if particles.weight.sum() <= FAINT * everything:
            break
        hits = context.tracer.intersect(particles.origin, particles.direction)
        escaped += particles.weight[hits.triangle < 0].sum(axis=0)
        met = np.flatnonzero(hits.triangle >= 0)
        xi = uniform((len(met), 3), context.seed, Stream.PARTICLE_BOUNCES, bounce)
        particles, lost = _go_on(context, particles.take(met), hits, met, xi)
        absorbed += lost
    return absorbed, escaped


def _go_on(context: Context, particles: Particles, hits: Hits, met: np.ndarray, xi: np.ndarray):
    """The particles after they ``met`` (n,) the surface, reflected or let through by chance in
    proportion to either share, and the power (channels,) that stayed there."""
    triangle, front = hits.triangle[met], hits.front[met]
    uv = np.stack([hits.u[met], hits.v[met]], 1).astype(float)
    back = particles.weight * context.reflectance(triangle, uv, front)
    # What passes is seen from where it goes: from the other side.
    through = particles.weight * context.transmittance(triangle, uv, ~front)
    lost = np.maximum(particles.weight - back - through, 0).sum(axis=0)
    both = (back + through).mean(axis=1)
    chance = np.divide(back.mean(axis=1), both, out=np.ones(len(met)), where=both > 0)
    passes = xi[:, 0] >= chance
    chance = np.where(passes, 1 - chance, chance)
    weight = np.where(passes[:, None], through, back) / np.where(both > 0, chance, 1)[:, None]
    front = (front ^ passes)[None]
    points = points_on(context.geometry, triangle[None], uv[None, :, 0], uv[None, :, 1], front, xi)
    frames = tangent_frames(points.normal[0])
    reflected = np.einsum("ni,nij->nj", cosine_directions(xi[:, 1:]), frames)
    direction = np.where(passes[:, None], particles.direction, reflected)
    return _particles(points.position[0], direction, weight).take(both > 0), lost


def _from_lights(context: Context) -> Particles:
    """Particles of lamps and emissive faces; their weights add up to the lights' power."""
    batches = [batch for batch in context.sources.batches if not isinstance(batch, Suns)]
    batches.append(_unsampled_faces(context))
    powers = [batch.power for batch in batches]
    chosen, share, xi = _sample_lights(np.concatenate(powers), context.seed, Stream.PARTICLES_OF_LIGHTS)
    first, parts = 0, []
    for batch, power in zip(batches, powers):
        mine = (chosen >= first) & (chosen < first + len(power))
        which = chosen[mine] - first
        if isinstance(batch, FacingDisks):
            origin, direction, beam = batch.leave(which, xi[mine, 3:])
        else:
            origin, direction, beam = _leave_polygon(batch, which, xi[mine])
        parts.append(_particles(origin, direction, power[which] * (beam / share[mine])[:, None]))
        first += len(power)
    particles = _join(parts, context.channels)
    reached = particles.weight.sum(axis=0)
    exact = np.divide(sum(p.sum(axis=0) for p in powers), reached, where=reached > 0,
                      out=np.zeros(context.channels))
    return replace(particles, weight=particles.weight * exact)


def _from_afar(context: Context) -> Particles:
    """Particles of suns and sky, spread over a disk that covers the scene."""
    suns = [batch for batch in context.sources.batches if isinstance(batch, Suns)]
    toward = [batch.toward for batch in suns]
    light = [batch.color for batch in suns]
    if context.sky is not None:
        pixels = context.sky.pixels
        height, width = pixels.shape[:2]
        toward.append(pixel_directions(height, width).reshape(-1, 3))
        light.append(
            (pixels / np.pi * solid_angles(height, width)[:, None]).reshape(-1, context.channels)
        )
    if not light:
        return _join([], context.channels)
    power = np.pi * RADIUS**2 * np.concatenate(light)
    chosen, share, xi = _sample_lights(power, context.seed, Stream.PARTICLES_FROM_AFAR)
    toward = np.concatenate(toward)[chosen]
    if context.sky is not None and context.sky.constant:
        z = 2 * xi[:, 3] - 1
        azimuth, flat = 2 * np.pi * xi[:, 4], np.sqrt(1 - z**2)
        anywhere = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), z], 1)
        toward = np.where((chosen == len(power) - 1)[:, None], anywhere, toward)
    radius, azimuth = RADIUS * np.sqrt(xi[:, 1]), 2 * np.pi * xi[:, 2]
    disk = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), 0 * azimuth + RADIUS], 1)
    origin = np.einsum("ni,nij->nj", disk, tangent_frames(toward))
    return _particles(origin, -toward, power[chosen] / share[:, None])


def _sample_lights(power: np.ndarray, *key: int):
    """Lights (n,) int in proportion to the mean of their ``power`` (k, channels), how many
    particles each may expect, and numbers (n, 5) in [0, 1) of which the first is used up."""
    level = np.cumsum(power.mean(axis=1))
    if len(level) == 0 or level[-1] <= 0:
        return np.zeros(0, int), np.zeros(0), np.zeros((0, 5))
    xi = sobol(PARTICLES, 5, *key)
    chosen = np.searchsorted(level, xi[:, 0] * level[-1], "right")
    chosen = np.minimum(chosen, len(level) - 1)
    return chosen, PARTICLES * power.mean(axis=1)[chosen] / level[-1], xi


def _leave_polygon(batch: Polygons, which: np.ndarray, xi: np.ndarray):
    """Origins, directions and relative brightness of particles that leave flat lights."""
    s, t = batch.coordinates(which, xi[:, 1], xi[:, 2])
    side = np.where(batch.two_sided[which] & (xi[:, 3] < 0.5), -1.0, 1.0)
    level = np.where(batch.two_sided[which], 2 * xi[:, 3] % 1, xi[:, 3])
    widest = np.sin(np.minimum(batch.spread[which], np.pi) / 2) ** 2
    local = cosine_directions(np.stack([widest * level, xi[:, 4]], 1))
    beam = widest * spread_falloff(local[:, 2], batch.spread[which])
    normal = side[:, None] * batch.normal[which]
    origin = batch.origin[which] + s[:, None] * batch.u[which] + t[:, None] * batch.v[which]
    direction = np.einsum("ni,nij->nj", local, tangent_frames(normal))
    return origin + 2 * OFFSET * normal, direction, beam


def _unsampled_faces(context: Context) -> Polygons:
    """The emissive triangles that rays must find, as lights of their mean radiance."""
    scene, geometry = context.scene, context.geometry
    shows = ~context.explicit & context.glows
    if scene.visible is not None:
        shows &= scene.visible[scene.object]
    by_side, parts = emits_by_side(scene), []
    for side, triangles in ((1, np.flatnonzero(shows)), (-1, np.flatnonzero(shows & by_side))):
        whole = triangle_regions(triangles, np.repeat(UNIT_TRIANGLE, len(triangles), axis=0))
        radiance, _ = context.mean_emission(whole, side > 0)
        glowing = radiance.any(axis=1)
        cells = undivided(triangles[glowing], radiance[glowing])
        parts.append(replace(cells, side=np.where(by_side[cells.triangle], side, 0)))
    return as_polygons(geometry, join_parts(parts), scene.object)


def _particles(origin: np.ndarray, direction: np.ndarray, weight: np.ndarray) -> Particles:
    return Particles(
        np.ascontiguousarray(origin, np.float32),
        np.ascontiguousarray(direction, np.float32),
        weight,
    )


def _join(parts: list[Particles], channels: int) -> Particles:
    none = _particles(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, channels)))
    arrays = ("origin", "direction", "weight")
    return Particles(*(np.concatenate([getattr(p, a) for p in (none, *parts)]) for a in arrays))
