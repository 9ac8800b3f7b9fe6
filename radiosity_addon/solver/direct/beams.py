"""Beams: spots whose light falls on so little of the surface that points spread over it may all miss it.

Particles that leave the lamps find what they light. It shines as a flat light of its own, so that what
a beam's reflection lights is sampled as other direct light is, and no ray has to find a dot.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..geometry.vectors import tangents
from ..lights.context import Context
from ..lights.flat_shapes import ELLIPSE
from ..lights.light_batch import Leaving, LightBatch
from ..lights.polygons import Polygons, lamp_polygons
from ..sampling.sobol import sobol
from ..sampling.streams import Stream
from ..tracing.embree import Hits
from .transmission import followed

TRIAL = 64  # number [particles of each spot] that find how much of the surface it lights
NARROW = 2e-3  # share [of all surface]: a spot that lights less is a beam
LANDED = 0.25  # share [of a spot's particles] that must land on surfaces: with fewer, the lit area is not known
STEEPEST = 0.05  # cosine [of incidence], at least, that the lit area is computed with
PARTICLES = 4096  # number [particles of each beam]
FAINT = 0.01  # share [of a beam's reflection]: planes that reflect less are left out
ALIKE = 1e4  # steps [per 1] that normals and heights are rounded to: places where they agree lie in one plane
SMALLEST = 1e-5  # half axis [unit box] of an ellipse, at least


@dataclass(frozen=True)
class Split:
    """One scene under some of its lights. ``rest``: all lights but the beams. ``beams``: the beams alone. ``spots``:
    the flat lights made of the beams' first reflection; None where there are none. ``reflected``: the rest and the
    spots, which light what rays meet."""

    rest: Context
    beams: Context | None
    spots: Context | None
    reflected: Context


def split_beams(context: Context) -> Split:
    """The scene of a context with its beams apart."""
    beams = find_beams(context)
    if len(beams) == 0:
        return Split(context, None, None, context)
    sources, polygons = context.sources, beam_spots(context, beams)
    rest, alone = context.under(sources.without(beams)), context.under(sources.only(beams))
    if polygons is None:
        return Split(rest, alone, None, rest)
    spots = sources.only(beams[:0]).with_polygons(polygons)
    both = rest.sources.with_polygons(polygons)
    return Split(rest, alone, context.under(spots), context.under(both))


def find_beams(context: Context) -> np.ndarray:
    """(k,) int: the lights that are beams. There are none in scenes with objects that diffuse rays or shadow rays pass
    through: particles do not."""
    sources = context.sources
    if not context.all_rays_alike:
        return np.zeros(0, int)
    used = sources.used()
    used = used[sources.block[used] == 0]
    found = [_beams_of(context, batch, used[sources.batch[used] == number])
             for number, batch in enumerate(sources.batches)]  # fmt: skip
    return np.concatenate([np.zeros(0, int), *found])


def _beams_of(context: Context, batch: LightBatch, lights: np.ndarray) -> np.ndarray:
    """The beams among the ``lights`` (n,) int of a batch."""
    index, (angle, radius) = context.sources.index, batch.cones()
    spots = lights[np.isfinite(angle[index[lights]])]
    if len(spots) == 0:
        return spots
    own = index[spots]
    xi = np.tile(sobol(TRIAL, 2, Stream.BEAM_TRIALS), (len(spots), 1))
    xi = np.hstack([xi, np.zeros_like(xi)])  # from the lights' middles
    left, hits = _shot(context, batch, np.repeat(own, TRIAL), xi)
    met = hits.triangle >= 0
    normal = context.geometry.normal[hits.triangle[met]]
    cosine = np.abs(np.einsum("ij,ij->i", normal, left.direction[met]))
    across = np.zeros(len(met))
    across[met] = hits.distance[met] ** 2 / np.maximum(cosine, STEEPEST)
    lit = angle[own] * across.reshape(len(spots), TRIAL).mean(axis=1)
    lit += np.pi * radius[own] ** 2
    landed = met.reshape(len(spots), TRIAL).mean(axis=1)
    return spots[(landed > LANDED) & (lit < NARROW * context.geometry.area.sum())]


def beam_spots(context: Context, beams: np.ndarray) -> Polygons | None:
    """The first reflection of ``beams`` (k,) int as flat lights: an ellipse on each plane that a beam
    lights, with the mean position and the spread of the particles that land there, and their power.
    None where nothing is reflected."""
    found = [spot for light in beams for spot in _spots_of(context, light)]
    if not found:
        return None
    return lamp_polygons(*(np.array(column) for column in zip(*found)))


def _spots_of(context: Context, light: int) -> Iterator[tuple]:
    """Yield what a beam makes: arguments of ``lamp_polygons``."""
    position, normal, power = _landed(context, light)
    brightness = power.mean(axis=1)
    if brightness.sum() <= 0:
        return
    facing = np.rint(ALIKE * np.column_stack([normal, (position * normal).sum(axis=1)])).astype(int)
    plane = np.unique(facing, axis=0, return_inverse=True)[1].reshape(-1)
    share = np.bincount(plane, brightness) / brightness.sum()
    kept = share > FAINT
    for number in np.flatnonzero(kept):
        mine = plane == number
        total = power[mine].sum(axis=0) / share[kept].sum()
        yield _ellipse(position[mine], normal[mine][0], brightness[mine], total)


def _ellipse(
    position: np.ndarray, normal: np.ndarray, brightness: np.ndarray, power: np.ndarray
) -> tuple[np.ndarray, int, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Arguments of ``lamp_polygons``, of ``power`` (channels,): an even ellipse whose second moments are those of
    positions (n, 3) with weights ``brightness`` (n,) on one plane. Along a half axis a they are a² / 4."""
    weight = brightness / brightness.sum()
    middle = weight @ position
    axes = np.stack(tangents(normal[:, None]))[:, :, 0]
    flat = (position - middle) @ axes.T
    moments, directions = np.linalg.eigh((weight[:, None] * flat).T @ flat)
    half = np.maximum(2 * np.sqrt(np.maximum(moments, 0)), SMALLEST)
    u, v = (2 * h * (t @ axes) for h, t in zip(half, directions.T))
    area = np.pi * half.prod()
    return power / (np.pi * area), ELLIPSE, middle - (u + v) / 2, u, v, normal, np.pi


