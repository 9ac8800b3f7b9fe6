"""Transmission: what rays meet on their way through surfaces that let light through.

A cutout leaf or a pane of glass reflects its share and lets the rest straight on, tinted. Scenes
without such surfaces never come here.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..geometry.triangles import OFFSET
from ..lights.context import Context
from ..lights.light_batch import Sample
from ..sampling.shade import Shade
from ..tracing.blockers import Blockers
from ..tracing.embree import Hits

MAX_LAYERS = 64  # number [surfaces] that a ray is followed through
FAINT = 1e-3  # share [of a ray's light]: fainter rays are not followed


def followed(
    context: Context, origins: np.ndarray, directions: np.ndarray, hits: Hits
) -> Iterator[tuple]:
    """Yield (rays, hits, weight) for what unit-direction rays meet behind their first ``hits``.

    ``rays`` (k,) int numbers the rays that still go on, ``hits`` what they meet next (triangle -1
    where they leave), ``weight`` (k, channels) float32 the share of light that has come through.
    """
    rays = np.arange(len(origins))
    weight = np.ones((len(origins), context.channels), np.float32)
    for _ in range(MAX_LAYERS):
        through = context.transmits[np.maximum(hits.triangle, 0)] & (hits.triangle >= 0)
        index = np.flatnonzero(through)
        if len(index) == 0:
            return
        share = weight[index] * _transmittance(context, hits, index)
        bright = share.max(axis=1) > FAINT
        index, weight = index[bright], share[bright]
        if len(index) == 0:
            return
        step = (hits.distance[index] + 2 * OFFSET)[:, None]
        rays, directions = rays[index], directions[index]
        origins = origins[index] + step * directions
        hits = context.tracer.intersect(origins, directions)
        yield rays, hits, weight


def visibility(
    context: Context, blockers: Blockers, origins: np.ndarray, segments: np.ndarray, length: float,
    shade: Shade | None = None,
) -> np.ndarray:
    """(n,) bool, or (n, channels) where blockers transmit: share of light along segments.

    ``segments`` need not be unit; light starts at ``length`` of them. ``shade`` of the origins,
    where they have one, moves them and takes its share.
    """
    if shade is not None:
        return _shaded_visibility(context, blockers, origins, segments, length, shade)
    clear = blockers.shadow.clear(origins, segments, length)
    if blockers.transmitting is None:
        return clear
    share = np.repeat(clear[:, None].astype(float), context.channels, axis=1)
    rays = np.flatnonzero(clear)
    size = np.linalg.norm(segments[rays], axis=1)
    directions = segments[rays] / size[:, None]
    left = size * length
    origins = origins[rays]
    for _ in range(MAX_LAYERS):
        if len(rays) == 0:
            return share
        hits = blockers.transmitting.intersect(
            np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32)
        )
        index = np.flatnonzero((hits.triangle >= 0) & (hits.distance < left))
        share[rays[index]] *= _transmittance(context, hits, index)
        index = index[share[rays[index]].max(axis=1) > FAINT * FAINT]
        step = hits.distance[index] + 2 * OFFSET
        rays, directions, left = rays[index], directions[index], left[index] - step
        origins = origins[index] + step[:, None] * directions
    share[rays] = 0
    return share


def _shaded_visibility(
    context: Context, blockers: Blockers, origins: np.ndarray, segments: np.ndarray, length: float,
    shade: Shade,
) -> np.ndarray:
    """``visibility`` of segments (n, 3) that start at the rounded surface of ``shade``, times the share
    by which its normals count light from there."""
    start, way = shade.lifted(origins, segments), segments
    if start is not origins and np.isfinite(length):
        way = segments - (start - origins)
    visible = visibility(context, blockers, start, way, length)
    share = shade.share(segments)
    return visible * (share if visible.ndim == 1 else share[:, None])


def visible_samples(
    context: Context, blockers: Blockers, origins: np.ndarray, sample: Sample,
    shade: Shade | None = None,
) -> np.ndarray:
    """(n, 1 or channels) float64 share of a light's ``sample`` that comes through to ``origins``
    (n, 3); 0 where it carries nothing: no ray is traced there."""
    carrying = np.flatnonzero(sample.irradiance > 0)
    share = np.zeros((len(sample.irradiance), 1 if blockers.transmitting is None else context.channels))
    if len(carrying):
        share[carrying] = visibility(
            context, blockers, origins[carrying], sample.segment[carrying], sample.length,
            shade and shade.rows(carrying),
        ).reshape(len(carrying), -1)
    return share


def _transmittance(context: Context, hits: Hits, index: np.ndarray) -> np.ndarray:
    """(k, channels) float32 transmittance where the hits ``index`` (k,) int are."""
    uv = np.stack([hits.u[index], hits.v[index]], 1).astype(float)
    found = context.transmittance(hits.triangle[index], uv, hits.front[index])
    return found.astype(np.float32)
