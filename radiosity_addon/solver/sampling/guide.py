"""Guide: where on the hemisphere light comes from, learned from rays already traced.

A ray's cosine-distributed direction is a place in the unit square (``sampling``:
the squared sine of its polar angle, and its azimuth). The square is cut into bins; in each of many
clusters of neighboring receivers every bin gets the share of the later rays that is best for what
the earlier ones brought back through it: in proportion to the root of the mean square (Vorba et al.
2014, "On-line Learning of Parametric Mixture Models", for the idea; Owen 2013, "Monte Carlo theory,
methods and examples", section 9.1, for the optimum). A share remains for all bins alike, and
weights make up for the choice, so that means stay what they are whatever was learned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.clusters import cubes, facings, labels
from ..geometry.vectors import unit_rows

ROWS, COLUMNS = 8, 16  # numbers [bins] of polar angle and azimuth
BINS = ROWS * COLUMNS
CLUSTERS = 256  # number [clusters], about; more where there are many receivers
RECEIVERS = 256  # number [receivers of a cluster], at least, where there are many
SLOTS = 4 * BINS  # number [slots]: at least one a bin, so that no ray weighs more than 4
MOST_GAIN = 6.0  # factor [variance without a guide over that with one] that is believed, at most
# Factor [as above], mean over rays, from which on a guide pays for itself: where most light comes through
# a small window. Below it, rays in Sobol sets that all receivers share are as good, and cost less.
USEFUL = 4.5


def clusters_of(position: np.ndarray, normal: np.ndarray, area: np.ndarray) -> np.ndarray:
    """(count,) int: the same number for receivers that share a cube and a facing.

    ``position``, ``normal`` (count, 3), ``area`` (count,); normals need not be unit.
    """
    number = max(CLUSTERS, min(len(area) // RECEIVERS, 16 * CLUSTERS))
    size = np.sqrt(area.sum() / number) or 1.0
    return labels(cubes(position, size), facings(unit_rows(normal)))


@dataclass(frozen=True)
class PlainRays:
    """Rays that no guide aimed, and the light they brought. Their bins are computed when a guide is learned
    from them, which most bakes do not come to."""

    xi: np.ndarray  # (rays, 2) places in the unit square
    shift: np.ndarray  # (R,) what an owner's azimuths are shifted by, in revolutions
    owners: np.ndarray  # (R,) int: receivers
    light: np.ndarray  # (rays · R,) float32


@dataclass(frozen=True)
class BinSums:
    """What rays add to the three sums of ``clusters`` (k,): [(k, BINS)]. No more is kept of a
    chunk of receivers."""

    clusters: np.ndarray
    sums: list[np.ndarray]


Lesson = PlainRays | BinSums


def sums_by_bin(bins: np.ndarray, light: np.ndarray) -> BinSums:
    """Of rays in ``bins`` (rays, R) that brought ``light`` (rays · R,)."""
    clusters, column = np.unique(bins[0] // BINS, return_inverse=True)
    shift = (column - clusters[column]) * BINS
    bins = (bins + shift.astype(bins.dtype)).ravel()
    weights = (None, light, light * light)
    size = len(clusters) * BINS
    found = [np.bincount(bins, weight, size).reshape(-1, BINS) for weight in weights]
    return BinSums(clusters, found)


@dataclass
class Learning:
    """Sums over rays by bin, (n_clusters · BINS,) each, filled in place. Rays spread evenly
    inside a bin, whatever brings them there, so that all count alike."""

    cluster: np.ndarray  # (count,) of each receiver
    number: np.ndarray
    light: np.ndarray
    square: np.ndarray

    def bins(self, xi: np.ndarray, shift: np.ndarray, owners: np.ndarray) -> np.ndarray:
        """(rays, R) bins of rays at ``xi`` (rays, 2) of ``owners`` (R,), whose azimuths are
        shifted by ``shift`` (R,)."""
        row = np.minimum((xi[:, :1] * ROWS).astype(np.int32), ROWS - 1)
        column = (((xi[:, 1:] + shift) % 1) * COLUMNS).astype(np.int32) % COLUMNS
        return (self.cluster[owners] * BINS + row * COLUMNS) + column

    def add(self, lesson: Lesson) -> None:
        """Add what rays brought."""
        if isinstance(lesson, PlainRays):
            bins = self.bins(lesson.xi, lesson.shift, lesson.owners)
            lesson = sums_by_bin(bins, lesson.light)
        for mine, more in zip((self.number, self.light, self.square), lesson.sums):
            mine.reshape(-1, BINS)[lesson.clusters] += more


def joined(before: Learning | None, *more: Learning) -> Learning:
    """What all have learned about the same clusters."""
    parts = [part for part in (before, *more) if part is not None]
    names = ("number", "light", "square")
    return Learning(
        parts[0].cluster, *(sum(getattr(part, name) for part in parts) for name in names)
    )


def start_learning(cluster: np.ndarray) -> Learning:
    """Nothing learned yet about ``cluster`` (count,)."""
    size = (int(cluster.max(initial=-1)) + 1) * BINS
    return Learning(cluster, np.zeros(size), np.zeros(size), np.zeros(size))


@dataclass(frozen=True)
class Guide:
    """Bins that rays go through, by cluster: SLOTS equally likely slots, some for each bin."""

    cluster: np.ndarray  # (count,)
    bin: np.ndarray  # (n_clusters · SLOTS,) int32: number of each slot's bin, among all clusters'
    # A ray that takes the number u of [0, SLOTS) in its cluster's slots goes through the height
    # scale · u + start of the unit square of directions.
    scale: np.ndarray  # (n_clusters · BINS,) float32, of each bin: its height per slot
    start: np.ndarray  # (n_clusters · BINS,) float32
    column: np.ndarray  # (n_clusters · BINS,) float32: left edge of each bin
    weight: np.ndarray  # (n_clusters · BINS,) float32 of a ray through a bin
    worth: np.ndarray  # (n_clusters,) how many rays without it one ray counts for

    def aim(
        self, owners: np.ndarray, u: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places, (rays, R) float32 each, in the square for uniform ``u`` and ``v`` (rays, R)
        float32 of ``owners`` (R,), and the bins (rays, R) they are in."""
        height = u * np.float32(SLOTS)
        slot = np.minimum(height.astype(np.int32), SLOTS - 1)
        slot += (self.cluster[owners] * SLOTS).astype(np.int32)
        bin = np.take(self.bin, slot)
        height *= np.take(self.scale, bin)
        height += np.take(self.start, bin)
        np.clip(height, 0, np.float32(1 - 1e-6), out=height)
        across = v * np.float32(1 / COLUMNS)
        across += np.take(self.column, bin)
        return height, across, bin