def _landed(context: Context, light: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions (n, 3) where particles of a beam landed, normals of the sides (n, 3), and the power
    (n, channels) that is reflected there."""
    batch, index = context.sources.named(light)
    xi = sobol(PARTICLES, 4, context.seed, Stream.BEAMS, light)
    left, first = _shot(context, batch, np.full(PARTICLES, index), xi)
    power = batch.color[index] * (left.power / PARTICLES)[:, None]
    met = [(np.arange(PARTICLES), first, np.ones(power.shape))]
    if context.transmits.any():
        met += followed(context, left.origin, left.direction, first)
    parts = []
    for rays, hits, weight in met:
        some = np.flatnonzero(hits.triangle >= 0)
        triangle, front = hits.triangle[some], hits.front[some]
        uv = np.stack([hits.u[some], hits.v[some]], 1).astype(float)
        back = context.reflectance(triangle, uv, front) * power[rays[some]] * weight[some]
        dark = context.sources.unlinked(light, context.scene, triangle)
        if dark is not None:
            back[dark] = 0
        normal = np.where(front[:, None], 1, -1) * context.geometry.normal[triangle]
        parts.append((context.geometry.at(triangle, uv), normal, back))
    return tuple(np.concatenate(part) for part in zip(*parts))


def _shot(
    context: Context, batch: LightBatch, which: np.ndarray, xi: np.ndarray
) -> tuple[Leaving, Hits]:
    """Particles of lights ``which`` (n,), in float32, and what they hit. See ``LightBatch.leave``."""
    left = batch.leave(which, xi)
    left = replace(left, origin=np.ascontiguousarray(left.origin, np.float32),
                   direction=np.ascontiguousarray(left.direction, np.float32))  # fmt: skip
    return left, context.tracer.intersect(left.origin, left.direction)
