"""Lighting: sums of light over a replicate's points and rays, at each receiver."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import gcd

import numpy as np

from ..direct.beams import Split
from ..direct.irradiance import direct_light
from ..geometry.footprints import Footprints
from ..sampling.guide import Guide, Lesson
from ..sampling.points import PointSampler, PointsOnFootprints
from ..sampling.sobol import uniform
from ..sampling.streams import Stream
from ..transport.onward import Ends, join_ends
from ..transport.radiosity import Radiosity
from .gather import Bundle, Gathered, gather
from .late_rows import light_of_unknown

MOST_RAYS = 1 << 23  # number [rays] gathered at a time: bounds the memory of their ends
# Offset [of a word of a random key]: the keys of a part's later pieces have it, plus where the piece starts, so that
# their words are different from all numbers of groups.
PIECE_OFFSET = 1 << 20
MOST_POINTS = 256  # number [points of a receiver] that share its rays in one round
Samples = list[tuple[np.ndarray, int]]  # [(owners (k,) int, samples of each)]


@dataclass
class Lighting:
    """Sums (count, channels) and their numbers of samples (count, 1), filled in place."""

    direct: np.ndarray
    beams: np.ndarray  # the part of ``direct`` that beams bring
    points: np.ndarray
    bounced: np.ndarray
    first: np.ndarray
    rays: np.ndarray
    correction: np.ndarray  # (count, channels) float32 mean irradiance that bounced light lacks

    def means(self, unit: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Irradiances (count, channels) float32 in ``unit``: from explicit lights, bounced, and
        gathered first-hand."""
        points, rays = (1 / (unit * np.maximum(n, 1)) for n in (self.points, self.rays))
        sums = (self.direct, points), (self.bounced, rays), (self.first, rays)
        direct, bounced, first = (
            np.multiply(total, share, out=np.empty(total.shape, np.float32), casting="same_kind")
            for total, share in sums
        )
        bounced += self.correction * np.float32(1 / unit)
        return direct, bounced, first

    def typical(self) -> float:
        """About the mean irradiance."""
        points, rays = (max(float(n.sum()), 1.0) for n in (self.points, self.rays))
        channels = self.direct.shape[1]
        gathered = float(self.bounced.sum() + self.first.sum()) / rays
        return (float(self.direct.sum()) / points + gathered) / channels

    def forget_gathered(self, receivers: np.ndarray | slice = slice(None)) -> None:
        """Start the sums over rays anew, of ``receivers`` (k,) int: the radiosities they read have changed."""
        for sums in (self.bounced, self.first, self.rays, self.correction):
            sums[receivers] = 0


def no_light(count: int, channels: int) -> Lighting:
    """Nothing summed yet."""
    widths = (channels, channels, 1, channels, channels, 1)
    sums = (np.zeros((count, width)) for width in widths)
    return Lighting(*sums, np.zeros((count, channels), np.float32))


def points_on_footprints(
    footprints: Footprints, owners: np.ndarray, per: int, *key: int
) -> PointSampler:
    """``per`` points on the footprints of ``owners`` (n,) int."""
    return PointsOnFootprints(footprints, owners, uniform((len(owners), 3), *key), per, key)


def _simple_first(footprints: Footprints, owners: np.ndarray) -> np.ndarray:
    """Owners of one cell before those of several: a chunk of the first kind costs less."""
    return owners[np.argsort(np.diff(footprints.start)[owners] > 1, kind="stable")]


def _add(sums: np.ndarray, owners: np.ndarray, values: np.ndarray) -> None:
    """Add values (k, c) to sums (count, c) of different ``owners`` (k,), a column at a time."""
    for channel in range(sums.shape[1]):
        sums[owners, channel] += values[:, channel]