def make_guide(learned: Learning, useful: float = USEFUL) -> Guide | None:
    """The guide for what was learned; None where its gain is below ``useful``."""
    number = np.maximum(learned.number, 1).reshape(-1, ROWS, COLUMNS)
    square = learned.square.reshape(number.shape) / number
    light = learned.light.reshape(number.shape) / number
    slots = _slots(np.sqrt(square).reshape(-1, BINS))
    gain = _gain(square, light, (slots / SLOTS).reshape(square.shape))
    rays = learned.number.reshape(-1, BINS).sum(axis=1)
    if rays.sum() == 0 or (rays @ gain) / rays.sum() < useful:
        return None
    first = (np.cumsum(slots, axis=1) - slots).ravel()
    number, count = np.arange(slots.size), slots.ravel()
    scale = 1 / (ROWS * count)
    row, column = number % BINS // COLUMNS, number % COLUMNS
    return Guide(
        learned.cluster,
        np.repeat(number, count).astype(np.int32),
        scale.astype(np.float32),
        (row / ROWS - first * scale).astype(np.float32),
        (column / COLUMNS).astype(np.float32),
        (SLOTS / (BINS * count)).astype(np.float32),
        np.sqrt(gain),  # independent rays would gain so much; those in Sobol sets less, measured
    )


def _slots(share: np.ndarray) -> np.ndarray:
    """(n, BINS) int >= 1 that sum to SLOTS: one for every bin, the rest in proportion to
    ``share`` (n, BINS), rounded by largest remainders."""
    total = share.sum(axis=1, keepdims=True)
    share = np.where(total > 0, share / np.where(total > 0, total, 1), 1 / BINS)
    wanted = (SLOTS - BINS) * share
    slots = np.floor(wanted)
    rank = np.argsort(np.argsort(slots - wanted, axis=1, kind="stable"), axis=1, kind="stable")
    slots += rank < (SLOTS - BINS) - slots.sum(axis=1, keepdims=True)
    return slots.astype(np.int64) + 1


def _gain(square: np.ndarray, light: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(n_clusters,) variance of an independent ray without the guide over that of one with it."""
    mean = light.mean(axis=(1, 2)) ** 2
    plain = square.mean(axis=(1, 2)) - mean
    guided = (square / share).mean(axis=(1, 2)) / BINS - mean
    small = 1e-3 * mean + 1e-30
    return np.clip((plain + small) / (np.maximum(guided, 0) + small), 1, MOST_GAIN)
