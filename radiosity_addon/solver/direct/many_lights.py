"""Many lights: direct light where there are so many lights that every point samples only a few of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..lights.context import Context
from ..lights.light_sampler import PER_POINT, sample_lights
from ..sampling.points import Middles, Points, light_coordinates, shifted
from ..sampling.sobol import sobol
from .transmission import visible_samples


def sampled_light(
    context: Context, points: Points, middles: Middles, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(R, channels) irradiance from the lights in samplers, and the variance (R,) of its channels' mean
    that the choice leaves. Owners that are flat choose for all of their points at once; points of
    others each for themselves."""
    if middles.flat.all():
        return _sampled_at_flat(context, points, middles, key)
    count = points.shape[1]
    irradiance, variance = np.zeros((count, context.channels)), np.zeros(count)
    for flat in (True, False):
        some = np.flatnonzero(middles.flat == flat)
        if len(some) == 0:
            continue
        part = points.take(some) if flat else points.take(some).single()
        light, squares = _sampled_at_flat(context, part, part.middles(), (*key, 4 + flat))
        repeats = part.shape[1] // len(some)  # points that are owners of their own
        irradiance[some] = light.reshape(-1, len(some), context.channels).mean(axis=0)
        variance[some] = squares.reshape(-1, len(some)).mean(axis=0) / repeats
    return irradiance, variance


def _sampled_at_flat(
    context: Context, points: Points, middles: Middles, key: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """The same for owners that are flat."""
    per, count = points.shape
    position, normal = (array.reshape(-1, 3) for array in (points.position, points.normal))
    position, normal = position.astype(float), normal.astype(float)
    irradiance, choices = np.zeros((count, context.channels)), 0
    total, square = np.zeros((2, count))
    mean = np.full(context.channels, 1 / context.channels)
    for light, factor, shading in _light_samples(context, points, middles, key):
        coordinates = light_coordinates(points, *key, choices, 3)
        xi = np.stack([axis.ravel() for axis in coordinates], 1)
        choices += 1
        arriving = np.zeros((per * count, context.channels))
        for sample, color, rows in _samples(context, light, position, normal, xi):
            triangle = points.triangle.ravel()[rows]
            dark = context.sources.unlinked(light[rows], context.scene, triangle)
            if dark is not None:
                sample = sample.darkened(dark)
            origins = points.position.reshape(-1, 3)[rows]
            shade = points.shade and points.shade.together().rows(rows)
            blockers = context.blockers[shading]
            found = visible_samples(context, blockers, origins, sample, shade)
            found *= sample.irradiance[:, None]
            arriving[rows] = found * factor[rows, None] * color
        irradiance += arriving.reshape(per, count, -1).mean(axis=0)
        brightness = (arriving @ mean).reshape(per, count)
        total += brightness.sum(axis=0)
        square += (brightness * brightness).sum(axis=0)
    return irradiance, _variance(total, square, choices, per)


def _variance(total: np.ndarray, square: np.ndarray, choices: int, per: int) -> np.ndarray:
    """(R,) variance of sums over ``choices`` of means over ``per`` points, from the ``total`` and
    the ``square`` sum (R,) of all these numbers."""
    many = choices * per
    if many < 2:
        return np.zeros(len(total))
    return np.maximum(square - total**2 / many, 0) / (many - 1) * choices / per


def _light_samples(
    context: Context, points: Points, middles: Middles, key: tuple[int, ...]
) -> Iterator[tuple]:
    """Yield (light, factor, row): for each of n points the light chosen (n,) int, one over its probability and over the
    number of choices (n,), and the number of the blockers that shade all of these lights."""
    per, count = points.shape
    for number, sampler in enumerate(context.sources.samplers):
        table = sobol(per, 6, *key, 2, number)[:, 5:]
        xi = shifted(table, points.shift[:, 0].astype(float))
        xi = (xi + np.arange(PER_POINT)[:, None, None]) / PER_POINT  # a point's choices lie apart
        lights, factors = sample_lights(
            context.sources.importance, sampler, middles.position.T, middles.normal.T, middles.extent,
            xi.reshape(-1, count),
        )
        for pair in zip(*(array.reshape(PER_POINT, -1) for array in (lights, factors / PER_POINT))):
            yield *pair, sampler.shading


def _samples(
    context: Context, light: np.ndarray, position: np.ndarray, normal: np.ndarray, xi: np.ndarray
) -> Iterator[tuple]:
    """Yield (sample, color, rows) of each batch: ``rows``, (k,) int or a slice of all, are the points whose ``light``
    (n,) int is of that batch; the sample and the color (k, channels) are theirs."""
    sources = context.sources
    batches = sources.batch[light]
    for number, batch in enumerate(sources.batches):
        rows = np.flatnonzero(batches == number)
        if len(rows):
            rows = slice(None) if len(rows) == len(light) else rows
            index = sources.index[light[rows]]
            sample = batch.sample(index, position[rows], normal[rows], xi[rows])
            color = np.take(batch.color, index, axis=0)
            if sample.tint is not None:
                color = color * sample.tint
            if sample.surface is not None:
                varied, triangle, uv = sample.surface
                color[varied] = context.emission(triangle, uv)
            yield sample, color, rows
