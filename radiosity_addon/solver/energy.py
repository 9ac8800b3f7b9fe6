"""Energy: where the light of a scene ends, followed from its lights.

Particles start at the lights in proportion to their power and are reflected until nearly nothing is
left (Shirley, Wade, Hubbard, Zareski, Walter, Greenberg 1995, Global illumination via density
estimation).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .array_struct import ArrayStruct
from .lights.context import Context
from .lights.emissive_faces import as_polygons, emits_by_side
from .lights.polygons import Polygons
from .materials.emissive_parts import UNIT_TRIANGLE, EmissiveParts, undivided
from .materials.region_means import triangle_regions
from .sampling.points import points_on
from .sampling.sobol import cosine_directions, sobol, tangent_frames, uniform
from .sampling.streams import Stream
from .tracing.embree import Hits

PARTICLES = 2048  # number [particles] that the near lights share, and so do the distant ones: shares are off by 1/√PARTICLES
MAX_BOUNCES = 64  # number [bounces] of a particle, at most
FAINT = 0.01  # share [of all light] still under way: at less, the rest is taken to end as what ended before did


@dataclass(frozen=True)
class Particles(ArrayStruct):
    """n particles of light on their way. ``weight`` is power in normalized lengths."""

    origin: np.ndarray  # (n, 3) float32
    direction: np.ndarray  # (n, 3) float32 unit
    weight: np.ndarray  # (n, channels) float64


def energy_balance(context: Context) -> dict:
    """Power [W], mean of the channels: ``emitted`` by lamps and emissive faces (exact) and brought
    onto surfaces by suns and sky; ``absorbed`` by surfaces; ``escaped``. The first is the sum of
    the others, which are uncertain by about 1/√PARTICLES of it. Lamps' links to objects and
    surfaces that cast no shadow are not looked at."""
    batches = context.sources.batches
    near = [*(batch for batch in batches if not batch.distant), _unsampled_faces(context)]
    distant = [*(batch for batch in batches if batch.distant), *(() if context.sky is None else (context.sky,))]
    inside = _with_exact_power(_emitted(context, near, Stream.PARTICLES_OF_LIGHTS), near)
    outside = _emitted(context, distant, Stream.PARTICLES_FROM_AFAR)
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
        particles, lost = _scattered(context, particles.take(met), hits, met, xi)
        absorbed += lost
    return absorbed, escaped


def _scattered(
    context: Context, particles: Particles, hits: Hits, met: np.ndarray, xi: np.ndarray
) -> tuple[Particles, np.ndarray]:
    """The ``particles`` (n,) that hit the surface, ``met`` (n,) int of all ``hits``, reflected or transmitted by
    chance in proportion to either share, by ``xi`` (n, 3) in [0, 1); and the power (channels,) absorbed there."""
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


def _with_exact_power(particles: Particles, emitters: list) -> Particles:
    """With weights that add up to the power of all ``emitters``, exactly."""
    reached = particles.weight.sum(axis=0)
    exact = sum((emitter.power.sum(axis=0) for emitter in emitters), np.zeros(len(reached)))
    factor = np.divide(exact, reached, out=np.zeros(len(reached)), where=reached > 0)
    return replace(particles, weight=particles.weight * factor)


def _emitted(context: Context, emitters: list, key: int) -> Particles:
    """Particles of all lights of ``emitters``: they have ``color``, ``power`` and ``leave`` of a
    ``LightBatch``."""
    powers = [emitter.power for emitter in emitters]
    cumulative = np.cumsum(np.concatenate([np.zeros((0, context.channels)), *powers]).mean(axis=1))
    if len(cumulative) == 0 or cumulative[-1] <= 0:
        return _join([], context.channels)
    xi = sobol(PARTICLES, 5, context.seed, key)
    light = np.minimum(np.searchsorted(cumulative, xi[:, 0] * cumulative[-1], "right"), len(cumulative) - 1)
    first, parts = 0, []
    for emitter, power in zip(emitters, powers):
        mine = (light >= first) & (light < first + len(power))
        which = light[mine] - first
        number = PARTICLES * power.mean(axis=1)[which] / cumulative[-1]  # expected of each light
        left = emitter.leave(which, xi[mine][:, [3, 4, 1, 2]])
        weight = emitter.color[which] * (left.power / number)[:, None]
        parts.append(_particles(left.origin, left.direction, weight))
        first += len(power)
    return _join(parts, context.channels)


def _unsampled_faces(context: Context) -> Polygons:
    """The emissive triangles that rays must find, as lights of their mean radiance."""
    scene, geometry = context.scene, context.geometry
    shows = ~context.explicit & context.glows
    if scene.visible is not None:
        shows &= scene.visible[scene.object]
    by_side, parts = emits_by_side(scene), []
    for side, triangles in ((1, np.flatnonzero(shows)), (-1, np.flatnonzero(shows & by_side))):
        regions = triangle_regions(triangles, np.repeat(UNIT_TRIANGLE, len(triangles), axis=0))
        radiance, _ = context.mean_emission(regions, side > 0)
        glowing = radiance.any(axis=1)
        cells = undivided(triangles[glowing], radiance[glowing])
        parts.append(replace(cells, side=np.where(by_side[cells.triangle], side, 0)))
    return as_polygons(geometry, EmissiveParts.join(parts), scene.object)


def _particles(origin: np.ndarray, direction: np.ndarray, weight: np.ndarray) -> Particles:
    return Particles(
        np.ascontiguousarray(origin, np.float32),
        np.ascontiguousarray(direction, np.float32),
        weight,
    )


def _join(parts: list[Particles], channels: int) -> Particles:
    none = _particles(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, channels)))
    return Particles.join([none, *parts])