def add_direct(
    split: Split, footprints: Footprints, lighting: Lighting, owners: np.ndarray, per: int,
    *key: int,
) -> None:
    """Add ``per`` points of explicit light to each of ``owners`` (k,) int."""
    key = (split.rest.seed, Stream.DIRECT, *key)
    owners = _simple_first(footprints, owners)
    sample_points = points_on_footprints(footprints, owners, per, *key)
    irradiance, _ = direct_light(split.rest, len(owners), per, sample_points, key, "gather")
    if split.beams is not None:
        light, _ = direct_light(split.beams, len(owners), per, sample_points, (*key, 1), "gather")
        _add(lighting.beams, owners, per * light)
        irradiance += light
    _add(lighting.direct, owners, per * irradiance)
    lighting.points[owners] += per


@dataclass(frozen=True)
class Aim:
    """How gathered rays are aimed: by a ``guide``, or where it is None by the cosine law; and whether
    they are to teach how the next ones are."""

    guide: Guide | None = None
    learns: bool = False


def add_gathered(
    split: Split, footprints: Footprints, lighting: Lighting, radiosity: Radiosity, parts: Samples,
    *key: int, aim: Aim,
) -> tuple[Radiosity, list[Lesson]]:
    """Add gathered rays: ``parts`` are [(owners (k,) int, rays of each)]. A ray that a guide aimed counts as the
    number of unaimed rays that would have its variance.

    Returns the radiosity, with that of all that the rays met, and lessons where rays are to teach. The light of
    beams' spots is added at each point.
    """
    key, lessons = (split.reflected.seed, Stream.GATHER, *key), []
    for number, batch in enumerate(batches_of(parts)):
        unknown = []
        for owners, rays, *piece in batch:
            owners = _simple_first(footprints, owners)
            per = gcd(rays, int(np.clip(rays // 4, 4, MOST_POINTS)))  # every point has as many rays
            own_key = (*key, rays, *piece)
            sample_points = points_on_footprints(footprints, owners, per, *own_key)
            bundle = Bundle(owners, rays, sample_points, own_key, aim.guide)
            found = gather(split.reflected, radiosity, bundle, "gather", aim.learns)
            unknown.append(_add_bundle(split, lighting, bundle, per, found))
            lessons += found.lessons
        bounced, first, radiosity = light_of_unknown(
            split.reflected, radiosity, join_ends(unknown, split.reflected.channels),
            footprints.count, (*key, 9, *([number] if number else [])),
        )  # fmt: skip
        lighting.bounced[:] += bounced
        lighting.first[:] += first
    return radiosity, lessons


def batches_of(parts: Samples) -> list[list[tuple]]:
    """``parts`` cut into pieces of at most MOST_RAYS rays, which are grouped into batches of at most as many. A piece
    is (owners, rays of each, what its random key has in addition: nothing for a part's first piece)."""
    batches, size = [], MOST_RAYS
    for owners, rays in parts:
        step = max(1, MOST_RAYS // rays)
        for start in range(0, len(owners), step):
            piece = owners[start : start + step]
            if size + len(piece) * rays > MOST_RAYS:
                batches.append([])
                size = 0
            batches[-1].append((piece, rays, *([PIECE_OFFSET + start] if start else [])))
            size += len(piece) * rays
    return batches


def _add_bundle(
    split: Split, lighting: Lighting, bundle: Bundle, per: int, found: Gathered
) -> Ends:
    """Add what a bundle's rays ``found``, and the light of beams' spots at its points, ``per`` owner.
    Returns where nothing is known, weighted as the sums are."""
    owners = bundle.owners
    worth = np.full((len(owners), 1), bundle.rays, float)
    if bundle.guide is not None:
        worth *= bundle.guide.worth[bundle.guide.cluster[owners]][:, None]
    bounced = found.bounced
    if split.spots is not None:
        light, _ = direct_light(
            split.spots, len(owners), per, bundle.sample_points, (*bundle.key, 7), "gather"
        )
        bounced = bounced + light
    _add(lighting.bounced, owners, worth * bounced)
    _add(lighting.first, owners, worth * found.first)
    lighting.rays[owners] += worth
    ends = found.unknown
    return replace(ends, owner=owners[ends.owner], weight=ends.weight * worth[ends.owner])
